"""What the package's sequences have in common: a method ``point`` gives both numbers of a pair."""

import taichi as ti

from taichi_tracer.formulas import vector_math as tm
from taichi_tracer.sampler import Sampler


@ti.data_oriented
class PointSampler(Sampler):
    """A sampler whose pairs are the two numbers of a method ``point``."""

    @ti.func
    def get_2d(self, seed, pixel, index, dimension):
        """Two numbers in [0, 1)."""
        pair = tm.vec2(0)
        pair.x, pair.y = self.point(seed, pixel, index, dimension)
        return pair

    @ti.func
    def point(self, seed, pixel, index, dimension):
        """The two numbers separately; the keys may also be vectors. A subclass defines it."""
        ti.static_assert(False, "a sampler of points must say what point(self, seed, pixel, index, dimension) is")
