"""The slab test: never smaller than the exact interval, monotonic, and right where a direction is 0."""

import itertools

import numpy as np
import taichi as ti
import taichi.math as tm
from oracles import boxes as oracle
from probe import ask, vec3

from taichi_tracer.formulas.boxes import RayBounds, box_interval
from taichi_tracer.system import runtime


@ti.func
def _interval(rows: ti.template(), out: ti.template(), i):
    """Columns: origin, direction, low, high, pad, t_near, t_far."""
    o, d, pad = vec3(rows, i, 0), vec3(rows, i, 3), rows[i, 12]
    inverse = 1 / d
    towards = ti.select(inverse >= 0, pad, -pad)
    bounds = RayBounds(inverse=inverse, near_origin=o + towards * tm.vec3(1), far_origin=o - towards * tm.vec3(1))
    out[i, 0], out[i, 1] = box_interval(bounds, vec3(rows, i, 6), vec3(rows, i, 9), rows[i, 13], rows[i, 14])


def intervals(origins, directions, low, high, pad=0.0, t_near=-np.inf, t_far=np.inf):
    """(N, 2)."""
    n = len(origins)
    rest = [np.broadcast_to(np.asarray(x, float), (n,)) for x in (pad, t_near, t_far)]
    shaped = [np.broadcast_to(np.asarray(a, float), (n, 3)) for a in (origins, directions, low, high)]
    return ask(_interval, np.column_stack([*shaped, *rest]), 2)


def rays_and_boxes(rng, count):
    """Many through their box, some along an axis, some from inside; all numbers those of the running precision."""
    centre, half = rng.uniform(-3, 3, (count, 3)), rng.uniform(0, 1, (count, 3)) ** 2
    low, high = centre - half, centre + half
    origins = rng.uniform(-4, 4, (count, 3))
    directions = centre + rng.normal(size=(count, 3)) * half - origins
    directions[::5, 0], directions[1::5, 1:] = 0.0, -0.0
    origins[1::5, 1:] = centre[1::5, 1:]
    origins[2::5] = centre[2::5]
    return [np.ascontiguousarray(a.astype(runtime.dtype()), float) for a in (origins, directions, low, high)]


def test_the_interval_is_the_exact_one(precision, rng):
    """But for rounding: a multiple of ε of the terms that it is made of."""
    arrays = rays_and_boxes(rng, 3_000)
    found = intervals(*arrays).astype(float)
    hits = 0
    for ray, interval in zip(zip(*arrays, strict=True), found, strict=True):
        exact = oracle.interval(*ray)
        origin, direction, low, high = ray
        with np.errstate(all="ignore"):
            terms = (np.abs(origin) + np.maximum(abs(low), abs(high))) / np.abs(direction)
        rounding = 8 * runtime.epsilon() * terms[np.isfinite(terms)].max()
        if exact is None:
            assert interval[0] > interval[1] - rounding
        else:
            hits += 1
            np.testing.assert_allclose(interval, [float(x) for x in exact], atol=rounding)
    assert 500 < hits < 2_900


def test_a_padded_box_loses_no_ray_that_meets_the_box(precision, rng):
    """The padding outweighs the rounding of the quotients, so that no box is missed whose content is hit."""
    arrays = rays_and_boxes(rng, 3_000)
    reach = max(np.abs(a).max() for a in (arrays[0], arrays[2], arrays[3]))
    near, far = intervals(*arrays, pad=8 * runtime.epsilon() * 2 * reach).T
    exact = [oracle.interval(*ray) for ray in zip(*arrays, strict=True)]
    for found_near, found_far, true in zip(near, far, exact, strict=True):
        if true is not None:
            assert found_near <= true[0]
            assert true[1] <= found_far


def test_a_box_within_another_has_an_interval_within_the_others(precision, rng):
    """To the last bit, for any ray: what makes a hierarchy of boxes answer as brute force does."""
    origins, directions, low, high = rays_and_boxes(rng, 20_000)
    outer_low = np.where(rng.random(low.shape) < 0.5, low, low - rng.uniform(0, 1e-6, low.shape))
    outer_high = np.where(rng.random(high.shape) < 0.5, high, high + rng.uniform(0, 1e-6, high.shape))
    window = rng.uniform(-1, 1, 20_000), rng.uniform(1, 4, 20_000)
    inner = intervals(origins, directions, low, high, 1e-6, *window)
    outer = intervals(origins, directions, outer_low, outer_high, 1e-6, *window)
    assert (outer[:, 0] <= inner[:, 0]).all()
    assert (inner[:, 1] <= outer[:, 1]).all()


def test_zeros_of_either_sign_mean_the_same(f32):
    """A ray along an axis is in the box as long as it lies between the other faces, those themselves included."""
    places = list(itertools.product([-1.5, -1.0, 0.0, 0.5, 1.0, 1.5], repeat=2))
    for zeros in ((0.0, 0.0), (-0.0, 0.0), (0.0, -0.0), (-0.0, -0.0)):
        origins = [[x, y, -5] for x, y in places]
        near, far = intervals(origins, [*zeros, 2.0], [-1, -1, -1], [1, 1, 1]).T
        inside = [abs(x) <= 1 and abs(y) <= 1 for x, y in places]
        np.testing.assert_array_equal(near <= far, inside)
        np.testing.assert_array_equal(near[inside], 2.0)
        np.testing.assert_array_equal(far[inside], 3.0)


def test_a_window_cuts_the_interval(f32):
    near, far = intervals([[0, 0, -5]] * 3, [0, 0, 1], [-1] * 3, [1] * 3, 0, [4.5, 0, 7], [9, 4.25, 9]).T
    np.testing.assert_array_equal(near, [4.5, 4, 7])
    np.testing.assert_array_equal(far, [6, 4.25, 6])


def test_a_box_without_extent_is_met_and_one_inside_out_is_not(f32):
    near, far = intervals([[0.25, 0.5, -5]], [0, 0, 1], [0.25, 0.5, 1], [0.25, 0.5, 1]).T
    assert (near, far) == (6, 6)
    near, far = intervals([[0, 0, -5]], [0, 0, 1], [np.inf] * 3, [-np.inf] * 3).T
    assert not (near <= far).any()
