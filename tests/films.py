"""Samples for films."""

import taichi as ti
import taichi.math as tm


@ti.kernel
def add_samples(film: ti.template(), values: ti.types.ndarray(ndim=2)):
    """Add (n, 3) samples to every pixel of a film."""
    for x, y in ti.ndrange(*film.ranges):
        for i in range(values.shape[0]):
            film.add(x, y, tm.vec3(values[i, 0], values[i, 1], values[i, 2]), ti.cast(i, ti.u32))


@ti.kernel
def add_constant(film: ti.template(), value: float, count: int):
    """Add the same sample to every pixel several times."""
    for x, y in ti.ndrange(*film.ranges):
        for i in range(count):
            film.add(x, y, tm.vec3(value, value / 3, value * 1e6), ti.cast(i, ti.u32))
