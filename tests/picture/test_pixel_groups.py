"""Numbers of pixels in groups of sixteen: the same numbers by pixel, by group, and in numpy."""

import contextlib

import numpy as np
import pytest
import taichi as ti
import taichi.math as tm
from support import without_arrays

from taichi_tracer.picture.pixel_groups import GROUP, PIXELS, PixelGroups, groups_along
from taichi_tracer.system.memory import Memory

WIDTH, HEIGHT, HALVES = 7, 9, 2  # neither is a multiple of the side of a group


@ti.data_oriented
class Numbers:
    """Numbers and colours of a small picture, with kernels that use them pixel by pixel."""

    def __init__(self):
        self.memory = Memory()
        node = self.memory.fields.dense(ti.k, HALVES).dense(ti.ij, (groups_along(WIDTH), groups_along(HEIGHT)))
        self.counts = PixelGroups(node, WIDTH, HEIGHT, 1, ti.i32)
        self.colours = PixelGroups(node, WIDTH, HEIGHT, 3)
        self.memory.allocate()

    @ti.kernel
    def set(self):
        for x, y, half in ti.ndrange(WIDTH, HEIGHT, HALVES):
            k = (x * HEIGHT + y) * HALVES + half
            self.counts.set_number(x, y, half, k)
            self.colours.set_colour(x, y, half, tm.vec3(k, k + 0.25, k + 0.5))

    @ti.kernel
    def get(self, found: ti.types.ndarray(ndim=4)):
        for x, y, half in ti.ndrange(WIDTH, HEIGHT, HALVES):
            colour = self.colours.colour(x, y, half)
            found[x, y, half, 0] = self.counts.number(x, y, half)
            for k in ti.static(range(3)):
                found[x, y, half, k + 1] = colour[k]


@pytest.fixture(params=["numpy", "kernels"])
def numbers(f32, request):
    with without_arrays() if request.param == "kernels" else contextlib.nullcontext():
        return Numbers()


def expected():
    k = np.arange(WIDTH * HEIGHT * HALVES).reshape(WIDTH, HEIGHT, HALVES)
    return k, (k[..., None] + [0, 0.25, 0.5]).astype(np.float32)


def test_python_reads_what_kernels_set(numbers):
    numbers.set()
    counts, colours = expected()
    np.testing.assert_array_equal(numbers.counts.read(numbers.memory), counts)
    np.testing.assert_array_equal(numbers.colours.read(numbers.memory), colours)


def test_kernels_read_what_python_wrote(numbers):
    counts, colours = expected()
    numbers.counts.write(numbers.memory, counts)
    numbers.colours.write(numbers.memory, colours)
    found = np.zeros((WIDTH, HEIGHT, HALVES, 4), np.float32)
    numbers.get(found)
    np.testing.assert_array_equal(found[..., 0], counts)
    np.testing.assert_array_equal(found[..., 1:], colours)


def test_a_group_has_its_pixels_side_by_side(f32):
    numbers = Numbers()
    numbers.set()
    counts, _ = expected()
    groups = numbers.memory.read(numbers.counts.lanes[0])
    assert groups.shape == (2, 3, HALVES, PIXELS)
    np.testing.assert_array_equal(groups[0, 1, 1], counts[:GROUP, GROUP : 2 * GROUP, 1].ravel())
    assert groups[1, 2, 0, 3 * GROUP] == 0  # beyond the picture
