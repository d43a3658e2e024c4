"""What kernels read from a film, computed by numpy with the same bits.

For a small picture, numpy is done before a kernel is translated or loaded. The arguments are the arrays of a ``Film``,
[x, y] or [x, y, half], in the running precision.
"""

import numpy as np


def exact_means(total: np.ndarray, rest: np.ndarray, residue: np.ndarray, count: np.ndarray) -> np.ndarray:
    """(w, h, 3) ``Film.exact_mean`` of every pixel."""
    sums = [exact_totals(total[:, :, half], rest[:, :, half], residue[:, :, half]) for half in range(total.shape[2])]
    return sum(sums[1:], sums[0]) / np.maximum(count, 1).astype(total.dtype)[..., None]


def exact_totals(total: np.ndarray, rest: np.ndarray, residue: np.ndarray) -> np.ndarray:
    """``film.exact_total``: the numbers that are nearest to total + rest + residue."""
    rest, residue = two_sums(rest, residue)
    total, rest = two_sums(total, rest)
    rest, residue = two_sums(rest, residue)
    other = total + 2 * rest
    is_halfway = other - total == 2 * rest
    has_more = ((rest > 0) & (residue > 0)) | ((rest < 0) & (residue < 0))
    return np.where(is_halfway & has_more, other, total)


def two_sums(a: np.ndarray, b: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """``film.two_sum``: a + b as the nearest numbers, and their rounding errors."""
    rounded = a + b
    part = rounded - a
    return rounded, (a - (rounded - part)) + (b - part)


def errors_from_halves(total: np.ndarray, counts: np.ndarray) -> np.ndarray:
    """(w, h, 3) ``error_from_halves`` of every pixel; not finite where a half has no samples."""
    n_even, n_odd = (counts[:, :, half, None].astype(total.dtype) for half in range(2))
    with np.errstate(divide="ignore", invalid="ignore"):
        difference = total[:, :, 0] / n_even - total[:, :, 1] / n_odd
        return abs(difference) * np.sqrt(n_even * n_odd) / (n_even + n_odd)


def errors_from_deviations(deviation: np.ndarray, scale: np.ndarray, count: np.ndarray) -> np.ndarray:
    """(w, h, 3) ``error_from_deviation`` of every pixel; not finite where it has fewer than two samples."""
    n = count[..., None].astype(deviation.dtype)
    with np.errstate(divide="ignore", invalid="ignore"):
        return np.sqrt(np.maximum(deviation, 0)) / np.sqrt(n * (n - 1)) / scale[..., None]
