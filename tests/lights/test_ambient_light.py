"""Light without a direction: it is Ka times its intensity in every estimator, and nothing blocks it."""

import numpy as np
import pytest

import taichi_tracer as tt

pytestmark = pytest.mark.usefixtures("f32")


@pytest.mark.parametrize("estimator", ["uniform", "mis", "explicit"])
def test_every_surface_shows_its_ambient_colour(estimator):
    material = tt.Material(Ka=(0.5, 0.25, 1.0))
    lights = [tt.AmbientLight((0.2, 0.4, 0.6)), tt.AmbientLight(0.1)]
    scene = tt.scene_from_mesh(np.eye(3) * 4, [[0, 1, 2]], material=material, environment=None, lights=lights)
    kind = tt.A4Renderer if estimator == "explicit" else tt.A2Renderer
    image = kind(scene, camera=tt.Camera(5, 5, eye=(4, 4, 4), at=(4 / 3,) * 3, fov=1)).use(estimator).render(2).image()
    np.testing.assert_allclose(image, np.broadcast_to([0.5 * 0.3, 0.25 * 0.5, 0.7], image.shape), rtol=1e-5)
