"""Films that are merged have the samples of both."""

import numpy as np
import pytest
from films import add_samples
from support import start

import taichi_tracer as tt
from taichi_tracer.picture.film import Film


def test_merged_halves_are_the_whole(rng):
    start("f32")
    values = rng.lognormal(size=(512, 3)).astype(np.float32)
    whole, first, second = Film(1, 1), Film(1, 1), Film(1, 1)
    add_samples(whole, values)
    add_samples(first, values[:200])
    add_samples(second, values[200:])
    first.samples, second.samples = 200, 312
    first.merge(second)
    assert first.samples == 512
    np.testing.assert_array_equal(first.image(), whole.image())
    np.testing.assert_allclose(first.variance_of_mean(), whole.variance_of_mean(), rtol=1e-5)
    with pytest.raises(tt.InputError, match="2x1 samples cannot be added to a film of 1x1"):
        first.merge(Film(2, 1))


@pytest.mark.long
def test_merged_replicas_keep_even_and_odd_samples_apart(rng):
    start("f32")
    values = rng.lognormal(size=(9, 3)).astype(np.float32)
    values[[2, 5], 0] = np.nan
    whole, first, second, nothing = (Film(2, 1, replicated=True) for _ in range(4))
    add_samples(whole, values)
    add_samples(
        first, values[:4]
    )  # an even number, so that the samples of the second have the same parity on both films
    add_samples(second, values[4:])
    for other in (second, nothing):
        first.merge(other)
    np.testing.assert_allclose(first.image(), whole.image(), rtol=1e-6)
    np.testing.assert_allclose(first.variance_of_mean(), whole.variance_of_mean(), rtol=1e-5)
    np.testing.assert_array_equal(first.half_count.read(first.memory), [[[4, 3]], [[4, 3]]])
    assert first.non_finite == 4
    assert {(x, i) for x, _, i in first.non_finite_samples()} == {(0, 2), (1, 2), (0, 1), (1, 1)}  # each film's index
    with pytest.raises(tt.InputError, match="different samplers"):
        first.merge(Film(2, 1))


@pytest.mark.exhaustive
def test_merged_parts_of_one_sequence_know_the_same_doublings(f32, rng):
    """Parts that end at powers of two, or between: half 0 has the first half of the samples, as in one film."""
    values = rng.lognormal(size=(13, 3)).astype(np.float32)
    whole, merged = Film(1, 1, doubles=True), Film(1, 1, doubles=True)
    add_samples(whole, values)
    for first, end in ((0, 1), (1, 2), (2, 4), (4, 7), (7, 8), (8, 13)):
        part = Film(1, 1, doubles=True)
        add_samples(part, values[first:end])
        merged.merge(part)
    np.testing.assert_array_equal(merged.half_count.read(merged.memory), whole.half_count.read(whole.memory))
    np.testing.assert_array_equal(merged.image(), whole.image())
    np.testing.assert_array_equal(merged.variance_of_mean(), whole.variance_of_mean())
