"""Samples that are no numbers."""

import numpy as np
import pytest
from films import add_samples
from support import start

from taichi_tracer.picture.film import Film


@pytest.mark.parametrize("bad", [np.nan, np.inf, -np.inf])
def test_samples_that_are_no_numbers_are_counted_and_located_not_added(bad):
    start("f32")
    values = np.full((4, 3), 2, np.float32)
    values[2, 1] = bad
    film = Film(2, 3)
    add_samples(film, values)
    assert film.non_finite == 6
    assert {(x, y, i) for x, y, i in film.non_finite_samples()} == {(x, y, 2) for x in range(2) for y in range(3)}
    np.testing.assert_array_equal(film.image(), 2)
    assert film.counts()[0, 0] == 3
    film.reset()
    assert film.non_finite == 0
