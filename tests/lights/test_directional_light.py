"""Parallel light: its direction and its irradiance, and a shadow with the outline of what throws it."""

import numpy as np
import pytest
from shapes import SQUARE

import taichi_tracer as tt
from taichi_tracer.contracts.lights import Bench

pytestmark = pytest.mark.usefixtures("f32")


@pytest.mark.parametrize("direction", [(0, -3, 0), (1e-20, -1e-20, 0), (1e200, 0, 1e200)])
def test_it_comes_from_one_direction(direction):
    bench = Bench(tt.DirectionalLight(direction, (3, 2, 1)))
    for x in bench.points:
        w_i, r, radiance, pdf = bench.sample(x, np.array([[0.3, 0.7]]))
        np.testing.assert_allclose(w_i[0] @ np.sign(direction), -np.sqrt(np.count_nonzero(direction)), atol=1e-6)
        assert (r[0], radiance[0].tolist(), pdf[0]) == (np.inf, [3, 2, 1], 1)


def test_without_arguments_it_comes_from_above_and_from_the_side():
    w_i, _, radiance, _ = Bench(tt.DirectionalLight()).sample(np.zeros(3), np.array([[0.3, 0.7]]))
    np.testing.assert_allclose(w_i[0], np.array([0.4, 1, 0.6]) / np.sqrt(1.52), atol=1e-6)
    np.testing.assert_allclose(radiance[0], 3)


@pytest.mark.parametrize("estimator", ["environment", "mis"])
def test_a_wall_has_the_closed_form_but_in_the_shadow(estimator):
    """ρ/π E cos θ; a small square above the wall throws a shadow of its size, moved by the slope of the light."""
    vertices = np.concatenate([SQUARE[0] * 10, SQUARE[0] * 0.5 + [0, 0, 1]])
    faces = np.concatenate([SQUARE[1], SQUARE[1] + 4])
    light = tt.DirectionalLight((1, 0, -1), 2.0)
    scene = tt.scene_from_mesh(vertices, faces, color=(0.5, 0.5, 0.5), environment=None, lights=[light])
    lit = 0.5 / np.pi * 2 * np.sqrt(0.5)
    rays = [([x, 3, 5], [0, -3, -5]) for x in (0.0, 1.0)]
    origins, directions = (np.array(one, float) for one in zip(*rays, strict=True))
    blocked = scene.occluded(origins + directions * 0.999, np.array([[-1, 0, 1.0]] * 2))
    assert blocked.tolist() == [False, True]
    for x, value in ((3.0, lit), (1.0, 0.0)):
        camera = tt.Camera(5, 5, eye=(x, 3, 5), at=(x, 0, 0), up=(0, 1, 0), fov=0.1)
        image = tt.A2Renderer(scene, camera=camera).use(estimator).render(4).image()
        np.testing.assert_allclose(image, value, rtol=1e-4)


def test_a_direction_has_a_length():
    with pytest.raises(tt.InputError, match="directional light: direction must have a length"):
        tt.DirectionalLight((0, 0, 0))
