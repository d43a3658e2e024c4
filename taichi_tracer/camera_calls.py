"""How methods of cameras are called: assignments and the package write their signatures differently."""

import taichi as ti
import taichi.math as tm

from taichi_tracer.random_numbers import given_or_drawn
from taichi_tracer.system.compile_time import compile_time
from taichi_tracer.system.overrides import call_with_known_args, takes, takes_whole_numbers


@compile_time
def point_within(jitter, xi):
    """The point of a pixel through which its ray passes, in [0, 1]²: the centre, or with jitter a random point.

    ``jitter`` is True or False. If a student's method passes its own argument on, ``jitter`` is a number in the kernel.
    """
    if isinstance(jitter, (bool, int)):
        return given_or_drawn(xi) if jitter else tm.vec2(0.5)
    return _centre_or(jitter, given_or_drawn(xi))


@ti.func
def _centre_or(jitter, point):
    return ti.select(jitter != 0, point, tm.vec2(0.5))


@compile_time
def through_pixel(method, pixel_x, pixel_y, jitter, xi):
    """Call ``generate_ray`` or ``generate_ndc_coords`` for one pixel, with the jitter that its signature allows.

    The methods of this package take the random point ξ. Those of the handout's second assignment draw the point
    themselves if ``jitter`` is True. Those of the first assignment take only a pixel: they are called with a fraction
    of a pixel, unless their arguments are annotated as whole numbers. Then there is no jitter.
    """
    if jitter is False:
        return call_with_known_args(method, pixel_x, pixel_y)
    if takes(method, "jitter"):
        return call_with_known_args(method, pixel_x, pixel_y, jitter=jitter, xi=xi)
    if takes_whole_numbers(method):
        return call_with_known_args(method, pixel_x, pixel_y)
    within = point_within(jitter, xi)
    return call_with_known_args(method, moved_within(pixel_x, within, 0), moved_within(pixel_y, within, 1))


@ti.func
def moved_within(pixel, within, axis: ti.template()):
    """A coordinate of a point within a pixel, in pixels from the centre of the first pixel."""
    return pixel + within[axis] - 0.5
