"""The random numbers of neighbouring pixels, computed at once, with the same bits.

A pair of random numbers is a long chain of operations on whole numbers, and the same one for every pixel. Of a loop
over pixels that only reads and writes variables of the kernel, LLVM makes vector instructions: eight pixels take hardly
longer than one.
"""

import numpy as np
import taichi as ti
import taichi.math as tm

from taichi_tracer.fast.lanes import LANES, lanes
from taichi_tracer.fast.packets import TILE
from taichi_tracer.random_numbers import TERM_BIT, RandomNumbers
from taichi_tracer.system import memory
from taichi_tracer.system.seams import replaced

FIRST_DIMENSION = 0  # the dimension of the sampler that belongs to the pixel


def has_points(sampler) -> bool:
    """Whether a sampler's pairs can be computed in lanes: it defines ``point``, and none of its methods is replaced."""
    return hasattr(sampler, "point") and not replaced(sampler)


@ti.func
def pairs_of(sampler: ti.template(), shares: ti.template(), low_x, low_y, seed, index, dimension):
    """The pair of one dimension for a group of 4 × 4 pixels: (their first numbers, their second numbers), in lanes.

    Beyond the picture, they are those of the nearest pixel.

    Args:
        low_x, low_y: the lowest column and row of the group.
        index: the index of the present pass; ``shares`` says which sample of a pixel this is.
    """
    first, second = lanes(0.0), lanes(0.0)
    for lane in range(LANES):
        x, y = ti.min(low_x + lane // TILE, sampler.width - 1), ti.min(low_y + lane % TILE, sampler.height - 1)
        sample, _ = shares.sample_of(x, y, index)
        pixel = sampler.pixel_number(x, y)
        first[lane], second[lane] = sampler.point(seed, pixel, sample, ti.u32(dimension))
    return first, second


@ti.data_oriented
class NumberLanes:
    """The pairs that a sample of direct light takes, for a group of 4 × 4 pixels in each place.

    ``first`` and ``second`` are the numbers of a pair of all pixels of a group. The pairs have the dimensions that
    ``RandomNumbers`` gives them behind that of the pixel: first that of ``next_2d_of_term``, then that of ``next_2d``,
    if the estimator takes it.

    Args:
        sampler: a sampler that ``has_points``. shares: the ``Shares`` of the picture.
        pairs: how many pairs a sample takes, 1 or 2. places: the number of threads.
    """

    def __init__(self, sampler, shares, pairs: int, places: int) -> None:
        self.sampler, self.shares = sampler, shares
        first = FIRST_DIMENSION + 1
        dimensions = (first | 1 << TERM_BIT, first) if sampler.shares_terms else (first, first + 1)
        self._memory = memory.Memory()
        self.first, self.second = (ti.Vector.field(LANES, float) for _ in range(2))
        self._memory.fields.dense(ti.i, places).dense(ti.j, pairs).place(self.first, self.second)
        self.pairs, self.dimension = ti.field(ti.i32), ti.field(ti.u32)
        self._memory.fields.place(self.pairs)
        self._memory.fields.dense(ti.i, pairs).place(self.dimension)
        self._memory.allocate()
        self.pairs[None] = pairs
        self._memory.write(self.dimension, np.array(dimensions[:pairs], np.uint32))

    @ti.func
    def find(self, c, group_x, group_y, seed, index):
        """Compute the pairs of the pixels of a group. Beyond the picture, they are those of the nearest pixel."""
        low_x, low_y = group_x * TILE, group_y * TILE
        for k in range(self.pairs[None]):  # a length that LLVM does not know, so that it writes the loop only once
            first, second = pairs_of(self.sampler, self.shares, low_x, low_y, seed, index, self.dimension[k])
            self.first[c, k], self.second[c, k] = first, second

    @ti.func
    def pair(self, c, k: ti.template(), lane):
        """Pair k of a pixel; lanes are those of ``PrimaryHits.tile_and_lane``."""
        return tm.vec2(self.first[c, k][lane], self.second[c, k][lane])


class KeptNumbers:
    """``RandomNumbers`` of a pixel whose pairs are in ``NumberLanes``, for ``next_2d_of_term`` and then ``next_2d``.

    A handout's method that draws its numbers itself (``sampler.given_or_drawn``) takes them from ``rng``. Therefore
    ``rng`` counts the pairs, too, as it would without lanes.
    """

    _data_oriented = True  # allows kernels to keep it in a variable and to pass it to functions

    def __init__(self, numbers: NumberLanes, rng: RandomNumbers, c, lane) -> None:
        self.numbers, self.rng, self.c, self.lane = numbers, rng, c, lane

    @ti.func
    def next_2d_of_term(self):
        """Two numbers in [0, 1)."""
        self.rng.count_term()
        return self.numbers.pair(self.c, 0, self.lane)

    @ti.func
    def next_2d(self):
        """Two numbers in [0, 1)."""
        self.rng.skip_2d()
        return self.numbers.pair(self.c, 1, self.lane)

    @ti.func
    def skip_2d(self):
        """Skip the pair of the next dimension."""
        self.rng.skip_2d()
