"""What is told of many points is what numpy's usual, slower ways tell."""

import numpy as np

from taichi_tracer.formulas.points import box_of, named


def test_named_numbers_are_those_that_sorting_finds(rng):
    ids = rng.integers(0, 9, (4, 3))
    np.testing.assert_array_equal(np.flatnonzero(named(ids, 12)), np.unique(ids))
    assert not named(np.zeros((0, 3), np.int32), 3).any()


def test_a_box_has_the_least_and_the_largest_coordinates(rng):
    points = rng.normal(size=(20, 3)).astype(np.float32)
    low, high = box_of(points)
    assert low.dtype == high.dtype == np.float32
    np.testing.assert_array_equal([low, high], [points.min(axis=0), points.max(axis=0)])
