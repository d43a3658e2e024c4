"""Sums that depend neither on an order nor on a division."""

import math

import numpy as np
import pytest
import taichi as ti
import taichi.math as tm
from films import add_samples

from taichi_tracer.picture.film import FEW_PIXELS, Film

# Whose nearest sum in f32 is 1 + 2^-23. Two numbers alone, as a pair of f32, lose 2^-49 beside 1 + 2^-24.
HARD_TO_ADD = np.array([1, 2**-24, 2**-49, 2**-49, 2**-49, 2**-49], np.float64)


@pytest.mark.long
@pytest.mark.parametrize("replicated", [True, False])
def test_a_picture_does_not_depend_on_the_order_nor_on_the_division_of_its_samples(f32, rng, replicated):
    """In one film, in two that are merged, and through the arrays of a checkpoint."""
    values = np.repeat(HARD_TO_ADD, 3).reshape(-1, 3)
    for order in ([0, 1, 2, 3, 4, 5], [2, 3, 4, 5, 1, 0], [4, 1, 0, 2, 5, 3]):
        whole, first, second, again = (Film(1, 1, replicated=replicated) for _ in range(4))
        samples = values[order].astype(np.float32)
        samples = np.repeat(samples, 2, axis=0) if replicated else samples  # so that both halves have all of them
        add_samples(whole, samples)
        add_samples(first, samples[:6])
        add_samples(second, samples[6:])
        again.from_arrays(second.to_arrays(), 6)
        again.merge(first)
        expected = np.float32((1 + 2**-23) / np.float32(6))
        for film in (whole, again):
            np.testing.assert_array_equal(film.image(), expected)


@ti.kernel
def add_row(film: ti.template(), values: ti.types.ndarray(dtype=ti.f32, ndim=2)):
    for x in range(film.width):
        for i in range(values.shape[1]):
            film.add(x, 0, tm.vec3(values[x, i]), ti.cast(i, ti.u32))


@pytest.mark.long
@pytest.mark.parametrize("width", [pytest.param(64, marks=pytest.mark.long), FEW_PIXELS + 1])
def test_a_picture_of_one_sequence_does_not_depend_on_where_a_half_ends(f32, rng, width):
    """Ranges of any length, merged, in numpy and in the kernel: a mean is rounded once, from the sum of all samples."""
    samples = np.exp(rng.normal(0, 6, (width, 23))).astype(np.float32)
    whole = Film(width, 1, doubles=True)
    add_row(whole, samples)
    for cuts in ([0, 4, 5, 11, 23], [0, 1, 16, 23], [0, 22, 23]):
        merged = Film(width, 1, doubles=True)
        for a, b in zip(cuts, cuts[1:], strict=False):
            part = Film(width, 1, doubles=True)
            add_row(part, np.ascontiguousarray(samples[:, a:b]))
            merged.merge(part)
        np.testing.assert_array_equal(merged.image(), whole.image())
    exact = np.array([math.fsum(map(float, row)) for row in samples], np.float32)
    np.testing.assert_allclose(whole.image()[0, :, 0], exact / np.float32(23), rtol=2e-7)
