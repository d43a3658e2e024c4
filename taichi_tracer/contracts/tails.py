"""Tails of distributions, by approximations: to a tenth where p is 0.001, and to a factor of 2 where it is 10⁻⁶.

scipy has them exactly, but a part should be checked where it is not installed. What is right has a p far above the
levels of the contracts, and what is wrong has one far below.
"""

import math
from statistics import NormalDist

import numpy as np

TERMS = 100  # of Kolmogorov's series; far fewer matter
_erfc = np.vectorize(math.erfc, otypes=[np.float64])


def normal_sf(z):
    """The probability that a normal number is larger than z."""
    return _erfc(np.asarray(z, np.float64) / math.sqrt(2)) / 2


def normal_isf(p: float) -> float:
    """The z for which ``normal_sf`` is p."""
    return -NormalDist().inv_cdf(p)


def chi_square_sf(x, k: int):
    """The probability that a χ² of k degrees of freedom is larger than x (Wilson & Hilferty, PNAS 1931)."""
    spread = 2 / (9 * k)
    return normal_sf((np.cbrt(np.asarray(x, np.float64) / k) - (1 - spread)) / math.sqrt(spread))


def student_sf(t, k: int):
    """The probability that Student's t of k degrees of freedom is larger than t, for t ≥ 0 (Wallace, 1959)."""
    return normal_sf((8 * k + 1) / (8 * k + 3) * np.sqrt(k * np.log1p(np.square(t) / k)))


def uniform_p(numbers: np.ndarray) -> float:
    """p of Kolmogorov and Smirnov's test of uniform numbers in [0, 1) (the series with Stephens' correction, 1970)."""
    n, ordered = len(numbers), np.sort(numbers)
    steps = np.arange(n + 1) / n
    largest = max((steps[1:] - ordered).max(), (ordered - steps[:-1]).max())
    scaled, k = (math.sqrt(n) + 0.12 + 0.11 / math.sqrt(n)) * largest, np.arange(1, TERMS + 1)
    return float(np.clip(2 * ((-1.0) ** (k - 1) * np.exp(-2 * np.square(k * scaled))).sum(), 0, 1))
