"""Sums that do not drift, a variance that is right, and samples that are no numbers."""

import numpy as np
import pytest
import taichi as ti
import taichi.math as tm
from support import DEBUG, long_except, start

import taichi_tracer as tt
from taichi_tracer.picture.film import Film
from taichi_tracer.system import runtime


@ti.kernel
def _fill(film: ti.template()):
    for x, y in film.canvas:
        film.put(x, y, tm.vec3(x, y, 0), ti.u32(0))


@ti.kernel
def _add(film: ti.template(), values: ti.types.ndarray(ndim=2)):
    for x, y in ti.ndrange(*film.ranges):
        for i in range(values.shape[0]):
            film.add(x, y, tm.vec3(values[i, 0], values[i, 1], values[i, 2]), ti.cast(i, ti.u32))


@ti.kernel
def _add_constant(film: ti.template(), value: float, count: int):
    for x, y in ti.ndrange(*film.ranges):
        for i in range(count):
            film.add(x, y, tm.vec3(value, value / 3, value * 1e6), ti.cast(i, ti.u32))


def test_top_row_first(precision):
    film = Film(3, 2)
    _fill(film)
    image = film.image()
    assert image.dtype == np.float32
    np.testing.assert_array_equal(image[..., 0], [[0, 1, 2], [0, 1, 2]])
    np.testing.assert_array_equal(image[..., 1], [[1, 1, 1], [0, 0, 0]])


def test_a_million_samples_of_a_constant_are_that_constant(precision):
    film = Film(1, 1)
    _add_constant(film, 0.1, 10_000 if DEBUG else 1_000_000)
    expected = np.array([0.1, 0.1 / 3, 0.1e6])
    np.testing.assert_allclose(film.image()[0, 0], expected, rtol=1e-6 if precision == "f64" else 2e-7)
    assert np.abs(film.variance_of_mean()).max() < 1e-12 * 1e10


def test_mean_and_variance_are_those_of_the_samples(precision, rng):
    values = rng.lognormal(size=(5_000, 3)).astype(runtime.dtype())
    film = Film(2, 1)
    _add(film, values)
    exact = values.astype(np.float64)
    np.testing.assert_allclose(film.image()[0, 1], exact.mean(axis=0), rtol=2e-7)
    np.testing.assert_allclose(film.variance_of_mean()[0, 0], exact.var(axis=0, ddof=1) / len(exact), rtol=1e-4)
    relative = np.sqrt(exact.var(axis=0, ddof=1).mean() / len(exact)) / exact.mean()
    np.testing.assert_allclose(film.error(), relative, rtol=1e-4)


def test_two_replicas_tell_the_variance_by_their_difference(precision, rng):
    values = rng.lognormal(size=(7, 3)).astype(runtime.dtype())
    film = Film(1, 1, replicated=True)
    _add(film, values)
    even, odd = values[::2].mean(axis=0, dtype=np.float64), values[1::2].mean(axis=0, dtype=np.float64)
    expected = (even - odd) ** 2 * (4 / 7) * (3 / 7)
    np.testing.assert_allclose(film.variance_of_mean()[0, 0], expected, rtol=1e-4)
    one = Film(1, 1, replicated=True)
    _add(one, values[:1])
    assert np.isnan(one.variance_of_mean()).all()
    assert np.isnan(one.error())


@pytest.mark.exhaustive
@pytest.mark.parametrize("replicated", [False, pytest.param(True, marks=pytest.mark.long)])
@pytest.mark.parametrize("ke", [1e-30, *(pytest.param(ke, marks=pytest.mark.exhaustive) for ke in (1e-22, 1e22, 1e30))])
def test_the_error_of_dim_and_bright_light_is_that_of_light_of_one(f32, rng, ke, replicated):
    """The squares of these numbers are 0 or infinite in f32; the error, a quotient, is the same for all of them."""
    values = rng.lognormal(size=(2, 40, 3)).astype(np.float32)
    values[0, 3:5] = 0  # samples that found no lamp, before and after others
    errors = []
    for factor in (1, ke):
        parts = [Film(2, 1, replicated=replicated) for _ in range(3)]
        for film, samples in zip(parts, (values[0], values[0], values[1]), strict=True):
            _add(film, (samples * np.float32(factor)).astype(np.float32))
        films = [parts[0], Film(2, 1, replicated=replicated)]
        films[1].from_arrays(parts[0].to_arrays(), 40)
        parts[1].merge(parts[2])
        errors.append([float(film.error()) for film in (*films, parts[1])])
    assert errors[0][0] > 0.01
    np.testing.assert_allclose(errors[1], errors[0], rtol=1e-5)


