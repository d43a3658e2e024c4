"""The error that a picture tells of itself is the one it has: in 95 of 100 pictures, within the interval."""

import copy
import math
import time
import warnings

import numpy as np
import pytest
import taichi as ti
import taichi.math as tm
from oracles import errors
from scipy import stats
from support import needs_arrays, needs_patch

import taichi_tracer as tt
from taichi_tracer.picture.error_estimate import RelativeError, error_quantile, percent, relative_error
from taichi_tracer.picture.film import Film
from taichi_tracer.system import compiling

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
        told = relative_error(variance, np.full(SHAPE, k), picture)
        had = math.sqrt(((picture - 1) ** 2).mean()) / picture.mean()
        covered += told.low <= had <= told.high
        errors_told.append(float(told) ** 2)
        errors_had.append(had**2)
    assert 0.95 - 3 * math.sqrt(0.95 * 0.05 / 300) - 0.02 < covered / 300
    np.testing.assert_allclose(np.mean(errors_told), np.mean(errors_had), rtol=0.06)


def test_value_is_the_root_of_the_mean_variance_over_the_mean(rng):
    variance, image = rng.random((5, 7, 3)), rng.random((5, 7, 3))
    groups = rng.integers(1, 4, (5, 7))
    told = relative_error(variance, groups, image)
    expected, low, high = errors.relative_error(variance, groups, image)
    np.testing.assert_allclose([float(told), told.low, told.high], [expected, low, high], rtol=1e-4)


@pytest.mark.parametrize("size", [0.02, 0.2, 2.0])
def test_the_upper_end_knows_of_one_sample_more_or_less(rng, size):
    """For largest samples that matter nowhere, in a few pixels, and in most pixels."""
    variance, image = 0.01 * rng.random((5, 7, 3)), 1 + rng.random((5, 7, 3))
    groups, of_largest = rng.integers(1, 4, (5, 7)), size * rng.random((5, 7)) ** 4
    told = relative_error(variance, groups, image, 0.01, of_largest=of_largest)
    expected = errors.relative_error(variance, groups, image, 0.01, of_largest)
    np.testing.assert_allclose([float(told), told.low, told.high], expected, rtol=1e-4)


@ti.kernel
def _add(film: ti.template(), values: ti.types.ndarray(dtype=ti.f32, ndim=3)):
    for x, y in ti.ndrange(*film.ranges):
        for i in range(values.shape[2]):
            film.add(x, y, tm.vec3(values[x, y, i]), ti.cast(i, ti.u32))


@pytest.mark.parametrize("replicated", [False, True])
def test_the_variance_of_a_mean_is_unbiased(f32, rng, replicated):
    """Of 5 samples, so that one half has more than the other. The mean over 40,000 pixels is within 4 of its σ."""
    size, n = 200, 5
    film = Film(size, size, replicated=replicated)
    _add(film, rng.normal(size=(size, size, n)).astype(np.float32))
    groups = 2 if replicated else n
    sigma = math.sqrt(2 / (groups - 1)) / n / size
    assert film.variance_of_mean().mean(dtype=np.float64) == pytest.approx(1 / n, abs=4 * sigma)
    np.testing.assert_array_equal(film.spread()[1], groups)


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
    np.testing.assert_allclose(film.share_of_largest(image), share, rtol=1e-6, atol=1e-6)
    told, mean = film.error(), (63 + 20) / 64
    assert told == 0
    factor = math.sqrt(stats.f.ppf(0.975, 2, 2))
    high = 0.5 * 8.75 / 8 / mean * (math.exp(math.hypot(math.log(factor), 0.28)) if doubles else factor)
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
        (2, slice(0, 1), slice(1, 2), 0.86),
        (4, slice(0, 2), slice(2, 4), 0.76),
        (5, slice(0, 4), slice(4, 5), 0.86),
        (9, slice(0, 4), slice(4, 8), 0.86),  # one sample after 8 tells nothing yet
        (10, slice(0, 8), slice(8, 10), 0.76),
        (16, slice(0, 8), slice(8, 16), 0.76),
        (19, slice(0, 8), slice(8, 16), 0.76),
        (20, slice(0, 16), slice(16, 20), 0.86),
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


