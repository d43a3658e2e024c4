"""Numbers as colours, and round numbers for the ends of scales."""

import numpy as np
import pytest

from taichi_tracer.tones.heat import heat, round_up


def test_black_red_yellow_white():
    colours = heat(np.array([[0, 1 / 3, 2 / 3, 1, 9]]) * 6, 6)
    assert np.allclose(colours[0], [[0, 0, 0], [1, 0, 0], [1, 1, 0], [1, 1, 1], [1, 1, 1]])
    assert not heat(np.ones((2, 2)), 0).any()


@pytest.mark.parametrize(
    ("value", "wanted"),
    [(1, 1), (1.01, 2), (2.5, 5), (51, 100), (3e-7, 5e-7), (0, 1), (-1, 1), (np.inf, 1), (np.nan, 1)],
)
def test_a_scale_ends_at_a_round_number(value, wanted):
    assert round_up(value) == pytest.approx(wanted)