@pytest.mark.long
def test_a_film_goes_to_arrays_and_back_to_the_last_bit(precision, rng):
    values = rng.lognormal(size=(9, 3)).astype(runtime.dtype())
    values[3, 1] = np.nan
    film, other = Film(2, 3, crop=(0, 2, 1, 3)), Film(2, 3, crop=(0, 2, 1, 3))
    _add(film, values[:5])
    film.samples = 5
    other.from_arrays(film.to_arrays(), 5)
    for f in (film, other):
        _add(f, values[5:])
    assert other.samples == 5
    np.testing.assert_array_equal(film.image(), other.image())
    np.testing.assert_array_equal(film.variance_of_mean(), other.variance_of_mean())
    assert film.non_finite == other.non_finite == 4
    assert film.non_finite_samples() == other.non_finite_samples()


@pytest.mark.parametrize("keeps_deviation", long_except([False, True], True))
def test_old_checkpoints_stay_readable_to_the_last_bit(precision, rng, keeps_deviation):
    """The layout of checkpoint files, version 1: total, rest, odd total, odd rest, deviation; all samples, odd ones."""
    shape, dtype = (3, 2), runtime.dtype()
    n_even, n_odd = rng.integers(1, 9, shape, np.int32), rng.integers(1, 9, shape, np.int32)
    n_even[1, 1] = n_odd[1, 1] = 0
    even, odd = rng.lognormal(size=(2, *shape, 3)).astype(dtype)
    rests = rng.normal(0, 1e-9, (2, *shape, 3)).astype(dtype)
    deviation = [rng.lognormal(size=(*shape, 3)).astype(dtype)] if keeps_deviation else []
    non_finite = np.zeros((17, 3), np.int32)
    non_finite[:3] = [[2, 0, 0], [2, 1, 4], [0, 1, 7]]
    arrays = {
        "values": np.stack([even, rests[0], odd, rests[1], *deviation], axis=2),
        "counts": np.stack([n_even + n_odd, n_odd], axis=2),
        "non_finite": non_finite,
    }
    film = Film(*shape, replicated=True, keeps_deviation=keeps_deviation)
    film.from_arrays(arrays, 9)
    assert film.samples == 9
    assert film.non_finite_samples() == [(2, 1, 4), (0, 1, 7)]
    np.testing.assert_array_equal(film.counts(), n_even + n_odd)
    mean = (even + odd) / np.maximum(n_even + n_odd, 1).astype(dtype)[..., None]
    mean[1, 1] = 0  # no samples: nothing was shown there
    np.testing.assert_array_equal(film.image(), mean.transpose(1, 0, 2)[::-1].astype(np.float32))
    written = film.to_arrays()
    assert list(written) == ["values", "counts", "non_finite"]
    for name, array in arrays.items():
        assert (written[name].dtype, written[name].shape) == (array.dtype, array.shape)
        assert written[name].tobytes() == array.tobytes()


def test_old_checkpoints_of_independent_samples_stay_readable_to_the_last_bit(precision, rng):
    """The same without halves: total, rest, deviation; all samples, and 0 in place of the odd ones."""
    shape, dtype = (3, 2), runtime.dtype()
    counts = np.zeros((*shape, 2), np.int32)
    counts[..., 0] = rng.integers(2, 9, shape)
    values = rng.lognormal(size=(*shape, 3, 3)).astype(dtype)
    film = Film(*shape)
    film.from_arrays({"values": values, "counts": counts, "non_finite": np.zeros((17, 3), np.int32)}, 8)
    n = counts[..., :1].astype(dtype)
    np.testing.assert_array_equal(film.canvas.to_numpy(), values[:, :, 0] / n)
    variance = (values[:, :, 2] / (n * (n - 1))).transpose(1, 0, 2)[::-1]
    np.testing.assert_allclose(film.variance_of_mean(), variance, rtol=1e-6)
    written = film.to_arrays()
    assert written["values"].dtype == dtype
    assert written["values"].tobytes() == values.tobytes()
    assert written["counts"].tobytes() == counts.tobytes()


