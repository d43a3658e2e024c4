"""Films whose samples are added up: the sums, the deviations and the halves of two films of the same kind."""

from typing import Any

import taichi as ti
import taichi.math as tm

from taichi_tracer.system.errors import InputError


def merge(film: Any, other: Any) -> None:
    """Add to a ``Film`` the samples of another one. Both were made with the same options; an InputError if not."""
    if (film.width, film.height) != (other.width, other.height):
        raise InputError(
            f"film: {other.width}x{other.height} samples cannot be added to a film of {film.width}x{film.height}"
        )
    if (film.halves, film.doubles, film.keeps_deviation) != (other.halves, other.doubles, other.keeps_deviation):
        raise InputError("film: samples of different samplers cannot be added")
    film.non_finites.add(other.non_finites)
    merge_pixels(film, other)


@ti.kernel
def merge_pixels(film: ti.template(), other: ti.template()):
    """Add the numbers of every pixel."""
    for x, y in film.canvas:
        n, m = film.count.number(x, y, 0), other.count.number(x, y, 0)
        if m > 0:
            if ti.static(film.keeps_deviation):
                root = tm.sqrt(ti.max(other.deviation[x, y], 0.0)) / other.scale[x, y]
                film.add_deviation(x, y, root, root)
                difference = (other.mean(x, y) - film.mean(x, y)) * tm.sqrt(ti.cast(n, float) * m / (n + m))
                film.add_deviation(x, y, difference, difference)  # Chan et al. 1979
            if ti.static(film.halves == 2):
                largest = ti.max(film.largest.number(x, y, 0), other.largest.number(x, y, 0))
                film.largest.set_number(x, y, 0, largest)
            if ti.static(film.doubles):
                film.begin_doubling(x, y)
                if n == 0:
                    film.before.set_colour(x, y, 0, other.before.colour(x, y, 0))
            for half in ti.static(range(film.halves)):
                film.move_half(other, x, y, half, half_of_others(film, half, n))
            film.canvas[x, y] = film.mean(x, y)


@ti.func
def half_of_others(film: ti.template(), half, n):
    """The half to which samples are added that are half ``half`` of another film; the film had n samples before.

    If all samples are one sequence, those of the other film continue it: they are the others of this doubling.
    """
    into = half
    if ti.static(film.doubles):
        into = 1 if n > 0 else half
    return into
