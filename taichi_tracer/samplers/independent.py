"""Independent random numbers."""

import taichi as ti

from taichi_tracer.formulas.hashes import as_fraction, pcg4d
from taichi_tracer.samplers.points import PointSampler
from taichi_tracer.system.parts import overridable, register


@register
@ti.data_oriented
@overridable("point")
class IndependentSampler(PointSampler):
    """Independent uniform numbers: for n samples, the error decreases as n^(−1/2) for every integrand."""

    name = "independent"

    @ti.func
    def point(self, seed, pixel, index, dimension):
        """The two numbers separately; the keys may also be vectors."""
        a, b, _, _ = pcg4d(pixel, index, dimension, seed)
        return as_fraction(a), as_fraction(b)
