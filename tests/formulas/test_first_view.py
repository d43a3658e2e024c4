"""The view that is chosen for a mesh, and the axis that is taken to point upwards."""

import math
import warnings

import numpy as np
import pytest

import taichi_tracer as tt
from taichi_tracer.files.disk import scene_data_dir
from taichi_tracer.formulas.first_view import best_view, score
from taichi_tracer.formulas.view import FROM, view_of_points
from taichi_tracer.geometry import Mesh
from taichi_tracer.meshes.parts import POINTS, surface_of

CORNERS = np.array([(x, y, z) for x in (0.0, 1.0) for y in (0.0, 1.0) for z in (0.0, 1.0)])
SIDES = ((0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3))


def boxes(*of, leave=()):
    """Boxes of (low, high) corners, whose fronts look outwards; sides with the numbers in ``leave`` are missing."""
    vertices, faces = [], []
    for k, (low, high) in enumerate(of):
        vertices.append(np.array(low) + CORNERS * (np.array(high) - np.array(low)))
        for number, (a, b, c, d) in enumerate(SIDES):
            if number not in leave:
                faces += [[8 * k + a, 8 * k + b, 8 * k + c], [8 * k + a, 8 * k + c, 8 * k + d]]
    return Mesh(vertices=np.concatenate(vertices), faces=np.array(faces, np.int32))


def inside_out(mesh):
    return Mesh(vertices=mesh.vertices, faces=mesh.faces[:, ::-1])


def test_points_are_spread_over_all_surfaces_in_proportion_to_their_area():
    mesh = boxes(((0, 0, 0), (1, 2, 3)))
    mesh.spheres, mesh.sphere_materials = np.array([[9.0, 0, 0, 0.5]]), np.zeros(1, np.int32)
    surface = surface_of(mesh)
    area = 2 * (2 + 3 + 6) + math.pi
    assert surface.area == pytest.approx(area)
    on_sphere = surface.points[:, 0] > 5
    assert on_sphere.mean() == pytest.approx(math.pi / area, rel=2 / POINTS**0.5)
    outward = surface.points[on_sphere] - (9, 0, 0)
    np.testing.assert_allclose(surface.normals[on_sphere], outward / 0.5, atol=1e-12)
    top = np.isclose(surface.points[:, 1], 2) & ~on_sphere
    assert top.mean() == pytest.approx(3 / area, rel=0.01)
    upward = surface.normals[top & (abs(surface.points[:, 0] - 0.5) < 0.4)]
    assert (upward @ (0, 1, 0) > 1 - 1e-9).all()
    np.testing.assert_allclose(surface.points[top].mean(axis=0), (0.5, 2, 1.5), atol=0.02)


def test_a_view_that_shows_more_is_taken():
    """A plate that stands with its edge to the usual camera."""
    azimuth = math.radians(FROM[0])
    across = np.array([math.sin(azimuth), 0, math.cos(azimuth)])
    corners = np.array([a * across + (0, b, 0) for a, b in ((-1, 0), (1, 0), (1, 1), (-1, 1))])
    mesh = Mesh(vertices=corners, faces=np.array([[0, 1, 2], [0, 2, 3]], np.int32))
    found = best_view(surface_of(mesh), "y", [])
    assert found != FROM
    view = found if isinstance(found, dict) else view_of_points(corners, "y", seen_from=found)
    assert score(view, surface_of(mesh)) > 2 * score(view_of_points(corners), surface_of(mesh))


def test_files_are_seen_from_where_most_is_seen_and_this_is_told(tmp_path, f32):
    for name in ("cornell_box", "cube"):
        for suffix in (".obj", ".mtl"):
            (tmp_path / f"{name}{suffix}").write_bytes((scene_data_dir() / f"{name}{suffix}").read_bytes())
    composed, copied = tt.load_scene_data("cornell_box"), tt.load_scene_data(tmp_path / "cornell_box.obj")
    assert copied.view == composed.view
    assert tt.load_scene_data(tmp_path / "cube.obj").view_for(0.5)["eye"][1] > 0
    pillar = boxes(((-1, -1, 0), (1, 1, 0.2)), ((-0.3, -0.3, 0.2), (0.3, 0.3, 2)))
    lines = [f"v {x} {y} {z}" for x, y, z in pillar.vertices] + [f"f {a} {b} {c}" for a, b, c in pillar.faces + 1]
    (tmp_path / "pillar.obj").write_text("\n".join(lines))
    scene = tt.load_scene_data(tmp_path / "pillar.obj")
    assert scene.up_axis == "z"
    assert [note for note in scene.notes if "z points upwards" in note and "--up-axis y" in note]
    asked = tt.load_scene_data(tmp_path / "pillar.obj", up_axis="y")
    assert asked.up_axis == "y"
    assert not [note for note in asked.notes if "upwards" in note]


@pytest.mark.parametrize("up_axis", ["y", "z"])
def test_a_closed_room_is_seen_from_a_corner_above_its_middle(up_axis):
    view = best_view(surface_of(inside_out(boxes(((-2, -2, -2), (2, 2, 2))))), up_axis, [])
    axis = "xyz".index(up_axis)
    assert view["fov"] == 75
    assert view["eye"][axis] == pytest.approx(0.2 * 2)
    assert view["at"][axis] == pytest.approx(-0.1 * 2)
    np.testing.assert_allclose(abs(np.delete(view["eye"], axis)), 0.85 * 2)


@pytest.mark.parametrize("odd", ["nan", "inf", "1e300"])
def test_one_odd_vertex_neither_hides_the_rest_nor_ends_the_loading(odd, tmp_path, f32):
    """A room whose open side is seen, and a triangle that goes to nowhere."""
    room = inside_out(boxes(((-1, -1, -1), (1, 1, 1)), leave=(5,)))
    mesh = Mesh(np.vstack([room.vertices, [[float(odd), 0, 0]]]), np.vstack([room.faces, [[0, 1, 8]]]).astype(np.int32))
    assert abs(surface_of(mesh).points).max() <= 1
    seen = []
    for of in (room, mesh):
        lines = [f"v {x} {y} {z}" for x, y, z in of.vertices] + [f"f {a} {b} {c}" for a, b, c in of.faces + 1]
        (tmp_path / "room.obj").write_text("\n".join(lines))
        with warnings.catch_warnings():
            warnings.filterwarnings("ignore", message=".*triangles dropped")
            seen.append(tt.load_scene_data(tmp_path / "room.obj", ground=True).view["eye"])
    np.testing.assert_allclose(*seen, atol=1e-6)
    assert seen[0][2] > 1
    assert abs(seen[0][0]) < 1e-9
