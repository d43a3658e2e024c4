"""Masks of lanes: every condition has its bit, and the lanes come back in ascending order."""

import numpy as np
import pytest
import taichi as ti
from probe import ask

from taichi_tracer.fast.lanes import (
    LANES,
    any_lane,
    first_lane,
    flags,
    greatest,
    lanes,
    lanes_of,
    larger,
    least,
    smaller,
)
from taichi_tracer.system import runtime

N = 8


pytestmark = pytest.mark.usefixtures("f32")


@ti.kernel
def find_lanes(values: ti.types.ndarray(ndim=2), found: ti.types.ndarray(ndim=2)):
    for i in range(values.shape[0]):
        mask = lanes_of(ti.Vector([values[i, k] for k in range(N)]) > 0)
        count = 0
        while mask != 0:
            found[i, count] = first_lane(mask)
            mask &= mask - 1
            count += 1


def test_the_lanes_of_a_mask_are_those_in_which_the_condition_holds():
    holds = (np.arange(1 << N)[:, None] >> np.arange(N)) & 1
    found = np.full((1 << N, N), -1, np.int32)
    find_lanes(holds.astype(np.float32), found)
    for row, met in zip(holds, found, strict=True):
        assert met[met >= 0].tolist() == np.flatnonzero(row).tolist()


def test_a_comparison_with_nan_does_not_hold():
    found = np.full((1, N), -1, np.int32)
    find_lanes(np.full((1, N), np.nan, np.float32), found)
    assert (found == -1).all()


@ti.func
def _chains(rows: ti.template(), out: ti.template(), i):
    values, ids = lanes(0.0), flags(0)
    for k in ti.static(range(LANES)):
        values[k], ids[k] = rows[i, k], ti.cast(rows[i, k] > rows[i, LANES], ti.i32)
    out[i, 0], out[i, 1] = least(values), greatest(values)
    out[i, 2] = ti.cast(any_lane(ids != 0), ti.i32)
    out[i, 3] = larger(rows[i, 0], rows[i, 1])
    out[i, 4] = smaller(rows[i, 0], rows[i, 1])


def test_the_extremes_of_all_lanes(precision, rng):
    rows = rng.normal(size=(500, LANES + 1)).astype(runtime.dtype())
    rows[:20, :LANES] = np.sort(rows[:20, :LANES], axis=1)
    rows[20:40, :LANES] = -np.sort(rows[20:40, :LANES], axis=1)
    rows[::3, LANES] += 3
    out = ask(_chains, rows, 5)
    values = rows[:, :LANES]
    np.testing.assert_array_equal(out[:, 0], values.min(axis=1))
    np.testing.assert_array_equal(out[:, 1], values.max(axis=1))
    np.testing.assert_array_equal(out[:, 2] != 0, (values > rows[:, LANES:]).any(axis=1))
    assert 0.2 < out[:, 2].mean() < 0.99
    np.testing.assert_array_equal(out[:, 3], values[:, :2].max(axis=1))
    np.testing.assert_array_equal(out[:, 4], values[:, :2].min(axis=1))
