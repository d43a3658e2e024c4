"""A sampler: where random numbers come from."""

import taichi as ti
import taichi.math as tm

import taichi_tracer as tt
from taichi_tracer.formulas.hashes import as_fraction, pcg4d


@tt.register
class Mine(tt.Sampler):
    """Independent numbers; the error falls faster if those of several samples are more even than chance makes them.

    ``index`` counts the samples of a pixel, and ``dimension`` the pairs of one sample; ``pixel`` is the number of the
    pixel. All four are u32. The same four numbers always give the same pair, in each run and on each machine.
    """

    name = "mine"

    @ti.func
    def get_2d(self, seed, pixel, index, dimension):
        """A vec2 in [0, 1)²."""
        a, b, _, _ = pcg4d(pixel, index, dimension, seed)
        return tm.vec2(as_fraction(a), as_fraction(b))
