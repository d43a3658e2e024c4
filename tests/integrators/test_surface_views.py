"""The six views of every kind of scene against float64, and against their reference pictures."""

import copy
from pathlib import Path

import numpy as np
import pytest
import taichi as ti
import taichi.math as tm
from probe import ask, put
from support import start

import taichi_tracer as tt
from taichi_tracer.integrators import surface_views
from taichi_tracer.ray import no_hit
from taichi_tracer.scene_data_loader import COURSE_VIEW

REFERENCES = Path(__file__).parents[1] / "references"
NAMES = ["hit", "triangle_id", "distance", "barycentric", "normal", "material_id"]
SIZE = 96

pytestmark = pytest.mark.usefixtures("f32")


@pytest.fixture(scope="module")
def box():
    return tt.A1Renderer(scene_data=tt.load_scene_data("cornell_box"), width=SIZE, height=SIZE)


def eight_bit(image):
    """As PNG files have it."""
    return np.round(np.clip(image, 0, 1) * 255).astype(np.int64)


@pytest.mark.parametrize("name", ["normal", "triangle_id"])
def test_every_view_equals_its_reference(name, box):
    """tests/references/make_references.py makes them; they differ by one step of 255 at most."""
    reference = tt.read_image(REFERENCES / f"cornell_box_{name}.png", srgb=False)
    different = np.abs(eight_bit(box.use(name).image()) - eight_bit(reference)).max(axis=-1)
    assert different.shape == (SIZE, SIZE)
    assert (different > 1).sum() == 0


@pytest.mark.parametrize(
    ("farthest", "white"),
    [(1, 10), (3.2, 10), (10, 10), (10.1, 20), (21.6, 50), (50, 50), (51, 100), (1234, 2000)]
    + [(0.99, 1), (0.5, 0.5), (0.021, 0.05), (3e-6, 5e-6), (9.1e11, 1e12), (0, 10), (np.inf, 10), (np.nan, 10)],
)
def test_white_is_the_handouts_10_or_a_round_number_that_fits(farthest, white):
    assert surface_views.fitting_distance(farthest) == pytest.approx(white, rel=1e-12)


def test_the_farthest_corner_is_seen_from_the_eye(box):
    low, high = np.array([-1, 0, 2.0]), np.array([3, 1, 5.0])
    box_of = type("Box", (), {"low": low, "high": high})
    assert surface_views.farthest_corner(box_of, np.array([0, 0.2, 6.0])) == pytest.approx(np.sqrt(9 + 0.64 + 16))


@pytest.fixture(scope="module")
def small():
    """A square of side 0.02, which white at 10 units would show black."""
    square = np.array([[-1, -1, 0], [1, -1, 0], [1, 1, 0], [-1, 1, 0]]) * 0.01
    scene = tt.scene_from_mesh(square, [[0, 1, 2], [0, 2, 3]], intersector="brute_force")
    camera = tt.Camera(8, 8, eye=(0, 0, 0.04), at=(0, 0, 0), fov=20)
    return tt.A1Renderer(scene, camera=camera).use("distance")


def test_a_small_scene_is_not_black_and_white_can_be_chosen(small):
    assert small.max_distance == 0.05
    np.testing.assert_allclose(small.image()[4, 4], 0.04 / 0.05, rtol=1e-2)
    assert ["white is 0.05 units" in note for note in small.notes()] == [True]
    small.max_distance = 0.08
    assert not small.is_current()
    np.testing.assert_allclose(small.image()[4, 4], 0.04 / 0.08, rtol=1e-2)
    assert small.notes() == []
    assert small.active.facts() == {"max_distance": 0.08}
    for wrong in (0, -1, np.inf, np.nan):
        with pytest.raises(tt.InputError, match="max_distance must be a finite number above 0"):
            small.max_distance = wrong
    assert small.max_distance == 0.08
    small.max_distance = None
    assert small.max_distance == 0.05


def test_white_follows_the_camera_unless_it_was_chosen(small):
    small.camera.set_camera_parameters(eye=(0, 0, 1.5), fov=0.5)
    np.testing.assert_allclose(small.image()[4, 4], 1.5 / 10, rtol=1e-2)
    assert small.notes() == []
    assert small.active.facts() == {}
    small.camera.set_camera_parameters(eye=(0, 0, 0.04), fov=20)


def test_each_renderer_has_a_white_of_its_own(small):
    small.render()
    other = tt.A1Renderer(small.scene_data, camera=small.camera).use(copy.copy(small.active))
    other.max_distance = 0.4
    image = other.image()
    np.testing.assert_allclose(small.reset() or small.image()[4, 4], 0.04 / 0.05, rtol=1e-2)
    np.testing.assert_allclose(image[4, 4], 0.04 / 0.4, rtol=1e-2)


def test_what_the_colours_say(box):
    """One pixel of each view, from the handout's words."""
    scene = box.scene_data
    ids = scene.intersect(COURSE_VIEW["eye"], [0, 0, -1])
    centre = {name: box.use(name).image()[SIZE // 2, SIZE // 2] for name in NAMES}
    np.testing.assert_array_equal(centre["hit"], [1, 1, 1])
    np.testing.assert_allclose(centre["distance"], ids.distance[0] / 10, atol=1e-3)
    np.testing.assert_allclose(centre["normal"], (ids.normal[0] + 1) / 2, atol=1e-6)
    np.testing.assert_allclose(centre["barycentric"].sum(), 1, atol=1e-6)
    for name, number in (("triangle_id", ids.triangle_id[0]), ("material_id", ids.material_id[0])):
        expected = ((number + 1) * np.array([3.14159265, 6.62607015, 2.71828182])) % 1
        np.testing.assert_allclose(centre[name], expected, atol=1e-6)


@ti.func
def _colors(rows: ti.template(), out: ti.template(), i):
    hit = no_hit()
    hit.is_hit, hit.triangle_id, hit.distance = 1, ti.cast(rows[i, 0], ti.i32), rows[i, 1]
    hit.barycentric_coords = tm.vec2(rows[i, 2], rows[i, 3])
    put(out, i, 0, surface_views.id_color(hit.triangle_id))
    put(out, i, 3, surface_views.distance(hit, 10.0))
    put(out, i, 6, surface_views.barycentric(hit))


def test_ids_of_any_size_have_their_own_colour(precision):
    """(i + 1)·π mod 1 and so on, by integers: the largest id as exactly as the first."""
    ids = np.array([0, 1, 2, 1_000, 16_777_215])  # the largest that f32 can hand over
    rows = np.column_stack([ids, [0, 5, 10, 11, 2.5], [0, 0.25, 1, 0, 0.5], [0, 0.5, 0, 1, 0.5]])
    out = ask(_colors, rows, 9)
    digits = ([314159265, 662607015, 271828182] * (ids[:, None] + 1)) % 100_000_000
    np.testing.assert_allclose(out[:, :3], digits / 100_000_000, rtol=1e-6)
    np.testing.assert_allclose(out[:, 3:6], np.repeat([[0], [0.5], [1], [1], [0.25]], 3, axis=1), rtol=1e-6)
    np.testing.assert_allclose(out[:, 6:], np.column_stack([rows[:, 2:], 1 - rows[:, 2:].sum(axis=1)]), atol=1e-6)
    start("f32")
