"""A point that shines equally in all directions: closed forms, also at the light itself and far away."""

import numpy as np
import pytest
from shapes import SQUARE

import taichi_tracer as tt
from taichi_tracer.contracts.lights import Bench

pytestmark = pytest.mark.usefixtures("f32")


def sampled(light, x):
    w_i, r, radiance, pdf = Bench(light, points=np.array([x])).sample(x, np.array([[0.5, 0.5]]))
    return w_i[0], r[0], radiance[0], pdf[0]


@pytest.mark.parametrize("attenuation", [(0, 0, 1), (1, 0, 0), (0.5, 0.2, 0.1)])
def test_it_falls_with_the_distance(attenuation):
    light = tt.PointLight((1, 2, 3), (8, 4, 2), attenuation)
    for x in ([0, 0, 0], [1, 2, 2.5], [-400, 3, 50]):
        w_i, r, radiance, pdf = sampled(light, x)
        to_light = np.array([1, 2, 3.0]) - x
        distance = np.linalg.norm(to_light)
        np.testing.assert_allclose(w_i, to_light / distance, atol=1e-6)
        kc, kl, kq = attenuation
        np.testing.assert_allclose(radiance, np.array([8, 4, 2]) / (kc + kl * distance + kq * distance**2), rtol=1e-5)
        assert (r, pdf) == (pytest.approx(distance, rel=1e-6), 1)


@pytest.mark.parametrize("distance", [0.0, 1e-30, 1e-18, 1e18])
def test_it_is_finite_at_any_distance(distance):
    w_i, r, radiance, _ = sampled(tt.PointLight((0, 0, 0), 1), [distance, 0, 0])
    assert np.isfinite([*w_i, r, *radiance]).all()
    assert np.linalg.norm(w_i) == pytest.approx(1)


@pytest.mark.parametrize("estimator", ["uniform", "brdf", "mis", "path"])
def test_a_wall_under_it_has_the_closed_form(estimator):
    """ρ/π I cos θ/r² right below the light."""
    light = tt.PointLight((0, 0, 2), (3, 2, 1))
    scene = tt.scene_from_mesh(*SQUARE, color=(0.6, 0.6, 0.6), environment=None, lights=[light])
    kind = tt.A4Renderer if estimator == "path" else tt.A2Renderer
    camera = tt.Camera(9, 9, eye=(0, 0, 5), at=(0, 0, 0), up=(0, 1, 0), fov=0.1)
    image = kind(scene, camera=camera).use(estimator).render(4).image()
    np.testing.assert_allclose(image[4, 4], 0.6 / np.pi * np.array([3, 2, 1]) / 4, rtol=1e-4)


def test_wrong_numbers_are_told():
    with pytest.raises(tt.InputError, match=r"point light: position must be three finite numbers, not \(0, 1\)"):
        tt.PointLight((0, 1))
    with pytest.raises(tt.InputError, match="intensity must be three finite numbers of at least 0, not -1"):
        tt.PointLight(intensity=-1)
    with pytest.raises(tt.InputError, match="one number of attenuation must be above 0"):
        tt.PointLight(attenuation=(0, 0, 0))
    with pytest.raises(tt.InputError, match="position must be three finite numbers"):
        tt.PointLight(("a", "b", "c"))
