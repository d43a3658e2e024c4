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


def test_student_and_normal():
    t = stats.t.isf([0.4, 0.05, 1e-3, 1e-6], 63)
    np.testing.assert_allclose(statistics.student_sf(t, 63), stats.t.sf(t, 63), rtol=0.02)
    for p in (0.3, 1e-4, 1e-9):
        assert statistics.normal_isf(p) == pytest.approx(stats.norm.isf(p), rel=1e-6)
        assert statistics.normal_sf(statistics.normal_isf(p)) == pytest.approx(p, rel=1e-6)


@pytest.mark.parametrize("power", [1.0, 1.02, 1.1])
def test_kolmogorov(power):
    numbers = np.random.default_rng(3).random(4096) ** power
    assert statistics.uniform_p(numbers) == pytest.approx(stats.kstest(numbers, "uniform").pvalue, rel=0.1, abs=1e-12)
