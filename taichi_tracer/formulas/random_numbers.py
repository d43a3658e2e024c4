"""The random numbers of one sample of one pixel, inside kernels: ``rng.next_2d()``, ``rng.next_1d()``.

The first pair of every sample belongs to the pixel (A2-1); then every surface takes one pair for its BRDF and one pair
for the light. The number of dimensions has no limit. ``sampler`` says where the numbers come from.
"""

import taichi as ti
from taichi.lang import impl

from taichi_tracer.formulas import vector_math as tm
from taichi_tracer.system.compile_time import compile_time, variable

TERM_BIT = 16  # dimensions are counted in the bits below, terms that share a dimension in the bits above


class RandomNumbers:
    """The numbers of one sample of one pixel, which ``Sampler.start`` begins.

    Attributes:
        x, y: the pixel. index: the index of the sample.
        dimension: how many dimensions were used so far.
        terms: how many pairs of ``next_2d_of_term`` share a dimension with another pair.
    """

    _data_oriented = True  # allows kernels to keep it in a variable and to pass it to functions
    _begun_last: tuple | None = None  # (the kernel that is being compiled, its numbers)

    def __init__(self, sampler, seed, x, y, index) -> None:
        self.sampler, self.seed, self.x, self.y, self.index = sampler, seed, x, y, index
        self.dimension, self.terms = impl.expr_init(0), impl.expr_init(0)
        self.pixel = impl.expr_init(sampler.pixel_number(x, y))
        RandomNumbers._begun_last = impl.get_runtime().compiling_callable, self

    @classmethod
    def of_this_kernel(cls) -> "RandomNumbers | None":
        """The numbers that were begun in the kernel that is being compiled now; None if there are none."""
        begun = cls._begun_last
        return begun[1] if begun is not None and begun[0] is impl.get_runtime().compiling_callable else None

    @ti.func
    def next_2d(self):
        """Two numbers in [0, 1)."""
        dimension = ti.u32(self.dimension)
        self.dimension += 1
        return self.sampler.get_2d(self.seed, self.pixel, self.index, dimension)

    @ti.func
    def next_2d_of_term(self):
        """Two numbers in [0, 1) for a term that is **added** to what later numbers decide, as the light's sample is.

        At a surface, the sample of the light and that of the BRDF are added, and never multiplied with each other. A
        sampler that ``shares_terms`` takes the pair from the dimension of the next ``next_2d``, so that both are
        distributed evenly together with the numbers before them. The pair is independent of the other one, but over
        many samples the two do not take all combinations. If you are not sure, use ``next_2d``.
        """
        dimension = ti.u32(self.dimension)
        if ti.static(self.sampler.shares_terms):
            self.terms += 1
            dimension |= ti.u32(self.terms) << TERM_BIT
        else:
            self.dimension += 1
        return self.sampler.get_2d(self.seed, self.pixel, self.index, dimension)

    @ti.func
    def next_1d(self):
        """One number in [0, 1)."""
        return self.next_2d().x


@compile_time
def given_or_drawn(xi):
    """``xi``; or two random numbers if it is None, because the handout's functions draw their numbers themselves.

    In a picture, these are the next two numbers of the sample. A kernel of your own has no sample: it gets the numbers
    of Taichi's own generator, which differ from run to run.
    """
    if xi is not None:
        return xi
    rng = RandomNumbers.of_this_kernel()
    return variable(tm.vec2(ti.random(float), ti.random(float))) if rng is None else rng.next_2d()
