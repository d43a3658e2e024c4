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
