"""Pictures on surfaces, against look-ups in float64: inside, at borders, beyond them; and in every estimator."""

import numpy as np
import pytest
from oracles import textures as oracle
from shapes import SQUARE

import taichi_tracer as tt
from taichi_tracer.geometry import Mesh

pytestmark = pytest.mark.usefixtures("f32")

PIXELS = np.random.default_rng(7).random((5, 7, 3))


def looked_up(texture, corners):
    """(9, 9, 3): what a square shows whose corners have these texture coordinates, one colour per pixel."""
    mesh = Mesh(*map(np.array, SQUARE), materials=[tt.Material(Kd=(1, 1, 1), map_Kd=texture)])
    mesh.corner_uv = np.asarray(corners, float)[mesh.faces]
    camera = tt.OrthographicCamera(9, 9, eye=(0, 0, 5), at=(0, 0, 0), up=(0, 1, 0), screen_window=(-1, 1, -1, 1))
    return tt.RT3Renderer(tt.SceneData(mesh), camera=camera).use("flat").render().image()


def coordinates(corners):
    """(9, 9, 2) the texture coordinates of the same pixels: SQUARE has its corners at (±1, ±1)."""
    vertices, corners = np.array(SQUARE[0], float), np.asarray(corners, float)
    centres = (2 * (np.arange(9) + 0.5) / 9 - 1)[::-1]
    x, y = np.meshgrid(centres, centres)  # the camera looks along −z, so that +x is at its left
    solved = np.linalg.lstsq(np.column_stack([vertices[:, :2], np.ones(4)]), corners, rcond=None)[0]
    return np.stack([x, y, np.ones_like(x)], axis=-1) @ solved


@pytest.mark.parametrize("wrap", [("repeat", "clamp"), ("clamp", "mirror"), ("mirror", "repeat")])
@pytest.mark.parametrize("region", [((-3.3, 2.4), 5.1), ((-0.06, 0.93), 0.13)])
def test_texels_are_those_of_the_oracle(wrap, region):
    (low_u, low_v), size = region
    corners = np.array(SQUARE[0], float)[:, :2] * size / 2 + size / 2 + [low_u, low_v]
    found = looked_up(tt.Texture(PIXELS, wrap), corners)
    for row, of_row in zip(found, coordinates(corners), strict=True):
        for color, uv in zip(row, of_row, strict=True):
            np.testing.assert_allclose(color, oracle.bilinear(PIXELS, uv, wrap), atol=2e-5)


@pytest.mark.parametrize("estimator", ["mis"])
def test_the_reflectance_is_that_of_the_texel(estimator):
    """Under light of 1 from everywhere, a matte wall shows Kd times the texel; one without a texture shows Kd."""
    color = np.array([0.9, 0.5, 0.1])
    vertices = np.concatenate([SQUARE[0], SQUARE[0] + [4, 0, 0]])
    faces = np.concatenate([SQUARE[1], SQUARE[1] + 4])
    texture = tt.Texture(np.broadcast_to(color, (2, 2, 3)))
    materials = [tt.Material(Kd=(0.5, 0.5, 0.5), map_Kd=texture), tt.Material(Kd=(0.25, 0.5, 0.75))]
    uv, ids = vertices[:, :2], [0, 0, 1, 1]
    scene = tt.scene_from_mesh(vertices, faces, material=materials, face_materials=ids, uv=uv, environment="white")
    kind = tt.A4Renderer if estimator == "path" else tt.A2Renderer
    for x, expected in ((0, color / 2), (4, [0.25, 0.5, 0.75])):
        camera = tt.Camera(8, 8, eye=(x, 0, 5), at=(x, 0, 0), up=(0, 1, 0), fov=1)
        image = kind(scene, camera=camera).use(estimator).render(256 if estimator == "uniform" else 8).image()
        np.testing.assert_allclose(image.mean(axis=(0, 1)), expected, rtol=0.02)


@pytest.mark.parametrize("has_texture", [False, True])
def test_colours_of_vertices_are_between_those_of_the_corners(has_texture):
    """Times the texture, if there is one, too."""
    colors = np.array([[1, 0, 0], [0, 1, 0], [0, 0, 1], [1, 1, 0.5]])
    mesh = Mesh(*map(np.array, SQUARE), materials=[tt.Material(Kd=(1, 1, 1))])
    mesh.corner_color = colors[mesh.faces]
    factor = 1.0
    if has_texture:
        mesh.materials = [tt.Material(Kd=(1, 1, 1), map_Kd=tt.Texture(PIXELS[:1, :1]))]
        mesh.corner_uv, factor = np.zeros((2, 3, 2)), PIXELS[0, 0]
    scene = tt.SceneData(mesh)
    camera = tt.OrthographicCamera(9, 9, eye=(0, 0, 5), at=(0, 0, 0), up=(0, 1, 0), screen_window=(-1, 1, -1, 1))
    image = tt.RT3Renderer(scene, camera=camera).use("flat").render().image()
    hits = scene.intersect(*camera.rays(*np.meshgrid(np.arange(9), np.arange(9)[::-1])))
    u, v = np.asarray(hits.barycentric_coords, float).T
    weights = np.stack([1 - u - v, u, v], axis=-1)
    expected = (weights[:, :, None] * mesh.corner_color[hits.triangle_id]).sum(axis=1) * factor
    np.testing.assert_allclose(image.reshape(-1, 3), expected, atol=1e-5)


def test_a_sphere_is_covered_once():
    """Its longitude is u and its latitude v, as in its barycentric coordinates."""
    mesh = Mesh(np.zeros((0, 3)), np.zeros((0, 3), int), spheres=np.array([[0, 0, 0, 1.0]]))
    mesh.materials, mesh.corner_uv = [tt.Material(Kd=(1, 1, 1), map_Kd=tt.Texture(PIXELS))], np.zeros((0, 3, 2))
    scene = tt.SceneData(mesh)
    camera = tt.Camera(5, 5, eye=(3, 1, 2), at=(0, 0, 0))
    image = tt.RT3Renderer(scene, camera=camera).use("flat").render().image()
    hits = scene.intersect([3, 1, 2], [-3, -1, -2])
    np.testing.assert_allclose(
        image[2, 2], oracle.bilinear(PIXELS, hits.barycentric_coords[0], ("repeat",) * 2), atol=1e-4
    )
