"""The lanes of a packet: chains that stay packed, what rays of one heading have in common, and slabs of many."""

import numpy as np
import pytest
import taichi as ti
import taichi.math as tm
from probe import ask, vec3
from support import start

from taichi_tracer.fast import packets
from taichi_tracer.fast.lanes import lanes
from taichi_tracer.formulas.boxes import RayBounds, box_interval
from taichi_tracer.system import runtime


def test_lanes_have_the_running_precision(precision):
    """Whichever precision the module was imported in."""

    @ti.func
    def third(rows: ti.template(), out: ti.template(), i):
        values = lanes(1.0) / 3
        out[i, 0] = values[5]

    assert ask(third, [[0]], 1)[0, 0] == runtime.dtype()(1) / runtime.dtype()(3)


@ti.func
def _slabs(rows: ti.template(), out: ti.template(), i):
    """Columns: origin, direction of one ray, that of another with the same signs, low and high corner of a box."""
    o, low, high = vec3(rows, i, 0), vec3(rows, i, 9), vec3(rows, i, 12)
    t_near, t_far = -tm.inf, tm.inf
    for k in ti.static(range(3)):
        a, b = 1 / rows[i, 3 + k], 1 / rows[i, 6 + k]
        to_near = ti.select(a >= 0, low[k], high[k]) - o[k]
        to_far = ti.select(a >= 0, high[k], low[k]) - o[k]
        t_near, t_far = packets.slab(to_near, to_far, ti.min(a, b), ti.max(a, b), t_near, t_far)
    out[i, 0], out[i, 1] = t_near, t_far
    for ray in ti.static(range(2)):
        bounds = RayBounds(inverse=1 / vec3(rows, i, 3 + 3 * ray), near_origin=o, far_origin=o)
        out[i, 2 + 2 * ray], out[i, 3 + 2 * ray] = box_interval(bounds, low, high, -tm.inf, tm.inf)


def test_a_slab_of_several_rays_holds_that_of_each(precision, rng):
    """Never later in, nor earlier out, than any ray between the extremes: to the last bit."""
    count = 20_000
    origins, first = rng.uniform(-3, 3, (count, 3)), rng.normal(size=(count, 3))
    second = first * rng.uniform(0.5, 2, (count, 3))
    centre, half = rng.uniform(-2, 2, (count, 3)), rng.uniform(0, 1, (count, 3))
    out = ask(_slabs, np.column_stack([origins, first, second, centre - half, centre + half]), 6)
    for ray in range(2):
        assert (out[:, 0] <= out[:, 2 + 2 * ray]).all()
        assert (out[:, 1] >= out[:, 3 + 2 * ray]).all()
    assert 0.01 < (out[:, 0] <= out[:, 1]).mean() < 0.99


@pytest.mark.parametrize(("heading", "axes"), [(0, (1, 2, 0)), (8 + 5, (2, 0, 1)), (16 + 7, (0, 1, 2))])
def test_sheared_axes_are_in_the_order_of_the_plain_form(heading, axes):
    """x, y of ``shear_axes``: the two smaller ones; z, the largest, comes last; and the signs of a heading."""

    @ti.func
    def read(rows: ti.template(), out: ti.template(), i):
        number = ti.cast(rows[i, 0], ti.i32)
        x, y, z = packets.smaller_axes(number)
        out[i, 0], out[i, 1], out[i, 2] = x, y, z
        signs = packets.heading_signs(number)
        for k in ti.static(range(3)):
            out[i, 3 + k] = signs[k]

    start("f32")
    (found,) = ask(read, [[heading]], 6)
    assert set(found[:2].astype(int)) == set(axes[:2])
    assert found[2] == axes[2]
    assert found[3:].tolist() == [-1 if heading >> k & 1 else 1 for k in range(3)]
