"""What every sampler must do: numbers that are uniform, independent of each other, and depend on nothing but their key.

Two sets of numbers are looked at: those of one sample of very many pixels, and those of many samples of some pixels. In
the second, low-discrepancy points are more even than independent ones, which is no fault: tests of evenness have one
side. Seeds are fixed; the level of each test is ``sidak``'s for all of them together.
"""

import numpy as np
import taichi as ti

from taichi_tracer.contracts.lab import WHOLE, Rows
from taichi_tracer.contracts.statistics import (
    ALPHA,
    check_range,
    chi_square_p,
    chi_square_sf,
    largest_z,
    sidak,
)
from taichi_tracer.system import runtime

DIMENSIONS = 64  # pairs of numbers of one sample
WIDTH = HEIGHT = 128
BINS = 8
BELOW_ONE = 1 - 2.0**-53
ALPHA_OF_ONE = ALPHA / 6  # of the six sets of tests that one sampler goes through
# Samples of a pixel, the dimensions of which each two are looked at, boxes of a side, and how many of them must be
# filled. Of independent points, 1 − e⁻⁴ = 98 % are.
PAIRED, SQUARES, SIDE, FILLED = 1024, 4, 16, 0.75


@ti.kernel
def _pairs(sampler: ti.template(), seed: ti.u32, keys: ti.types.ndarray(ndim=2), out: ti.types.ndarray(ndim=3)):
    for i in range(keys.shape[0]):
        rng = sampler.start(seed, keys[i, 0], keys[i, 1], ti.cast(keys[i, 2], ti.u32))
        for dimension in range(out.shape[1]):
            pair = rng.next_2d()
            out[i, dimension, 0], out[i, dimension, 1] = pair.x, pair.y


def numbers(sampler, keys, dimensions=DIMENSIONS, seed=0):
    """(N, dimensions, 2) numbers of the keys (x, y, index), (N, 3)."""
    out = np.zeros((len(keys), dimensions, 2), runtime.dtype())
    _pairs(sampler, seed, np.ascontiguousarray(keys, np.int32), out)
    return out


def keys_of_pixels(index=0):
    """(N, 3) one sample of every pixel, x fastest."""
    y, x = np.mgrid[0:HEIGHT, 0:WIDTH].reshape(2, -1)
    return np.column_stack([x, y, np.full(x.shape, index)])


def keys_of_samples(x, y, count):
    """(count, 3) samples of one pixel."""
    return np.column_stack([np.full(count, x), np.full(count, y), np.arange(count)])


# ── the checks ──


def check_same_numbers_for_the_same_key(sampler):
    """Twice, and in another order: the same bits. Another seed, pixel or sample: other numbers."""
    keys = np.concatenate([keys_of_pixels(), keys_of_pixels(3)])
    first = numbers(sampler, keys, 4)
    order = np.random.default_rng(1).permutation(len(keys))
    assert (numbers(sampler, keys[order], 4) == first[order]).all(), (
        f"{sampler.name}: the numbers differ from call to call, or depend on their order"
    )
    assert len(np.unique(first[:, 0], axis=0)) == len(keys), f"{sampler.name}: two pixels or samples have the same pair"
    other = numbers(sampler, keys, 4, seed=1)
    assert (first == other).mean() < 1e-3, f"{sampler.name}: another seed gives the same numbers"


def check_numbers_are_uniform(sampler):
    """Each of 2 × 64 columns in [0, 1), by χ² in 64 bins."""
    sets = [numbers(sampler, keys_of_pixels()), numbers(sampler, keys_of_samples(5, 3, 4096))]
    for found in sets:
        check_range(f"{sampler.name}: a number", found, 0, BELOW_ONE)
        columns = (found.reshape(len(found), -1) * 64).astype(int)
        p = np.array([chi_square_p(np.bincount(k, minlength=64), np.full(64, len(k) / 64)) for k in columns.T])
        k = p.argmin()
        assert p[k] > sidak(len(sets) * len(p), ALPHA_OF_ONE), (
            f"{sampler.name}: number {k % 2} of dimension {k // 2} is not uniform: p = {p[k]:.1e}"
        )


