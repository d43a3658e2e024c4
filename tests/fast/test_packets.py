"""The lanes of a packet: chains that stay packed, what rays of one heading have in common, and slabs of many."""

import numpy as np
import pytest
import taichi as ti
import taichi.math as tm
from probe import ask, vec3
from support import start

import taichi_tracer as tt
from taichi_tracer.fast import packets
from taichi_tracer.fast.lanes import LANES, lanes
from taichi_tracer.fast.packets import GROUPS, Packets
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


@ti.kernel
def _headings(
    store: ti.template(), intersector: ti.template(), rays: ti.types.ndarray(ndim=3), out: ti.types.ndarray(ndim=2)
):
    for c in range(1):
        for g in ti.static(range(GROUPS)):
            parts = ti.Matrix([[0.0] * LANES for _ in range(6)], float)
            for k in ti.static(range(6)):
                for lane in ti.static(range(LANES)):
                    parts[k, lane] = rays[g, lane, k]
            ox, oy, oz = lanes(0.0), lanes(0.0), lanes(0.0)
            dx, dy, dz = lanes(0.0), lanes(0.0), lanes(0.0)
            for lane in ti.static(range(LANES)):
                ox[lane], oy[lane], oz[lane] = parts[0, lane], parts[1, lane], parts[2, lane]
                dx[lane], dy[lane], dz[lane] = parts[3, lane], parts[4, lane], parts[5, lane]
            store.put_rays(c, g, ox, oy, oz, dx, dy, dz)
        n = 0
        heading = store.next_heading(c)
        while heading >= 0:
            common = store.take_heading(c, heading, tm.vec3(0), intersector)
            out[n, 0] = heading
            for k in ti.static(range(3)):
                out[n, 1 + k], out[n, 4 + k] = common.low[k], common.high[k]
                out[n, 7 + k], out[n, 10 + k] = common.near_origin[k], common.far_origin[k]
            out[n, 13] = 0.0
            for g in ti.static(range(GROUPS)):
                for lane in ti.static(range(LANES)):
                    if store.reach[c, g][lane] > -tm.inf:
                        out[n, 13] += 1
            n += 1
            heading = store.next_heading(c)


@pytest.mark.long
def test_rays_are_taken_by_their_heading_and_know_what_they_have_in_common(rng):
    """Each ray once; the extremes of 1/d and of the moved origins hold those of every ray of the heading."""
    start("f32")
    scene = tt.scene_from_mesh(rng.normal(size=(3, 3)), [[0, 1, 2]])
    store = Packets(1, share_origin=False)
    rays = rng.normal(size=(GROUPS, LANES, 6)).astype(np.float32)
    out = np.zeros((40, 14), np.float32)
    _headings(store, scene.ray_intersector, rays, out)
    rows = rays.reshape(-1, 6)
    inverse = np.float32(1) / rows[:, 3:]
    size = np.abs(rows[:, 3:])
    heading = ((inverse < 0) * [1, 2, 4]).sum(axis=1) + 8 * size.argmax(axis=1)
    known = np.unique(heading)[::-1]
    assert len(known) > 10
    np.testing.assert_array_equal(out[: len(known), 0], known)
    assert not out[len(known) :].any()
    for row, number in zip(out, known, strict=False):
        mine = heading == number
        assert row[13] == mine.sum()
        np.testing.assert_array_equal(row[1:4], inverse[mine].min(axis=0))
        np.testing.assert_array_equal(row[4:7], inverse[mine].max(axis=0))
        signs = np.where([int(number) >> k & 1 for k in range(3)], -1, 1)
        assert (signs * row[7:10] >= (signs * rows[mine, :3]).max(axis=0)).all()
        assert (signs * row[10:13] <= (signs * rows[mine, :3]).min(axis=0)).all()


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
