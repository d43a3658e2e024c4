"""Masks of lanes: every condition has its bit, and the lanes come back in ascending order."""

import numpy as np
import pytest
import taichi as ti
from support import start

from taichi_tracer.fast.lanes import first_lane, lanes_of

N = 8


@pytest.fixture(scope="module", autouse=True)
def _taichi():
    start("f32")


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
    for row, lanes in zip(holds, found, strict=True):
        assert lanes[lanes >= 0].tolist() == np.flatnonzero(row).tolist()


def test_a_comparison_with_nan_does_not_hold():
    found = np.full((1, N), -1, np.int32)
    find_lanes(np.full((1, N), np.nan, np.float32), found)
    assert (found == -1).all()
