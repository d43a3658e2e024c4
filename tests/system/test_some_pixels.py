"""Samples of chosen pixels: each is taken once, the others are not, and no choice compiles anything anew."""

import numpy as np
import pytest
import taichi as ti
import taichi.math as tm

from taichi_tracer.system.some_pixels import NEVER, SomePixels

WIDTH, HEIGHT = 9, 7


@ti.data_oriented
class Loop:
    """Records the value x + 10 y of every pixel; notes which was the last one, and how often each was taken."""

    def __init__(self, in_order=False):
        self.pixels = SomePixels(self.take, in_order)
        self.values, self.times = ti.field(ti.i32, (WIDTH, HEIGHT)), ti.field(ti.i32, (WIDTH, HEIGHT))
        self.order, self.count = ti.field(ti.i32, WIDTH * HEIGHT), ti.field(ti.i32, ())

    @ti.kernel
    def run(self, pixels: ti.template()):
        for x, y in ti.ndrange(*pixels.ranges):
            pixels.record(x, y, tm.vec3(x + 10 * y), ti.u32(0))

    @ti.func
    def take(self, x, y, value, index):
        self.values[x, y] = ti.cast(value.x, ti.i32)
        self.times[x, y] += 1
        self.order[ti.atomic_add(self.count[None], 1)] = x * HEIGHT + y


pytestmark = pytest.mark.usefixtures("f32")


@pytest.mark.parametrize("in_order", [False, True])
def test_chosen_pixels_are_taken_once(in_order):
    loop = Loop(in_order)
    for columns, rows in [((2, 5), (1, 7)), ((0, WIDTH), (0, HEIGHT)), ((8, 9), (6, 7)), ((3, 3), (0, 7))]:
        loop.pixels.choose(columns, rows)
        loop.times.fill(0)
        loop.count[None] = 0
        loop.run(loop.pixels)
        expected = np.zeros((WIDTH, HEIGHT), int)
        expected[slice(*columns), slice(*rows)] = 1
        assert np.array_equal(loop.times.to_numpy(), expected)
        taken = loop.order.to_numpy()[: expected.sum()].tolist()
        assert sorted(taken) == np.flatnonzero(expected).tolist()
        assert taken == sorted(taken) or not in_order
    assert loop.values.to_numpy()[4, 3] == 34
    assert len(Loop.run._primal.compiled_kernels) <= 2  # one for each of ``in_order``


def test_values_that_nobody_takes_are_used_and_change_nothing():
    loop, unwatched = Loop(), SomePixels()
    unwatched.choose((0, 3), (0, 3))
    loop.run(unwatched)
    assert loop.times.to_numpy().sum() == unwatched.unused[None] == 0
    assert NEVER < 0
