"""Sums that do not drift."""

import numpy as np
from films import add_constant
from support import DEBUG

from taichi_tracer.picture.film import Film


def test_a_million_samples_of_a_constant_are_that_constant(precision):
    film = Film(1, 1)
    add_constant(film, 0.1, 10_000 if DEBUG else 1_000_000)
    expected = np.array([0.1, 0.1 / 3, 0.1e6])
    np.testing.assert_allclose(film.image()[0, 0], expected, rtol=1e-6 if precision == "f64" else 2e-7)
    assert np.abs(film.variance_of_mean()).max() < 1e-12 * 1e10
