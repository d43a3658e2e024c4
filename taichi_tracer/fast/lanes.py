"""Small functions that a CPU computes for all lanes of a vector with one instruction each.

Taichi has no vector instructions: it writes a vector as single numbers, and LLVM puts them together again, if each lane
does exactly the same. These functions are written so that LLVM recognises them.
"""

import taichi as ti


@ti.func
def larger(a, b):
    """max, written so that the compiler uses vector instructions."""
    return ti.select(a > b, a, b)


@ti.func
def smaller(a, b):
    """min, written so that the compiler uses vector instructions."""
    return ti.select(a < b, a, b)


@ti.func
def lanes_of(is_met):
    """A mask with bit k + 1 for each lane k in which a condition holds.

    Bit 0 stays free. Otherwise LLVM writes the first lane in another way than the others, and then uses no vector
    instructions for any of them.
    """
    bits = ti.select(is_met, ti.Vector([2 << k for k in range(is_met.n)]), ti.Vector([0] * is_met.n))
    mask = bits[0]
    for k in ti.static(range(1, is_met.n)):
        mask |= bits[k]
    return mask


@ti.func
def first_lane(mask):
    """The first lane of a mask of ``lanes_of``. The compiler turns this into one instruction."""
    return ti.math.popcnt(~mask & (mask - 1)) - 1
