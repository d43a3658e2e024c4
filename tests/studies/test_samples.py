"""Where samples go: every sample is counted once, in the right cell, and as often as its density says."""

import numpy as np
import pytest
from support import start

import taichi_tracer as tt
from taichi_tracer.contracts.statistics import largest_z
from taichi_tracer.formulas.luminance import luminance
from taichi_tracer.geometry import Mesh
from taichi_tracer.studies import samples
from taichi_tracer.studies.samples import cells_of

pytestmark = pytest.mark.usefixtures("f32")


def solid_angles(height, width):
    """(height, 1) of a cell in each row, top row first."""
    edges = np.cos(np.pi * np.arange(height + 1) / height)
    return ((edges[:-1] - edges[1:]) * 2 * np.pi / width)[:, None]


def test_the_cell_of_a_direction_is_that_of_a_texel_of_an_environment():
    """A2-5; the poles and the seam are in the map, too."""
    directions = [[0, 1, 0], [0, -1, 0], [-1, 0, 0.0], [-1, 0, -0.0], [0.6, 0.8, 0], [0, -0.6, 0.8]]
    places = [(0, 8), (7, 8), (4, 15), (4, 0), (1, 8), (5, 12)]
    for direction, place in zip(directions, places, strict=True):
        cells = cells_of(np.array([direction]), (16, 8))
        assert np.argwhere(cells).tolist() == [list(place)]


def test_cells_have_as_many_samples_as_the_densities_say():
    """Uniform: the solid angle of a cell; importance: its light, too. Significance 1 % for all cells of both."""
    pixels = np.random.default_rng(3).uniform(0, 1, (8, 16, 3)) ** 4
    pixels[2, 3] = 40.0
    pixels[5] = 0.0
    uniform, importance = samples.environment_counts(tt.Environment(pixels), 200_000, (16, 8))
    area = np.broadcast_to(solid_angles(8, 16), (8, 16))
    light = luminance(pixels) * area
    for found, weight in ((uniform, area), (importance, light)):
        p = weight / weight.sum()
        assert found.total == 200_000
        z = (found.cells - 200_000 * p) / np.sqrt(200_000 * p * (1 - p) + 1e-9)
        assert np.abs(z).max() < largest_z(2 * z.size, 0.01)
    assert importance.cells[5].sum() == 0
    assert (uniform.name, importance.name) == ("uniform", "importance")


@pytest.fixture(scope="module")
def two_lamps():
    """A floor with two lamps above it; they face down. The second has three times the area and a third of the Ke."""
    start("f32")
    floor, faces = np.array([[-3, 0, 3], [3, 0, 3], [3, 0, -3], [-3, 0, -3.0]]), np.array([[0, 1, 2], [0, 2, 3]])
    small = np.array([[-1, 2, 0], [-0.5, 2, 0], [-0.5, 2, 0.5]])
    large = np.array([[0.5, 2, 0], [2, 2, 0], [2, 2, 0.5]])
    materials = [tt.Material(name="floor")]
    materials += [tt.Material(name=name, Ke=(ke,) * 3) for name, ke in (("small", 3.0), ("large", 1.0))]
    mesh = Mesh(
        np.concatenate([floor, small, large]),
        np.concatenate([faces, [[4, 5, 6], [7, 8, 9]]]),
        face_materials=np.array([0, 0, 1, 2], np.int32),
        materials=materials,
    )
    return tt.SceneData(mesh, view={"eye": (0, 1, 2), "at": (0, 0, 0), "fov": 60.0})


def test_lamps_are_chosen_as_often_as_their_choice_says(two_lamps):
    """By area 1 : 3, by power 1 : 1; two equal shares are as two lamps. Significance 1 %."""
    found = {c.name: c for c in samples.lamp_counts(two_lamps, (0, 0, 0), (0, 1, 0), 40_000, (16, 8))}
    assert {"area", "power", "hierarchy"} <= set(found)
    for name, share in (("area", 0.25), ("power", 0.5)):
        off = found[name].lamps[0] - 40_000 * share
        assert abs(off) < largest_z(2, 0.01) * np.sqrt(40_000 * share * (1 - share))
    assert found["power"].effective_lamps == pytest.approx(2, abs=1e-3)
    for one in found.values():
        assert one.total == one.lamps.sum() == 40_000
        assert one.cells[4:].sum() == 0  # lamps are above the horizon
        assert one.deviation > 0


def test_the_deviation_is_that_of_the_estimator(two_lamps):
    """A lamp that is far away and alone: light over density is nearly constant: there is hardly any deviation."""
    far = two_lamps.mesh.vertices.astype(float).copy()
    far[4:7] += [0, 1000, 0]
    mesh = Mesh(far[:7], np.array([[0, 1, 2], [0, 2, 3], [4, 5, 6]]), materials=two_lamps.materials[:2])
    mesh.face_materials = np.array([0, 0, 1], np.int32)
    for one in samples.lamp_counts(tt.SceneData(mesh), (0, 0, 0), (0, 1, 0), 1000, (4, 2)):
        assert one.deviation < 1e-2
        assert one.effective_lamps == 1
