"""Methods of cameras are called with what their signatures take, whatever assignment they were written for."""

import numpy as np
import pytest
import taichi as ti
import taichi.math as tm

from taichi_tracer.camera_calls import through_pixel

pytestmark = pytest.mark.usefixtures("f32")
XI = tm.vec2(0.25, 0.75)


@ti.func
def of_the_package(pixel_x, pixel_y, jitter: ti.template() = False, xi: ti.template() = None):
    within = tm.vec2(0)
    if ti.static(jitter):
        within = xi
    return tm.vec2(pixel_x, pixel_y) + within


@ti.func
def of_the_second_assignment(pixel_x, pixel_y, jitter=False):
    return tm.vec2(pixel_x + ti.select(jitter, 100.0, 0.0), pixel_y)


@ti.func
def of_the_first_assignment(pixel_x, pixel_y):
    return tm.vec2(pixel_x, pixel_y)


@ti.func
def with_whole_numbers(pixel_x: ti.i32, pixel_y: ti.i32):
    return tm.vec2(pixel_x, pixel_y)


@pytest.mark.parametrize(
    ("method", "centre", "jittered"),
    [
        (of_the_package, (3, 5), (3.25, 5.75)),
        (of_the_second_assignment, (3, 5), (103, 5)),
        (of_the_first_assignment, (3, 5), (2.75, 5.25)),  # a fraction of a pixel from the centre
        (with_whole_numbers, (3, 5), (3, 5)),
    ],
)
def test_a_method_gets_the_point_within_the_pixel_in_the_form_that_it_takes(method, centre, jittered):
    @ti.kernel
    def ask(jitter: ti.template()) -> tm.vec2:
        return through_pixel(method, 3, 5, jitter, XI)

    np.testing.assert_allclose(ask(False), centre)
    np.testing.assert_allclose(ask(True), jittered)
