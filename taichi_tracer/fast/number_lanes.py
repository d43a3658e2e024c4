"""The random numbers of sixteen neighbouring pixels, computed at once, with the same bits.

A pair of random numbers is a long chain of operations on whole numbers, and the same one for every pixel. For sixteen
pixels side by side, it takes hardly longer than for one.
"""

import numpy as np
import taichi as ti
import taichi.math as tm

from taichi_tracer.fast.lanes import LANES
from taichi_tracer.picture.adaptive import SHARE_BITS
from taichi_tracer.sampler import TERM_BIT
from taichi_tracer.system import memory
from taichi_tracer.system.seams import replaced

FIRST_DIMENSION = 0  # the dimension of the sampler that belongs to the pixel


def has_points(sampler) -> bool:
    """Whether a sampler's pairs can be computed in lanes: it defines ``point``, and none of its methods is replaced."""
    return hasattr(sampler, "point") and not replaced(sampler)


@ti.func
def pairs_of(sampler: ti.template(), shares: ti.template(), x, y, seed, index, dimension):
    """The pair of one dimension for sixteen pixels: (sixteen first numbers, sixteen second numbers).

    Args:
        x, y: the columns and the rows of the pixels, sixteen lanes each.
        index: the index of the present pass; ``shares`` says which sample of a pixel this is.
    """
    pixel = ti.cast(y * sampler.width + x, ti.u32)
    zero = ti.u32(0) * pixel  # added to a number that all lanes share, it makes a vector
    sample = index + zero
    if ti.static(shares.are_kept):
        share = ti.Vector([shares.share[x[lane], y[lane]] for lane in range(LANES)])
        sample = sample * share >> SHARE_BITS
    return sampler.point(seed + zero, pixel, sample, ti.u32(dimension) + zero)


@ti.data_oriented
class NumberLanes:
    """The pairs that a sample of direct light takes, for sixteen pixels in each place.

    ``first`` and ``second`` are the numbers of a pair in a place, in sixteen lanes. The pairs have the dimensions that
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
        self.dimension.from_numpy(np.array(dimensions[:pairs], np.uint32))

    @ti.func
    def find(self, c, x, y, seed, index):
        """Compute the pairs of sixteen pixels."""
        for k in range(self.pairs[None]):  # a length that LLVM does not know, so that it does not write the loop twice
            first, second = pairs_of(self.sampler, self.shares, x, y, seed, index, self.dimension[k])
            self.first[c, k], self.second[c, k] = first, second


class KeptNumbers:
    """``RandomNumbers`` of a pixel whose pairs are in ``NumberLanes``, for ``next_2d_of_term`` and then ``next_2d``."""

    _data_oriented = True  # allows kernels to keep it in a variable and to pass it to functions

    def __init__(self, numbers: NumberLanes, c, lane) -> None:
        self.numbers, self.c, self.lane = numbers, c, lane

    @ti.func
    def next_2d_of_term(self):
        """Two numbers in [0, 1)."""
        return tm.vec2(self.numbers.first[self.c, 0][self.lane], self.numbers.second[self.c, 0][self.lane])

    @ti.func
    def next_2d(self):
        """Two numbers in [0, 1)."""
        return tm.vec2(self.numbers.first[self.c, 1][self.lane], self.numbers.second[self.c, 1][self.lane])

    @ti.func
    def skip_2d(self):
        """Nothing: each pair is kept by itself."""
