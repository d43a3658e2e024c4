"""A part that gives no numbers is told after the first sample; a value that changes begins the picture again."""

import warnings

import numpy as np
import pytest
import taichi as ti
import taichi.math as tm

import taichi_tracer as tt
from taichi_tracer.system.errors import NotFiniteWarning

pytestmark = pytest.mark.usefixtures("f32")


class NoDirection(tt.Camera):
    name = "no direction"

    @ti.func
    def generate_ray(self, pixel_x, pixel_y):
        return tt.Ray(origin=self.eye, direction=tm.vec3(0.0))


class NotANumber(tt.View):
    name = "not a number"

    @ti.func
    def color(self, hit):
        return hit.normal / 0.0


class Grey(tt.View):
    name, grey = "grey", 0.25

    @ti.func
    def color(self, hit):
        return tm.vec3(self.grey)


def cube(**options):
    scene = tt.load_scene_data("cube")
    return tt.A1Renderer(scene, 16, 16, **options)


def test_rays_without_a_direction_are_told_with_the_first_pixel():
    with pytest.warns(
        UserWarning, match=r"NoDirection.generate_ray: the ray of pixel \(0, 0\) has .* direction \(0, 0, 0\)"
    ):
        cube(camera=NoDirection(16, 16)).render()


def test_samples_that_are_not_finite_are_told_with_the_first_pixel():
    with pytest.warns(
        NotFiniteWarning, match=r"not a number: \d+ of 256 samples are NaN or infinite.* pixel \(\d+, \d+\)"
    ):
        cube(integrator=NotANumber()).render()


def test_a_value_that_a_kernel_reads_may_change():
    view = Grey()
    renderer = cube(integrator=view).render(2)
    assert renderer.image().max() == pytest.approx(0.25)
    view.grey = 0.75
    renderer.render()
    assert renderer.samples == 1
    assert renderer.image().max() == pytest.approx(0.75)
    before = renderer.image()
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        renderer.render()
    assert renderer.samples == 2
    np.testing.assert_array_equal(renderer.image(), before)
