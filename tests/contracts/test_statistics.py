"""The tails of distributions are those of scipy, as nearly as they say."""

import numpy as np
import pytest
from scipy import stats

from taichi_tracer.contracts import statistics


@pytest.mark.parametrize("k", [5, 20, 63, 400])
def test_chi_square(k):
    x = stats.chi2.isf([0.5, 0.05, 1e-3, 1e-6], k)
    off = np.abs(np.log(statistics.chi_square_sf(x, k) / stats.chi2.sf(x, k)))
    assert (off < [0.01, 0.02, 0.11, np.log(2)]).all(), off


def test_normal():
    for p in (0.3, 1e-4, 1e-9):
        assert statistics.largest_z(1, p) == pytest.approx(stats.norm.isf(p / 2), rel=1e-6)
