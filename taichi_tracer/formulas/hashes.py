"""A hash of 32-bit words, and the bit operations of Sobol' points. All work on numbers and on vectors of numbers.

Sums and products are modulo 2^32, as those of unsigned words are.
"""

import taichi as ti

from taichi_tracer.system import runtime
from taichi_tracer.system.compile_time import compile_time, variable

# How many bits, and a mask: of every two groups of so many neighbouring bits, the group of the lower ones.
HALVES = ((16, 0x0000FFFF), (8, 0x00FF00FF), (4, 0x0F0F0F0F), (2, 0x33333333), (1, 0x55555555))


@compile_time
def pcg4d(a, b, c, d):
    """Four well-mixed words of four words (Jarzynski & Olano, "Hash functions for GPU rendering", JCGT 9(3), 2020)."""
    a, b, c, d = _mix(*(variable(plus(times(word, 1664525), 1013904223)) for word in (a, b, c, d)))
    return _mix(*(variable(word ^ (word >> 16)) for word in (a, b, c, d)))


@compile_time
def _mix(a, b, c, d):
    a = variable(plus(a, times(b, d)))
    b = variable(plus(b, times(c, a)))
    c = variable(plus(c, times(a, b)))
    return a, b, c, variable(plus(d, times(b, c)))


@compile_time
def plus(a, b):
    """a + b modulo 2^32. Debug mode reports every overflow, and therefore gets a sum of 64 bits."""
    if runtime.checks_overflow():
        return ti.cast(ti.cast(a, ti.u64) + ti.cast(b, ti.u64), ti.u32)
    return a + b


@compile_time
def times(a, b):
    """a b modulo 2^32, as ``plus``."""
    if runtime.checks_overflow():
        return ti.cast(ti.cast(a, ti.u64) * ti.cast(b, ti.u64), ti.u32)
    return a * b


@ti.func
def as_fraction(word):
    """A number in [0, 1), never 1, made of a word: of its upper 24 bits in f32, of all 32 bits in f64."""
    if ti.static(runtime.current().precision == "f64"):
        return ti.cast(word, ti.f64) * (1.0 / (1 << 16)) * (1.0 / (1 << 16))
    else:  # noqa: RET505 (without it, both would be compiled)
        return ti.cast(ti.cast(word >> 8, ti.i32), ti.f32) * (1.0 / (1 << 24))


@compile_time
def reverse_bits(word):
    """The 32 bits in reverse order."""
    for bits, lower in HALVES:
        word = variable(((word >> bits) & lower) | ((word & lower) << bits))
    return word


@compile_time
def scramble_reversed(word, seed):
    """Owen's nested scrambling of a number whose bits are reversed: a hash of the lower bits decides on each flip.

    This is the hash of Laine & Karras with the constants of Vegdahl, as in Burley, "Practical hash-based Owen
    scrambling", JCGT 9(4), 2020, section 3.2.
    """
    word = variable(word)
    word = plus(word ^ times(word, 0x3D20ADEA), seed)
    word = variable(times(word, (seed >> 16) | 1))
    word = variable(word ^ times(word, 0x05526C56))
    return variable(word ^ times(word, 0x53A22864))


@compile_time
def pascal_matrix(word):
    """The second generator matrix of Sobol', C(j, i) mod 2, times the bits of ``word``; the result is bit-reversed."""
    for bits, lower in HALVES:
        word = variable(word ^ ((word >> bits) & lower))
    return word
