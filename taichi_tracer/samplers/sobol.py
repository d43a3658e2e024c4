"""Sobol' points, scrambled as Owen does it: every pair of dimensions is a net."""

import taichi as ti

from taichi_tracer.formulas.hashes import as_fraction, pascal_matrix, pcg4d, reverse_bits, scramble_reversed
from taichi_tracer.samplers.points import PointSampler
from taichi_tracer.system.parts import overridable, register


@register
@ti.data_oriented
@overridable("point")
class SobolSampler(PointSampler):
    """Owen-scrambled Sobol' points: every use takes the first two dimensions in another order (Burley 2020).

    Samples with even and with odd index belong to two sequences that are scrambled independently. The difference of
    these sequences shows the error. In every pair of dimensions, the first 2^m samples of a sequence are a
    (0, m, 2)-net: every box of volume 2^−m contains exactly one of them. For n samples, the error decreases almost as
    fast as n^(−3/2) if the integrand is smooth. It is hardly ever larger than that of independent numbers.
    """

    name, replicated = "sobol", True

    @ti.func
    def point(self, seed, pixel, index, dimension):
        """The two numbers separately; the keys may also be vectors."""
        replica, place = index & ti.u32(1), index >> 1
        shuffle, seed_x, seed_y, _ = pcg4d(pixel, dimension, seed, replica)
        shuffled = reverse_bits(scramble_reversed(reverse_bits(place), shuffle))
        x = reverse_bits(scramble_reversed(shuffled, seed_x))
        y = reverse_bits(scramble_reversed(pascal_matrix(shuffled), seed_y))
        return as_fraction(x), as_fraction(y)
