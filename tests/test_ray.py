"""Rays, hits of nothing, and the origin of a ray that leaves a surface."""

import numpy as np
import pytest
import taichi as ti
from oracles import light
from probe import ask, put, vec3

from taichi_tracer.ray import Ray, offset_origin
from taichi_tracer.system import runtime


@ti.func
def _point(rows: ti.template(), out: ti.template(), i):
    put(out, i, 0, Ray(origin=vec3(rows, i, 0), direction=vec3(rows, i, 3)).at(rows[i, 6]))


def test_a_point_of_a_ray(precision, rng):
    rows = rng.normal(size=(100, 7)).astype(runtime.dtype()).astype(float)
    expected = rows[:, :3] + rows[:, 6:] * rows[:, 3:6]
    np.testing.assert_allclose(ask(_point, rows, 3), expected, atol=8 * runtime.epsilon())


def test_a_wrong_name_of_a_member(f32):
    with pytest.raises(TypeError, match="unknown member of Ray 'direcion': did you mean 'direction'"):
        Ray(origin=0, direcion=1)


@ti.func
def _offset(rows: ti.template(), out: ti.template(), i):
    put(out, i, 0, offset_origin(vec3(rows, i, 0), vec3(rows, i, 3), vec3(rows, i, 6)))


def test_an_origin_lies_beyond_the_error_of_its_point(precision, rng):
    """The whole box p ± error is behind the plane through the new origin, at any scale and distance."""
    count = 20_000
    n = light.sphere(rng, count).astype(runtime.dtype()).astype(float)
    n[:6] = np.concatenate([np.eye(3), -np.eye(3)])
    p = (rng.normal(size=(count, 3)) * 10.0 ** rng.uniform(-6, 6, (count, 1))).astype(runtime.dtype()).astype(float)
    error = (np.abs(p) * runtime.epsilon() * rng.uniform(1, 20, (count, 3))).astype(runtime.dtype()).astype(float)
    moved = ask(_offset, np.column_stack([p, error, n]), 3)
    step = (moved.astype(np.longdouble) - p) * n
    assert (step.sum(axis=1) >= (np.abs(n) * error).sum(axis=1)).all()
    assert (step >= 0).all()  # every component is moved outwards, or not at all
    furthest = 4 * (error.sum(axis=1) + runtime.epsilon() * np.abs(p).sum(axis=1))
    assert (np.linalg.norm(moved - p, axis=1) <= furthest).all()


def test_an_origin_without_error_is_moved_by_its_own_rounding(f32):
    moved = ask(_offset, [[1.0, -2.0, 0.0, 0, 0, 0, 0, 0, 1], [4.0, 1.0, -8.0, 0, 0, 0, 0, 0, -1]], 3)
    np.testing.assert_array_equal(moved[0], [1, -2, 0])  # nothing to be rounded at 0
    np.testing.assert_array_equal(moved[1, :2], [4, 1])
    assert -8 > moved[1, 2] > -8 - 4e-6
