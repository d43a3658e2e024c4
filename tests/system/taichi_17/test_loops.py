"""Loops whose lengths are arguments of the kernel visit the same indices as Taichi's own."""

import numpy as np
import pytest
import taichi as ti
from support import needs_arrays

from taichi_tracer.system import memory
from taichi_tracer.system.varying import varying

SIZES = [(1, 1, 1), (3, 5, 2), (4, 1, 7)]


@ti.data_oriented
class Loops:
    """Counts how often each index is visited."""

    def __init__(self, x, y, z):
        self.line, self.plane, self.space = (ti.field(ti.i32) for _ in range(3))
        self.pair = ti.Struct.field({"a": ti.i32, "b": ti.math.vec3})
        self._memory = memory.Memory()
        with self._memory as fields:
            fields.dense(ti.i, x).place(self.line, self.pair)
            fields.dense(ti.ij, (x, y)).place(self.plane)
            fields.dense(ti.ijk, (x, y, z)).place(self.space)
        self.ranges = varying(((0, x), (0, y), (0, z)))
        self.inner = varying(((1, x), (y // 2, y)))

    @ti.kernel
    def over_fields(self):
        for i in self.line:
            self.line[i] += 1 + i
        for x, y in self.plane:
            self.plane[x, y] += 1 + 10 * x + y
        for index in ti.grouped(self.space):
            self.space[index] += 1 + 100 * index.x + 10 * index.y + index.z
        for i in self.pair:
            self.pair[i].a += i
            self.pair[i].b = [i, 2 * i, 3 * i]

    @ti.kernel
    def over_ranges(self):
        for x, y, z in ti.ndrange(*self.ranges):
            self.space[x, y, z] += 1 + 100 * x + 10 * y + z
        for x, y in ti.ndrange(*self.inner):
            self.plane[x, y] += 1 + 10 * x + y
        for i in range(self.ranges[0][1]):
            self.line[i] += 1 + i

    @ti.kernel
    def within(self):
        ti.loop_config(serialize=True)
        for _ in range(2):
            for x, y in ti.ndrange(*self.inner):
                self.plane[x, y] += 1 + 10 * x + y


@pytest.fixture(params=SIZES, ids=str)
def sizes(f32, request):
    needs_arrays()
    return request.param


def numbers(*sizes):
    """1 for the first index, and another number for each of the others."""
    index = np.indices(sizes)
    return 1 + sum(10 ** (len(sizes) - 1 - k) * axis for k, axis in enumerate(index))


def test_loops_over_fields(sizes):
    loops = Loops(*sizes)
    loops.over_fields()
    np.testing.assert_array_equal(loops.line.to_numpy(), numbers(sizes[0]))
    np.testing.assert_array_equal(loops.plane.to_numpy(), numbers(*sizes[:2]))
    np.testing.assert_array_equal(loops.space.to_numpy(), numbers(*sizes))
    pair = loops.pair.to_numpy()
    np.testing.assert_array_equal(pair["a"], np.arange(sizes[0]))
    np.testing.assert_array_equal(pair["b"], np.outer(np.arange(sizes[0]), [1, 2, 3]))


def test_loops_over_ranges(sizes):
    loops = Loops(*sizes)
    loops.over_ranges()
    np.testing.assert_array_equal(loops.space.to_numpy(), numbers(*sizes))
    np.testing.assert_array_equal(loops.line.to_numpy(), numbers(sizes[0]))
    expected = numbers(*sizes[:2])
    expected[:1] = 0
    expected[:, : sizes[1] // 2] = 0
    np.testing.assert_array_equal(loops.plane.to_numpy(), expected)


def test_loops_within_loops(sizes):
    loops = Loops(*sizes)
    loops.within()
    expected = 2 * numbers(*sizes[:2])
    expected[:1] = 0
    expected[:, : sizes[1] // 2] = 0
    np.testing.assert_array_equal(loops.plane.to_numpy(), expected)


def test_a_wrong_number_of_variables_is_told(f32):
    needs_arrays()
    loops = Loops(2, 2, 2)

    @ti.kernel
    def run(of: ti.template()):
        for x, y in of.line:
            of.plane[x, y] = 1

    with pytest.raises(ti.TaichiCompilationError, match="a loop over a field with 1 axes has 2 variables"):
        run(loops)
