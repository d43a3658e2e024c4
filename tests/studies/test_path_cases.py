"""The hard cases of light that bounces: they pass, and each finds the mistake that it is about."""

import numpy as np
import pytest
import taichi as ti
from oracles import lamps as independent

from taichi_tracer.studies.hard import oracle, path_cases
from taichi_tracer.studies.hard.catalogue import LEVELS

EPSILON = 2.0**-23


pytestmark = pytest.mark.usefixtures("f32")


def test_lamberts_formula_agrees_with_an_independent_one(rng):
    """For quads above, below and across the horizon, from both sides."""
    fronts = 0
    for _ in range(200):
        a, b, c = rng.normal(size=(3, 3))
        corners = np.array([a, b, b + c - a, c])
        point, normal = rng.normal(size=3), np.array([0.0, 0, 1])
        found = oracle.polygon_irradiance(point, normal, corners)
        seen = independent.clipped(point, normal, corners)
        is_front = np.cross(corners[1] - corners[0], corners[2] - corners[0]) @ (corners[0] - point) < 0
        expected = independent.polygon_irradiance(point, normal, seen) if is_front and len(seen) > 2 else 0.0
        assert found == pytest.approx(expected, abs=1e-12)
        fronts += found > 0
    assert fronts > 40


def test_a_lamp_that_fills_the_sky_gives_pi():
    far = 1e6
    corners = np.array([[-far, 1, -far], [far, 1, -far], [far, 1, far], [-far, 1, far]])
    assert oracle.polygon_irradiance((0, 0, 0), np.array([0.0, 1, 0]), corners) == pytest.approx(np.pi, abs=1e-5)


def test_which_level_tries_which_cases():
    assert LEVELS["quick"].paths == (path_cases.ClosedRoom,)
    assert path_cases.MillionTriangleLamp in LEVELS["full"].paths
    assert path_cases.MillionTriangleLamp not in LEVELS["default"].paths


def test_the_pixels_show_the_points_that_they_are_compared_at():
    """Of the tilted scene, too: the eye rays are sent to the floor."""
    for case in (path_cases.LampInTheFloor(), path_cases.LampAtTheFloor()):
        camera = path_cases.from_above(case.size, case.half, 4, case.turn)
        origins, directions = np.zeros((2, case.size, case.size, 3), np.float32)
        fill(camera, origins, directions)
        points = origins - directions * ((origins @ case.turn[:, 1]) / (directions @ case.turn[:, 1]))[..., None]
        shown = (points @ case.turn)[:, ::-1].transpose(1, 0, 2)  # [x, y] with y up → rows from the top
        np.testing.assert_allclose(shown, path_cases.floor_points(case.size, case.half), atol=1e-5)


@ti.kernel
def fill(camera: ti.template(), origins: ti.types.ndarray(ndim=3), directions: ti.types.ndarray(ndim=3)):
    for x, y in ti.ndrange(camera.width, camera.height):
        ray = camera.generate_ray(x, y)
        for k in ti.static(range(3)):
            origins[x, y, k] = ray.origin[k]
            directions[x, y, k] = ray.direction[k]


# ── mistakes ──
