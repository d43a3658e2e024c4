"""Sums that keep what they round off, as total + rest + residue: in kernels, and with the same bits in numpy.

numpy reads a small film, because it is done before a kernel is translated or loaded.
"""

import numpy as np
import taichi as ti

from taichi_tracer.system.seams import in_kernels, variable


@in_kernels
def two_sum(a, b):
    """a + b as the nearest number and its rounding error, which is exact (Knuth, TAOCP vol. 2, 4.2.2, theorem B)."""
    a, b = variable(a), variable(b)
    rounded = variable(a + b)
    part = variable(rounded - a)
    return rounded, variable((a - (rounded - part)) + (b - part))


@in_kernels
def add_to_pair(total, rest, value):
    """The sum (total + rest) + value, as the nearest number, its rounding error, and what these two cannot hold."""
    rounded, lost = two_sum(total, value)
    rest, lost = two_sum(rest, lost)
    total, rest = two_sum(rounded, rest)
    return total, rest, lost


@in_kernels
def exact_total(total, rest, residue):
    """The number that is nearest to total + rest + residue.

    Whatever the order in which numbers were added, and however they were divided into films that were merged: the sum
    of the three is the same, and therefore this number, as long as the last digit of every sample is within three times
    the precision of the sum, which is 72 binary digits in f32. A sample of less than 1e-14 of the sum may go beyond;
    then the residue is rounded, which changes about one of 10^14 such numbers.
    """
    rest, residue = two_sum(rest, residue)
    total, rest = two_sum(total, rest)
    rest, residue = two_sum(rest, residue)
    # If the rest is just half of the last digit of the total, the nearest number is on the side of the residue.
    other = variable(total + 2 * rest)
    is_halfway = other - total == 2 * rest
    has_more = ((rest > 0) & (residue > 0)) | ((rest < 0) & (residue < 0))
    return variable(ti.select(is_halfway & has_more, other, total))


def exact_means(
    total: np.ndarray, rest: np.ndarray, residue: np.ndarray, count: np.ndarray, is_one: bool = False
) -> np.ndarray:
    """(w, h, 3) ``PixelSums.exact_mean`` of every pixel, from the arrays of a film in the running precision.

    Args:
        is_one: whether both halves are one sequence.
    """
    if is_one:
        sums = [exact_sequences(total, rest, residue)]
    else:
        sums = [exact_totals(total[:, :, k], rest[:, :, k], residue[:, :, k]) for k in range(total.shape[2])]
    return sum(sums[1:], sums[0]) / np.maximum(count, 1).astype(total.dtype)[..., None]


def exact_sequences(total: np.ndarray, rest: np.ndarray, residue: np.ndarray) -> np.ndarray:
    """(w, h, 3) ``PixelSums.exact_sequence`` of every pixel."""
    whole, small, left = total[:, :, 0], rest[:, :, 0], residue[:, :, 0]
    for part in (total, rest, residue):
        rounded, lost = two_sums(whole, part[:, :, 1])
        small, lost = two_sums(small, lost)
        whole, small = two_sums(rounded, small)
        left = left + lost
    return exact_totals(whole, small, left)


def exact_totals(total: np.ndarray, rest: np.ndarray, residue: np.ndarray) -> np.ndarray:
    """``exact_total``: the numbers that are nearest to total + rest + residue."""
    rest, residue = two_sums(rest, residue)
    total, rest = two_sums(total, rest)
    rest, residue = two_sums(rest, residue)
    other = total + 2 * rest
    is_halfway = other - total == 2 * rest
    has_more = ((rest > 0) & (residue > 0)) | ((rest < 0) & (residue < 0))
    return np.where(is_halfway & has_more, other, total)


def two_sums(a: np.ndarray, b: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """``two_sum``: a + b as the nearest numbers, and their rounding errors."""
    rounded = a + b
    part = rounded - a
    return rounded, (a - (rounded - part)) + (b - part)
