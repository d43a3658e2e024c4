"""A film: its pictures, what it knows of its error, and when it is out of date."""

import numpy as np
import pytest
import taichi as ti
import taichi.math as tm
from films import add_constant, add_samples
from support import DEBUG, start

import taichi_tracer as tt
from taichi_tracer.picture.film import Film
from taichi_tracer.system import runtime


@ti.kernel
def _fill(film: ti.template()):
    for x, y in film.canvas:
        film.put(x, y, tm.vec3(x, y, 0), ti.u32(0))


def test_top_row_first(precision):
    film = Film(3, 2)
    _fill(film)
    image = film.image()
    assert image.dtype == np.float32
    np.testing.assert_array_equal(image[..., 0], [[0, 1, 2], [0, 1, 2]])
    np.testing.assert_array_equal(image[..., 1], [[1, 1, 1], [0, 0, 0]])


def test_a_picture_that_is_every_sample_has_no_error(precision):
    film = Film(3, 2, averages=False)
    _fill(film)
    assert film.error() == film.error().high == film.standard_error().max() == 0


def test_mean_and_variance_are_those_of_the_samples(precision, rng):
    values = rng.lognormal(size=(5_000, 3)).astype(runtime.dtype())
    film = Film(2, 1)
    add_samples(film, values)
    exact = values.astype(np.float64)
    np.testing.assert_allclose(film.image()[0, 1], exact.mean(axis=0), rtol=2e-7)
    np.testing.assert_allclose(film.variance_of_mean()[0, 0], exact.var(axis=0, ddof=1) / len(exact), rtol=1e-4)
    relative = np.sqrt(exact.var(axis=0, ddof=1).mean() / len(exact)) / exact.mean()
    np.testing.assert_allclose(film.error(), relative, rtol=1e-4)


def test_two_replicas_tell_the_variance_by_their_difference(precision, rng):
    values = rng.lognormal(size=(7, 3)).astype(runtime.dtype())
    film = Film(1, 1, replicated=True)
    add_samples(film, values)
    even, odd = values[::2].mean(axis=0, dtype=np.float64), values[1::2].mean(axis=0, dtype=np.float64)
    expected = (even - odd) ** 2 * (4 / 7) * (3 / 7)
    np.testing.assert_allclose(film.variance_of_mean()[0, 0], expected, rtol=1e-4)
    one = Film(1, 1, replicated=True)
    add_samples(one, values[:1])
    assert np.isnan(one.variance_of_mean()).all()
    assert np.isnan(one.error())


def test_only_the_crop_takes_samples():
    start("f32")
    film = Film(4, 3, crop=(1, 3, 0, 2))
    add_constant(film, 1.0, 2)
    np.testing.assert_array_equal(film.counts(), [[0, 0, 0], [2, 2, 0], [2, 2, 0], [0, 0, 0]])
    for crop in ((0, 5, 0, 1), (2, 2, 0, 1), (-1, 2, 0, 1)):
        with pytest.raises(tt.InputError, match="does not lie within 4x3"):
            Film(4, 3, crop=crop)


def test_a_film_of_an_earlier_start_says_so():
    start("f32")
    film = Film(2, 2)
    runtime.init("cpu", force=True, debug=DEBUG)
    errors = film.standard_error, film.variance_of_mean
    for use in (film.image, film.show, film.reset, *errors, film.non_finite_samples, film.to_arrays):
        with pytest.raises(tt.StaleSceneError):
            use()
    with pytest.raises(tt.StaleSceneError):
        Film(2, 2).merge(film)
