"""Niederreiter's points: which dimensions are even together, and which take all combinations."""

import itertools

import numpy as np
import pytest
from sequences import NIEDERREITER, SOBOL, TERM, points

from taichi_tracer.samplers.niederreiter import TwoNiederreiterSampler

pytestmark = pytest.mark.usefixtures("f32")


@pytest.mark.parametrize("sequences", [1, 2])
@pytest.mark.parametrize("other", [1, 1 | TERM, 1 | 7 * TERM])
def test_the_pixel_and_each_direction_of_the_first_surface_are_nets_together(other, sequences):
    """Every box of volume 4^−m whose sides are powers of 1/4 holds one of each 4^m samples in a row."""
    samples, m = {1: NIEDERREITER, 2: TwoNiederreiterSampler()}[sequences], 4
    for pixel in range(3):
        dimensions = (points(samples, 4 << (2 * m), pixel=pixel, dimension=d) for d in (0, other))
        both = np.concatenate(list(dimensions), axis=1).astype(np.float64)
        ones = [both[k::sequences] for k in range(sequences)]
        for block in (ones[0][: 4**m], ones[-1][: 4**m], ones[-1][4**m : 2 * 4**m]):
            for depths in itertools.product(range(m + 1), repeat=4):
                if sum(depths) == m:
                    cells = np.floor(block * 4.0 ** np.array(depths))
                    assert len(np.unique(cells, axis=0)) == 4**m, depths


def test_any_two_dimensions_take_all_combinations():
    """The mean of a product of two dimensions becomes right; numbers of one order would stay wrong for ever.

    f = (x − 1/2)(x' − 1/2) has the variance 1/144. For 4096 samples of 64 pixels, the root mean square of the means is
    at most 1.4 times that of independent numbers, and known to 9 %. Pairs that share a dimension miss this by far; see
    the last line.
    """

    def deviation(first, second):
        means = []
        for pixel in range(64):
            a, b = (points(NIEDERREITER, 4096, pixel=pixel, dimension=d)[:, 0].astype(float) for d in (first, second))
            means.append(((a - 0.5) * (b - 0.5)).mean())
        return np.sqrt(np.mean(np.square(means))) * 12 * np.sqrt(4096)

    for first, second in ((0, 1), (1, 2), (2, 3), (0, 2), (1, 4), (1 | TERM, 2 | 2 * TERM)):
        assert deviation(first, second) < 1.7, (first, second)
    assert deviation(1, 1 | TERM) > 10


def test_light_that_changes_across_a_pixel_has_a_smaller_error_than_with_separate_pairs():
    """The mean of a step that crosses pixel and direction: 512 samples of 64 pixels, f = 1 where x + x' > 1."""

    def deviation(samples):
        means = []
        for pixel in range(64):
            a, b = (points(samples, 512, pixel=pixel, dimension=d).astype(float) for d in (0, 1))
            means.append(((a[:, 0] + b[:, 0] > 1) * (a[:, 1] + b[:, 1] > 1)).mean())
        return np.sqrt(np.mean(np.square(np.array(means) - 0.25)))

    assert deviation(NIEDERREITER) < deviation(SOBOL) / 1.25
