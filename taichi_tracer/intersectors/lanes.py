"""Vectors of lanes, with which a CPU works on several things at once.

Taichi has no vector instructions: it writes a vector as single numbers, and LLVM puts them together again, if each lane
does exactly the same. The small functions here are written so that LLVM recognises them.
"""

import functools
import operator

import taichi as ti

from taichi_tracer.system.compile_time import compile_time, element, variable


class LaneComponents:
    """A vector whose components are vectors of lanes, or numbers that all lanes share.

    A formula of ``formulas`` takes it in place of a ``vec3``, and then computes all lanes at once.
    """

    _data_oriented = True  # allows kernels to keep it in a variable and to pass it to functions

    def __init__(self, *components) -> None:
        self.components = [variable(component) for component in components]

    def __sub__(self, other):
        return LaneComponents(*map(operator.sub, self.components, other.components))

    def __mul__(self, other):
        return LaneComponents(*map(operator.mul, self.components, other.components))


@compile_time
def components(x, y, z):
    """``LaneComponents`` in a kernel."""
    return LaneComponents(x, y, z)


@compile_time
def shared(v):
    """``LaneComponents`` that all lanes share: those of a ``vec3``."""
    return LaneComponents(*(element(v, k) for k in range(3)))


@compile_time
def larger(a, b):
    """max, written so that the compiler uses vector instructions."""
    a, b = variable(a), variable(b)
    return ti.select(a > b, a, b)


@compile_time
def smaller(a, b):
    """min, written so that the compiler uses vector instructions."""
    a, b = variable(a), variable(b)
    return ti.select(a < b, a, b)


@compile_time
def lanes_of(is_met):
    """A mask with bit k + 1 for each lane k in which a condition holds.

    Bit 0 stays free. Otherwise LLVM writes the first lane in another way than the others, and then uses no vector
    instructions for any of them.
    """
    lanes = range(is_met.n)
    bits = variable(ti.select(is_met, ti.Vector([2 << k for k in lanes]), ti.Vector([0 for _ in lanes])))
    return variable(functools.reduce(operator.or_, [element(bits, k) for k in lanes]))


@ti.func
def first_lane(mask):
    """The first lane of a mask of ``lanes_of``. The compiler turns this into one instruction."""
    return ti.math.popcnt(~mask & (mask - 1)) - 1
