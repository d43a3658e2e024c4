"""What is known of the spread of a film's samples. A kernel reads it or, of a small film, numpy with the same bits."""

from typing import Any, NamedTuple

import numpy as np
import taichi as ti
import taichi.math as tm

from taichi_tracer.picture.error_estimate import (
    error_from_deviation,
    error_from_halves,
    error_of_sequence,
    errors_from_deviations,
    errors_from_halves,
    errors_of_sequence,
)
from taichi_tracer.picture.pixel_groups import upright
from taichi_tracer.system import runtime


class Spread(NamedTuple):
    """Of every pixel, top row first.

    Attributes:
        errors: (height, width, 3) float32, the standard error of the mean; NaN where it is unknown.
        groups: (height, width) int32, the number of independent groups of samples from which it was estimated.
        largest: the largest sample in the running precision, as a mean of red, green and blue; 0 if it is not kept.
        counts: (height, width) int32, the number of samples.
    """

    errors: np.ndarray
    groups: np.ndarray
    largest: np.ndarray
    counts: np.ndarray


def spread_of(film: Any) -> Spread:
    """The spread of a ``Film``."""
    if film.is_read_by_numpy:
        return spread_by_numpy(film)
    shape = film.height, film.width
    errors, largest = np.empty((*shape, 3), np.float32), np.zeros(shape, runtime.dtype())
    groups, counts = np.empty(shape, np.int32), np.empty(shape, np.int32)
    _write_spread(film, errors, groups, largest, counts)
    return Spread(errors, groups, largest, counts)


def spread_by_numpy(film: Any) -> Spread:
    """The same, by numpy."""
    memory = film.memory
    groups = count = film.counts()
    if film.halves == 2:
        largest, halves = film.largest.read(memory)[..., 0], film.half_count.read(memory)
        groups = np.where((halves > 0).all(axis=2), 2, 1)
        total = film.total.read(memory)
        if film.doubles:
            errors = errors_of_sequence(film.before.read(memory)[:, :, 0], total, halves)
        else:
            errors = errors_from_halves(total, halves)
    else:
        largest = np.zeros(count.shape, runtime.dtype())
        errors = errors_from_deviations(memory.array(film.deviation), memory.array(film.scale), count)
    errors = np.where(groups[..., None] > 1, errors, np.nan)
    counts = upright(count, np.int32)
    return Spread(upright(errors), upright(groups, np.int32), upright(largest, runtime.dtype()), counts)


@ti.kernel
def _write_spread(
    film: ti.template(),
    errors: ti.types.ndarray(dtype=ti.f32, ndim=3),
    groups: ti.types.ndarray(dtype=ti.i32, ndim=2),
    largest: ti.types.ndarray(ndim=2),
    counts: ti.types.ndarray(dtype=ti.i32, ndim=2),
):
    for row, column in ti.ndrange(film.height, film.width):
        x, y = column, film.height - 1 - row
        k, e = film.count.number(x, y, 0), tm.vec3(0)
        counts[row, column] = k
        if ti.static(film.halves == 2):
            largest[row, column] = film.largest.number(x, y, 0)
            n_even, n_odd = film.half_count.number(x, y, 0), film.half_count.number(x, y, 1)
            k = ti.select(n_even > 0 and n_odd > 0, 2, 1)
            even, odd = film.total.colour(x, y, 0), film.total.colour(x, y, 1)
            if ti.static(film.doubles):
                e = error_of_sequence(film.before.colour(x, y, 0), even, n_even, odd, n_odd)
            else:
                e = error_from_halves(even, n_even, odd, n_odd)
        else:
            e = error_from_deviation(film.deviation[x, y], film.scale[x, y], k)
        groups[row, column] = k
        for i in ti.static(range(3)):
            errors[row, column, i] = ti.select(k > 1, ti.cast(e[i], ti.f32), tm.nan)