def check_dimensions_are_independent(sampler):
    """No two of 2 × 64 columns have to do with each other: over pixels, by χ² in 8 × 8 boxes."""
    columns = numbers(sampler, keys_of_pixels()).reshape(WIDTH * HEIGHT, -1)
    count = columns.shape[1]
    first, second = np.triu_indices(count, 1)
    is_in = ((columns * BINS).astype(int)[..., None] == np.arange(BINS)).astype(np.float32).reshape(len(columns), -1)
    boxes = (is_in.T @ is_in).reshape(count, BINS, count, BINS)[first, :, second].astype(np.float64)
    expected = len(columns) / BINS**2
    p = chi_square_sf((np.square(boxes - expected) / expected).sum(axis=(1, 2)), BINS**2 - 1)
    a, b = (f"number {i[p.argmin()] % 2} of dimension {i[p.argmin()] // 2}" for i in (first, second))
    assert p.min() > sidak(len(p), ALPHA_OF_ONE), (
        f"{sampler.name}: {a} and {b} depend on each other: p = {p.min():.1e} over pixels"
    )


def check_pixels_are_independent(sampler):
    """No correlation with the pixel to the right, above, or mirrored in the diagonal, in any dimension.

    Where samples of even and odd index are said to be two sequences, the next sample of the pixel is one, too.
    """
    by_pixel = numbers(sampler, keys_of_pixels()).astype(np.float64).reshape(HEIGHT, WIDTH, -1)
    upper = np.triu_indices(HEIGHT, 1)
    neighbours = {
        "of the one to its right": (by_pixel[:, :-1], by_pixel[:, 1:]),
        "of the one above it": (by_pixel[:-1], by_pixel[1:]),
        "of the mirrored one": (by_pixel[upper], by_pixel.transpose(1, 0, 2)[upper]),
    }
    if sampler.replicated:
        neighbours["of the next sample"] = by_pixel, numbers(sampler, keys_of_pixels(1)).reshape(by_pixel.shape)
    for where, pair in neighbours.items():
        a, b = (columns.reshape(-1, columns.shape[-1]) for columns in pair)
        a, b = a - a.mean(axis=0), b - b.mean(axis=0)
        r = (a * b).mean(axis=0) / np.sqrt(np.square(a).mean(axis=0) * np.square(b).mean(axis=0))
        z = np.abs(r) * np.sqrt(len(a))
        assert z.max() < largest_z(len(neighbours) * len(z), ALPHA_OF_ONE), (
            f"{sampler.name}: dimensions {z.argmax() // 2} of a pixel and {where} are correlated: z = {z.max():.1f}"
        )


def check_dimensions_advance(sampler):
    """``next_2d``, ``next_1d``, ``next_1d``, ``next_2d`` give six numbers that have nothing to do with each other."""

    @ti.func
    def by_turns(x, y, index):
        rng = sampler.start(ti.u32(0), x, y, ti.cast(index, ti.u32))
        return rng.next_2d(), rng.next_1d(), rng.next_1d(), rng.next_2d()

    found = np.column_stack(Rows(by_turns, [WHOLE] * 3, [2, 1, 1, 2])(*keys_of_pixels().T))
    check_range(f"{sampler.name}: a number", found, 0, BELOW_ONE)
    r = np.corrcoef(found.T.astype(np.float64))[np.triu_indices(6, 1)]
    z = np.abs(r).max() * np.sqrt(len(found))
    assert z < largest_z(len(r), ALPHA_OF_ONE), f"{sampler.name}: next_1d and next_2d repeat numbers: z = {z:.1f}"


def check_two_dimensions_fill_the_square(sampler):
    """The samples of one pixel fill the square of any two dimensions: no line, and no grid of few points."""
    columns = numbers(sampler, keys_of_samples(5, 3, PAIRED), SQUARES).reshape(PAIRED, -1)
    for a in range(columns.shape[1]):
        for b in range(a):
            boxes = (columns[:, [a, b]] * SIDE).astype(int)
            filled = len(np.unique(boxes[:, 0] * SIDE + boxes[:, 1])) / SIDE**2
            assert filled > FILLED, (
                f"{sampler.name}: {PAIRED} samples of a pixel are in {filled:.0%} of {SIDE} × {SIDE} boxes of number "
                f"{b % 2} of dimension {b // 2} and number {a % 2} of dimension {a // 2}"
            )


STEPS = (
    check_same_numbers_for_the_same_key,
    check_dimensions_advance,
    check_pixels_are_independent,
    check_numbers_are_uniform,
    check_dimensions_are_independent,
    check_two_dimensions_fill_the_square,
)
