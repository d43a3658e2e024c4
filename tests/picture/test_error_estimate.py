"""The error that a picture tells of itself is the one it has: in 95 of 100 pictures, within the interval."""

import math
import warnings

import numpy as np
import pytest
import taichi as ti
import taichi.math as tm
from oracles import errors
from scipy import stats

from taichi_tracer.picture.error_estimate import relative_error
from taichi_tracer.picture.film import Film, upright

SHAPE = (24, 24)


def pictures(rng, kind, k, count=300):
    """(picture, variance of the mean) of k samples with mean 1 per pixel, with a standard deviation of their own."""
    sigma = np.exp(rng.normal(0, 1, (*SHAPE, 1)))
    for _ in range(count):
        if kind == "normal":
            samples = 1 + sigma * rng.normal(size=(k, *SHAPE, 1))
        elif kind == "lognormal":
            samples = 1 + sigma * (rng.lognormal(size=(k, *SHAPE, 1)) - math.exp(0.5))
        else:  # a light that is seen or not
            samples = 10.0 * (rng.random((k, *SHAPE, 1)) < 0.1)
        samples = np.repeat(samples, 3, axis=3)  # channels err together
        yield samples.mean(axis=0), samples.var(axis=0, ddof=1) / k


@pytest.mark.parametrize("k", [2, 8])
@pytest.mark.parametrize("kind", ["normal", "lognormal", "seen or not"])
def test_the_interval_covers_the_error(rng, kind, k):
    """Of 300 pictures, 95 % ± 3 standard errors of that count, and 2 % for tails that a few samples cannot tell."""
    covered, errors_told, errors_had = 0, [], []
    for picture, variance in pictures(rng, kind, k):
        told = relative_error(variance, picture)
        had = math.sqrt(((picture - 1) ** 2).mean()) / picture.mean()
        covered += told.low <= had <= told.high
        errors_told.append(float(told) ** 2)
        errors_had.append(had**2)
    assert 0.95 - 3 * math.sqrt(0.95 * 0.05 / 300) - 0.02 < covered / 300
    np.testing.assert_allclose(np.mean(errors_told), np.mean(errors_had), rtol=0.06)


def test_value_is_the_root_of_the_mean_variance_over_the_mean(rng):
    variance, image = rng.random((5, 7, 3)), rng.random((5, 7, 3))
    groups = rng.integers(1, 4, (5, 7))
    told = relative_error(np.where(groups[..., None] > 1, variance, np.nan), image)
    expected, low, high = errors.relative_error(variance, groups, image)
    np.testing.assert_allclose([float(told), told.low, told.high], [expected, low, high], rtol=1e-4)


@ti.kernel
def _add(film: ti.template(), values: ti.types.ndarray(dtype=ti.f32, ndim=3)):
    for x, y in ti.ndrange(*film.ranges):
        for i in range(values.shape[2]):
            film.add(x, y, tm.vec3(values[x, y, i]), ti.cast(i, ti.u32))


@pytest.mark.parametrize("doubles", [False, True])
def test_two_halves_that_met_one_bright_sample_each_do_not_seem_exact(f32, doubles):
    """Of 16 samples, one of each half is 160 in one pixel: one more or less changes its mean, 20, by 8.75."""
    samples = np.ones((8, 8, 16), np.float32)
    samples[3, 5] = 0
    samples[3, 5, [2, 11]] = 160
    film = Film(8, 8, replicated=not doubles, doubles=doubles)
    _add(film, samples)
    image = film.image()
    share = np.zeros((8, 8))
    share[8 - 1 - 5, 3] = (160 - 20) / 16
    np.testing.assert_allclose(film.share_of_largest(image, upright(film.counts())), share, rtol=1e-6, atol=1e-6)
    told, mean = film.error(), (63 + 20) / 64
    assert told == 0
    factor = math.sqrt(stats.f.ppf(0.975, 2, 2))
    high = 0.5 * 8.75 / 8 / mean * (math.exp(math.hypot(math.log(factor), 0.2 + 0.4 / 16)) if doubles else factor)
    assert told.high == pytest.approx(high / (1 - 2 * 0.5 * 8.75 / 64 / mean), rel=1e-4)
    parts = [film.alike() for _ in range(3)]
    for part, half in zip(parts, (samples[..., :8], samples[..., 8:]), strict=False):
        _add(part, np.ascontiguousarray(half))
    parts[2].from_arrays(parts[0].to_arrays(), 8)
    parts[2].merge(parts[1])
    assert parts[2].error().high == told.high


@pytest.mark.parametrize(
    ("n", "first", "others", "kappa"),
    [
        (2, slice(0, 1), slice(1, 2), 0.83),
        (4, slice(0, 2), slice(2, 4), 0.76),
        (5, slice(0, 4), slice(4, 5), 0.83),
        (9, slice(0, 4), slice(4, 8), 0.83),  # one sample after 8 tells nothing yet
        (10, slice(0, 8), slice(8, 10), 0.76),
        (16, slice(0, 8), slice(8, 16), 0.76),
        (19, slice(0, 8), slice(8, 16), 0.76),
        (20, slice(0, 16), slice(16, 20), 0.83),
    ],
)
@pytest.mark.parametrize("is_merged", [False, True])
def test_the_error_of_one_sequence_is_told_by_its_last_doubling(f32, rng, n, first, others, kappa, is_merged):
    """v = κ² (A − B)² n_a n_b / (n_a + n_b)², whether one film took the samples, or two that were merged at 8."""
    samples = rng.random((4, 4, n)).astype(np.float32)
    film = Film(4, 4, doubles=True)
    _add(film, np.ascontiguousarray(samples[..., :8]))
    if n > 8 and is_merged:
        for one in (samples[..., 8:16], samples[..., 16:]):
            rest = film.alike()
            _add(rest, np.ascontiguousarray(one))
            film.merge(rest)
    elif n > 8:
        film = Film(4, 4, doubles=True)
        _add(film, samples)
    a, b = samples[..., first], samples[..., others]
    k, m = a.shape[2], b.shape[2]
    e = kappa * abs(a.mean(axis=2) - b.mean(axis=2)) * math.sqrt(k * m) / (k + m)
    np.testing.assert_allclose(film.standard_error()[..., 0], e.T[::-1], rtol=1e-4, atol=1e-6)


def test_a_variance_that_is_infinite_makes_the_error_unknown():
    """As that of a lamp with Ke = 1e30 in f32; no warning of numpy reaches the user."""
    variance = np.full((4, 4, 3), np.inf, np.float32)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        found = relative_error(variance, np.full((4, 4, 3), 1e30))
    assert math.isnan(found)
    assert str(found) == "unknown"


def test_what_no_sample_met_is_in_the_upper_end_and_said_where_it_matters():
    variance, image = np.full((4, 4, 3), 0.01), np.ones((4, 4, 3))
    without = relative_error(variance, image)
    told = relative_error(variance, image, 1.5)
    assert (float(told), told.low, told.unseen) == (float(without), without.low, 1.5)
    doubt = 2 * 0.1 / 4  # twice the standard error of the mean of 16 pixels
    assert told.high * (1 - doubt) == pytest.approx(math.hypot(without.high * (1 - doubt), 1.5))
    assert str(told).endswith("; light that no sample met may add 150 %")
    assert "no sample" not in str(relative_error(variance, image, 0.001))
    assert relative_error(0 * variance, image, 1.5).high == 1.5
