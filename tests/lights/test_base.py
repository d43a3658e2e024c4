"""The interface of lights: what is asked of a subclass, and what a light that says no more is."""

import numpy as np
import pytest
import taichi as ti
import taichi.math as tm
from probe import ask, put, vec3

from taichi_tracer.lights.base import Light
from taichi_tracer.ray import Ray, no_hit


@ti.data_oriented
class Unfinished(Light):
    """Says nothing."""

    name = "unfinished"

    def __init__(self, power=2.0):
        self.power, self._kept = power, object()


UNFINISHED = Unfinished()


@ti.func
def _defaults(rows: ti.template(), out: ti.template(), i):
    ray = Ray(origin=vec3(rows, i, 0), direction=vec3(rows, i, 3))
    out[i, 0] = UNFINISHED.pdf(ray.origin, ray.direction, no_hit())
    put(out, i, 1, UNFINISHED.radiance(ray, no_hit()))


def test_a_light_that_says_no_more_is_met_by_no_ray(f32):
    assert not ask(_defaults, np.ones((3, 6)), 4).any()
    assert not Unfinished.is_delta
    assert not Unfinished.is_far


def test_a_light_must_say_how_it_is_sampled(f32):
    @ti.kernel
    def use():
        w_i, distance, radiance, pdf = UNFINISHED.sample(tm.vec3(0), tm.vec2(0))

    with pytest.raises(ti.TaichiCompilationError, match=r"a light must say what sample\(self, x, xi\) is"):
        use()


def test_facts_are_the_numbers_that_a_picture_depends_on():
    assert Unfinished(3.5).facts() == {"power": "3.5"}