def test_pixels_without_an_estimate_are_left_out_and_none_is_nan():
    variance, image = np.full((2, 2, 3), np.nan), np.ones((2, 2, 3))
    assert math.isnan(relative_error(variance, np.ones((2, 2), int), image))
    variance[0, 0] = 0.04
    groups = np.array([[2, 1], [1, 1]])
    assert relative_error(variance, groups, image) == pytest.approx(0.2)
    assert math.isnan(relative_error(variance, groups, 0 * image))
    assert relative_error(0 * np.ones((2, 2, 3)), groups, image) == 0


def test_a_mean_that_may_be_noise_makes_the_error_unknown():
    """4 pixels: the standard error of their mean is half of the error of a pixel."""
    groups, image = np.full((2, 2), 2), np.ones((2, 2, 3))
    for deviation, is_known in ((0.9, True), (1.1, False)):
        told = relative_error(np.full((2, 2, 3), deviation**2), groups, image)
        assert math.isnan(told) != is_known
        assert is_known == (str(told) != "unknown")
    assert relative_error(np.full((2, 2, 3), 0.9**2), groups, image).high > 10 * 0.9


def test_the_interval_is_of_the_true_mean(rng):
    """Single bright samples make the mean of a small picture rough: the error as a fraction of the true mean."""
    covered = unknown = 0
    for _ in range(300):
        hits = rng.binomial(16, 0.02, (2, 64, 1, 1)) / 16 / 0.02  # of two halves
        picture = np.repeat(hits.mean(axis=0), 3, axis=2)
        variance = np.repeat(np.square(hits[0] - hits[1]) / 4, 3, axis=2)
        told = relative_error(variance, np.full((64, 1), 2), picture)
        had = math.sqrt(np.square(picture - 1).mean())
        covered += told.low <= had <= told.high
        unknown += math.isnan(told)
    assert unknown < 30
    assert covered / (300 - unknown) > 0.93


def test_a_variance_that_is_infinite_makes_the_error_unknown():
    """As that of a lamp with Ke = 1e30 in f32; no warning of numpy reaches the user."""
    variance = np.full((4, 4, 3), np.inf, np.float32)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        found = relative_error(variance, np.full((4, 4), 2), np.full((4, 4, 3), 1e30))
    assert math.isnan(found)
    assert str(found) == "unknown"


@pytest.mark.parametrize("nu", [1.0, 1.7, 5.0, 123.4, 1e6])
def test_the_factor_of_the_interval_is_the_quantile_of_f(nu):
    assert error_quantile(nu) == pytest.approx(math.sqrt(stats.f.ppf(0.975, 2 * nu, 2 * nu)), rel=1e-4)


def test_what_no_sample_met_is_in_the_upper_end_and_said_where_it_matters():
    variance, groups, image = np.full((4, 4, 3), 0.01), np.full((4, 4), 2), np.ones((4, 4, 3))
    without = relative_error(variance, groups, image)
    told = relative_error(variance, groups, image, 1.5)
    assert (float(told), told.low, told.unseen) == (float(without), without.low, 1.5)
    doubt = 2 * 0.1 / 4  # twice the standard error of the mean of 16 pixels
    assert told.high * (1 - doubt) == pytest.approx(math.hypot(without.high * (1 - doubt), 1.5))
    assert str(told).endswith("; light that no sample met may add 150 %")
    assert "no sample" not in str(relative_error(variance, groups, image, 0.001))
    assert relative_error(0 * variance, groups, image, 1.5).high == 1.5


def test_it_is_a_number_that_shows_its_interval():
    error = RelativeError(0.0123, 0.011, 0.0138)
    assert str(error) == "1.23 % (1.1 % to 1.38 %)"
    assert f"{error:.1%}" == "1.2%"
    assert copy.copy(error).high == 0.0138
    assert copy.copy(RelativeError(0.1, 0.1, 0.3, 0.2)).unseen == 0.2
    assert str(RelativeError(math.nan, math.nan, math.nan)) == "unknown"
    assert percent(0.5) == "50 %"


@pytest.mark.parametrize(("size", "kernels"), [(8, []), (129, ["Film._write_image", "_write_spread"])])
def test_an_error_is_read_with_few_kernels(f32, size, kernels):
    """The picture, and what is known of its spread: Taichi's own copies of fields would be kernels of their own."""
    needs_patch("counters")
    needs_arrays()
    tt.init("cpu", force=True)  # earlier films have read the same kernels
    film = Film(size, size, replicated=True)
    _add(film, np.ones((size, size, 4), np.float32))
    began = time.perf_counter()
    film.error()
    found = {kernel.name for kernel in compiling.kernels(since=began)}
    assert found == set(kernels)
