"""What numpy reads from a film has the same bits as what kernels read."""

import numpy as np
import pytest
import taichi as ti
import taichi.math as tm
from support import long_except, without_arrays

from taichi_tracer.picture import film as films
from taichi_tracer.picture.film import Film
from taichi_tracer.system import runtime

KINDS = [{"replicated": True}, {"doubles": True}, {}]


@ti.kernel
def _add(film: ti.template(), values: ti.types.ndarray(ndim=3)):
    for x, y in ti.ndrange(*film.ranges):
        i = x * film.height + y
        for k in range(i % (values.shape[1] + 1)):  # some pixels have no sample
            film.add(x, y, tm.vec3(values[i, k, 0], values[i, k, 1], values[i, k, 2]), ti.cast(k, ti.u32))


def film_of(kind, rng, low=-20.0, high=20.0):
    """A film whose samples differ by many powers of ten, so that there are rests and residues."""
    film = Film(16, 9, **kind)
    values = rng.normal(size=(16 * 9, 20, 3)) * 10 ** rng.uniform(low, high, (16 * 9, 20, 1))
    _add(film, values.astype(runtime.dtype()))
    return film


def read(film):
    """The picture and what is known of its spread."""
    return film.image(), *film._spread()


@pytest.mark.parametrize("kind", KINDS, ids=str)
@pytest.mark.parametrize("exponents", [(-20.0, 20.0), (-3.0, 3.0)], ids=str)
def test_both_ways_read_the_same_bits(precision, rng, monkeypatch, kind, exponents):
    film = film_of(kind, rng, *exponents)
    by_numpy = read(film)
    monkeypatch.setattr(films, "FEW_PIXELS", 0)
    for one, other in zip(by_numpy, read(film), strict=True):
        assert one.dtype == other.dtype
        assert one.flags.c_contiguous
        np.testing.assert_array_equal(one, other)


@pytest.mark.parametrize("kind", long_except(KINDS, KINDS[0]), ids=str)
def test_a_film_is_cleared_by_both_ways_alike(f32, rng, kind):
    film = film_of(kind, rng)
    film.clear()
    directly = film.to_arrays()
    with without_arrays():
        other = film_of(kind, rng)
    other.clear()
    by_kernel = other.to_arrays()
    assert directly.keys() == by_kernel.keys()
    assert all(np.array_equal(directly[name], by_kernel[name]) for name in directly)
    assert not directly["values"].any()
    assert not directly["counts"].any()


def test_a_view_is_read_by_both_ways_alike(f32, rng):
    values = rng.random((5, 4, 3)).astype(np.float32)
    with without_arrays():
        other = Film(5, 4, averages=False)
    assert not other.memory.has_arrays
    for film in (Film(5, 4, averages=False), other):
        film.canvas.from_numpy(values)
        np.testing.assert_array_equal(film.image(), values.swapaxes(0, 1)[::-1])
