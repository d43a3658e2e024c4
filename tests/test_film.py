"""Which way up the picture is, and what a film outlives."""

import numpy as np
import pytest
import taichi as ti
from support import DEBUG, start

import taichi_tracer as tt
from taichi_tracer import runtime
from taichi_tracer.film import Film


@ti.kernel
def _fill(film: ti.template()):
    for x, y in film.canvas:
        film.put(x, y, ti.math.vec3(x, y, 0))


def test_top_row_first(precision):
    film = Film(3, 2)
    _fill(film)
    image = film.image()
    assert image.dtype == np.float32
    np.testing.assert_array_equal(image[..., 0], [[0, 1, 2], [0, 1, 2]])
    np.testing.assert_array_equal(image[..., 1], [[1, 1, 1], [0, 0, 0]])


def test_a_film_of_an_earlier_start_says_so():
    start("f32")
    film = Film(2, 2)
    runtime.init("cpu", force=True, debug=DEBUG)
    with pytest.raises(tt.StaleSceneError):
        film.image()