def test_merged_halves_are_the_whole(rng):
    start("f32")
    values = rng.lognormal(size=(512, 3)).astype(np.float32)
    whole, first, second = Film(1, 1), Film(1, 1), Film(1, 1)
    _add(whole, values)
    _add(first, values[:200])
    _add(second, values[200:])
    first.samples, second.samples = 200, 312
    first.merge(second)
    assert first.samples == 512
    np.testing.assert_array_equal(first.image(), whole.image())
    np.testing.assert_allclose(first.variance_of_mean(), whole.variance_of_mean(), rtol=1e-5)
    with pytest.raises(tt.InputError, match="2x1 samples cannot be added to a film of 1x1"):
        first.merge(Film(2, 1))


@pytest.mark.long
def test_merged_replicas_keep_even_and_odd_samples_apart(rng):
    start("f32")
    values = rng.lognormal(size=(9, 3)).astype(np.float32)
    values[[2, 5], 0] = np.nan
    whole, first, second, nothing = (Film(2, 1, replicated=True) for _ in range(4))
    _add(whole, values)
    _add(first, values[:4])  # an even number, so that the samples of the second have the same parity on both films
    _add(second, values[4:])
    for other in (second, nothing):
        first.merge(other)
    np.testing.assert_allclose(first.image(), whole.image(), rtol=1e-6)
    np.testing.assert_allclose(first.variance_of_mean(), whole.variance_of_mean(), rtol=1e-5)
    np.testing.assert_array_equal(first.half_count.read(first.memory), [[[4, 3]], [[4, 3]]])
    assert first.non_finite == 4
    assert {(x, i) for x, _, i in first.non_finite_samples()} == {(0, 2), (1, 2), (0, 1), (1, 1)}  # each film's index
    with pytest.raises(tt.InputError, match="different samplers"):
        first.merge(Film(2, 1))


@pytest.mark.parametrize("bad", [np.nan, np.inf, -np.inf])
def test_samples_that_are_no_numbers_are_counted_and_located_not_added(bad):
    start("f32")
    values = np.full((4, 3), 2, np.float32)
    values[2, 1] = bad
    film = Film(2, 3)
    _add(film, values)
    assert film.non_finite == 6
    assert {(x, y, i) for x, y, i in film.non_finite_samples()} == {(x, y, 2) for x in range(2) for y in range(3)}
    np.testing.assert_array_equal(film.image(), 2)
    assert film.counts()[0, 0] == 3
    film.reset()
    assert film.non_finite == 0


def test_only_the_crop_takes_samples():
    start("f32")
    film = Film(4, 3, crop=(1, 3, 0, 2))
    _add_constant(film, 1.0, 2)
    np.testing.assert_array_equal(film.counts(), [[0, 0, 0], [2, 2, 0], [2, 2, 0], [0, 0, 0]])
    for crop in ((0, 5, 0, 1), (2, 2, 0, 1), (-1, 2, 0, 1)):
        with pytest.raises(tt.InputError, match="does not lie within 4x3"):
            Film(4, 3, crop=crop)


def test_a_film_of_an_earlier_start_says_so():
    start("f32")
    film = Film(2, 2)
    runtime.init("cpu", force=True, debug=DEBUG)
    for use in (film.image, film.reset, film.spread, film.sample_deviation, film.non_finite_samples, film.to_arrays):
        with pytest.raises(tt.StaleSceneError):
            use()
    with pytest.raises(tt.StaleSceneError):
        Film(2, 2).merge(film)


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
        _add(whole, samples)
        _add(first, samples[:6])
        _add(second, samples[6:])
        again.from_arrays(second.to_arrays(), 6)
        again.merge(first)
        expected = np.float32((1 + 2**-23) / np.float32(6))
        for film in (whole, again):
            np.testing.assert_array_equal(film.image(), expected)


@pytest.mark.exhaustive
def test_merged_parts_of_one_sequence_know_the_same_doublings(f32, rng):
    """Parts that end at powers of two, or between: half 0 has the first half of the samples, as in one film."""
    values = rng.lognormal(size=(13, 3)).astype(np.float32)
    whole, merged = Film(1, 1, doubles=True), Film(1, 1, doubles=True)
    _add(whole, values)
    for first, end in ((0, 1), (1, 2), (2, 4), (4, 7), (7, 8), (8, 13)):
        part = Film(1, 1, doubles=True)
        _add(part, values[first:end])
        merged.merge(part)
    np.testing.assert_array_equal(merged.half_count.read(merged.memory), whole.half_count.read(whole.memory))
    np.testing.assert_array_equal(merged.image(), whole.image())
    np.testing.assert_array_equal(merged.variance_of_mean(), whole.variance_of_mean())
