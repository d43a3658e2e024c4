"""Holes: where the opacity of a material is below 1/2, every ray passes, whichever form traces it."""

import io

import numpy as np
import pytest
from PIL import Image
from shapes import SQUARE

import taichi_tracer as tt
from taichi_tracer.geometry import Mesh

pytestmark = pytest.mark.usefixtures("f32")

CHESS = np.indices((4, 4)).sum(axis=0) % 2.0  # top left 0: a hole
OPACITY = np.repeat(np.kron(CHESS, np.ones((8, 8)))[..., None], 3, axis=2)


def fence(texture=None, ke=(0.0, 0.0, 0.0), floor=True):
    """A square with a chess board of holes one unit above a floor of 4 × 4; both face +z."""
    material = tt.Material("fence", Kd=(0.5, 0.5, 0.5), Ke=ke, map_d=texture)
    vertices, faces = np.array(SQUARE[0], float), np.array(SQUARE[1])
    uv = ((vertices[:, :2] + 1) / 2)[faces]
    materials, ids = [material], np.zeros(len(faces), np.int32)
    if floor:
        vertices = np.concatenate([vertices + [0, 0, 1], vertices * 2])
        faces, uv = np.concatenate([faces, faces + 4]), np.concatenate([uv, uv])
        materials.append(tt.Material("floor", Kd=(0.8, 0.8, 0.8)))
        ids = np.repeat(np.int32([0, 1]), 2)
    return Mesh(vertices, faces, face_materials=ids, materials=materials, corner_uv=uv)


def points(n=4000, seed=3):
    """(n, 2) points of the square that lie inside a field of the board, and whether that is a hole."""
    rng = np.random.default_rng(seed)
    xy = rng.uniform(-0.99, 0.99, (n, 2))
    place = (xy + 1) * 2
    xy = xy[(abs(place - np.round(place)) > 0.1).all(axis=1)]  # the edge of a field is as soft as one texel
    column, row = ((xy + 1) * 2).astype(int).T
    return xy, CHESS[3 - row, column] == 0


@pytest.mark.parametrize("options", [{}, {"intersector": "bvh"}, {"intersector": "brute_force"}])
@pytest.mark.parametrize("test", ["watertight", "moller_trumbore"])
def test_rays_pass_through_holes_alone(options, test):
    xy, is_hole = points()
    origins = np.column_stack([xy, np.full(len(xy), 3.0)])
    directions = np.tile([0.0, 0.0, -1.0], (len(xy), 1))
    scene = tt.SceneData(fence(tt.Texture(OPACITY)), triangle_test=test, **options)
    hits = scene.intersect(origins, directions)
    np.testing.assert_array_equal(hits.distance == 3.0, is_hole)
    np.testing.assert_array_equal(hits.triangle_id < 2, ~is_hole)
    np.testing.assert_array_equal(scene.occluded(origins, directions, t_max=2.5), ~is_hole)


def test_a_lamp_has_no_holes():
    scene = tt.SceneData(fence(tt.Texture(OPACITY), ke=(1.0, 1.0, 1.0)))
    assert not scene.effects.holes
    xy, _ = points(100)
    origins = np.column_stack([xy, np.full(len(xy), 3.0)])
    assert (scene.intersect(origins, np.tile([0.0, 0.0, -1.0], (len(xy), 1))).triangle_id < 2).all()


def png(alpha, mode="RGBA"):
    pixels = np.full((*alpha.shape, 4), 200, np.uint8)
    pixels[..., 3] = 255 * alpha
    stream = io.BytesIO()
    Image.fromarray(pixels if mode == "RGBA" else pixels[..., 3]).save(stream, "PNG")
    return stream.getvalue()


@pytest.mark.parametrize("mode", ["RGBA", "L"])
def test_map_d_of_an_mtl_file(tmp_path, mode):
    (tmp_path / "leaf.png").write_bytes(png(CHESS, mode))
    (tmp_path / "a.mtl").write_text("newmtl m\nKd 1 1 1\nmap_d leaf.png\n")
    corners = "v -1 -1 0\nv 1 -1 0\nv 1 1 0\nv -1 1 0\nvt 0 0\nvt 1 0\nvt 1 1\nvt 0 1\n"
    (tmp_path / "a.obj").write_text(f"mtllib a.mtl\n{corners}usemtl m\nf 1/1 2/2 3/3 4/4\n")
    scene = tt.load_scene_data(tmp_path / "a.obj")
    xy, is_hole = centres()
    found = scene.occluded(np.column_stack([xy, np.ones(16)]), np.tile([0.0, 0.0, -1.0], (16, 1)))
    np.testing.assert_array_equal(found, ~is_hole)
    assert not scene.notes


def centres():
    """The middles of the sixteen fields, and whether they are holes."""
    x, y = np.meshgrid(np.arange(4), np.arange(4))
    return np.column_stack([x.ravel(), y.ravel()]) / 2 - 0.75, CHESS[3 - y.ravel(), x.ravel()] == 0
