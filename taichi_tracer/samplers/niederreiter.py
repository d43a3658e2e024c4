"""Points of Niederreiter's sequence in base 4: the pixel and a direction are evenly distributed together."""

import taichi as ti

from taichi_tracer.formulas.finite_fields import first_pair, second_pair
from taichi_tracer.formulas.hashes import as_fraction, pcg4d, reverse_bits, scramble_reversed
from taichi_tracer.formulas.random_numbers import TERM_BIT
from taichi_tracer.samplers.points import PointSampler
from taichi_tracer.system.parts import overridable, register


@register
@ti.data_oriented
@overridable("point")
class NiederreiterSampler(PointSampler):
    """Owen-scrambled points of Niederreiter's (0, 4)-sequence in base 4: the pixel and a direction are even together.

    Two dimensions form a set, which is one sequence of four numbers: the pixel and the first surface, the second and
    the third surface, and so on. In every set, each box of volume 4^−m whose sides are powers of 1/4 contains exactly
    one of the first 4^m samples of a sequence. With pairs that are shuffled separately, this holds only in each
    dimension by itself; therefore, where light changes across a pixel, the error decreases more slowly. Every set takes
    the sequence in another order, and every number is scrambled by itself (Burley 2020). ``formulas.finite_fields`` has
    the sequence and its sources.

    All samples of a pixel are one sequence. The change of its mean when the number of samples doubles shows the error,
    see ``error_estimate``. Every pair of dimensions is a (0, m, 2)-net in base 2.
    """

    name, doubles, shares_terms = "niederreiter", True, True

    @ti.func
    def place_of(self, index):
        """(the number of the sequence, the place in it) of a sample."""
        return index & ti.u32(0), index

    @ti.func
    def point(self, seed, pixel, index, dimension):
        """The two numbers separately; the keys may also be vectors."""
        replica, place = self.place_of(index)
        first_of_set = dimension & ti.u32((1 << TERM_BIT) - 2)
        shuffle, _, _, _ = pcg4d(pixel, first_of_set, seed, replica)
        _, seed_x, seed_y, _ = pcg4d(pixel, dimension, seed, replica)
        shuffled = reverse_bits(scramble_reversed(reverse_bits(place), shuffle))
        first_x, first_y = first_pair(shuffled)
        second_x, second_y = second_pair(shuffled)
        is_second = (dimension & ti.u32(1)) == 1
        x, y = ti.select(is_second, second_x, first_x), ti.select(is_second, second_y, first_y)
        return as_fraction(reverse_bits(scramble_reversed(x, seed_x))), as_fraction(
            reverse_bits(scramble_reversed(y, seed_y))
        )


@register
@ti.data_oriented
@overridable("point")
class TwoNiederreiterSampler(NiederreiterSampler):
    """Two sequences of ``NiederreiterSampler``: a larger error, which is known more exactly.

    As with ``SobolSampler``, samples with even and with odd index belong to two sequences that are scrambled
    independently, and their difference shows the error. Two sequences of n/2 points are less even together than one
    sequence of n points.
    """

    name, replicated, doubles = "niederreiter_two", True, False

    @ti.func
    def place_of(self, index):
        """(the number of the sequence, the place in it) of a sample."""
        return index & ti.u32(1), index >> 1
