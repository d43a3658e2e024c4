"""A hash of 32-bit words, and the bit operations of Sobol' points. All work on numbers and on vectors of numbers.

Sums and products are modulo 2^32, as those of unsigned words are.
"""

import taichi as ti

from taichi_tracer.system import runtime
from taichi_tracer.system.seams import in_kernels


@ti.func
def pcg4d(a, b, c, d):
    """Four well-mixed words of four words (Jarzynski & Olano, "Hash functions for GPU rendering", JCGT 9(3), 2020)."""
    a, b, c, d = _advance(a), _advance(b), _advance(c), _advance(d)
    a, b, c, d = _mix(a, b, c, d)
    a, b, c, d = a ^ (a >> 16), b ^ (b >> 16), c ^ (c >> 16), d ^ (d >> 16)
    return _mix(a, b, c, d)


@ti.func
def _advance(word):
    return plus(times(word, ti.u32(1664525)), ti.u32(1013904223))


@ti.func
def _mix(a, b, c, d):
    a1 = plus(a, times(b, d))
    b1 = plus(b, times(c, a1))
    c1 = plus(c, times(a1, b1))
    d1 = plus(d, times(b1, c1))
    return a1, b1, c1, d1


@in_kernels
def plus(a, b):
    """a + b modulo 2^32. Debug mode reports every overflow, and therefore gets a sum of 64 bits."""
    if runtime.checks_overflow():
        return ti.cast(ti.cast(a, ti.u64) + ti.cast(b, ti.u64), ti.u32)
    return a + b


@in_kernels
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


@ti.func
def reverse_bits(word):
    """The 32 bits in reverse order."""
    word = (word >> 16) | ((word & ti.u32(0x0000FFFF)) << 16)
    word = ((word & ti.u32(0xFF00FF00)) >> 8) | ((word & ti.u32(0x00FF00FF)) << 8)
    word = ((word & ti.u32(0xF0F0F0F0)) >> 4) | ((word & ti.u32(0x0F0F0F0F)) << 4)
    word = ((word & ti.u32(0xCCCCCCCC)) >> 2) | ((word & ti.u32(0x33333333)) << 2)
    return ((word & ti.u32(0xAAAAAAAA)) >> 1) | ((word & ti.u32(0x55555555)) << 1)


@ti.func
def scramble_reversed(word, seed):
    """Owen's nested scrambling of a number whose bits are reversed: a hash of the lower bits decides on each flip.

    This is the hash of Laine & Karras with the constants of Vegdahl, as in Burley, "Practical hash-based Owen
    scrambling", JCGT 9(4), 2020, section 3.2.
    """
    word = word ^ times(word, ti.u32(0x3D20ADEA))
    word = plus(word, seed)
    word = times(word, (seed >> 16) | ti.u32(1))
    word = word ^ times(word, ti.u32(0x05526C56))
    return word ^ times(word, ti.u32(0x53A22864))


@ti.func
def pascal_matrix(word):
    """The second generator matrix of Sobol', C(j, i) mod 2, times the bits of ``word``; the result is bit-reversed."""
    return add_upper_bits(pascal_matrix_of_digits(word))


@ti.func
def pascal_matrix_of_digits(word):
    """The matrix C(j, i) mod 2, times the 16 digits of ``word`` in base 4, which are pairs of bits."""
    word = word ^ ((word >> 16) & ti.u32(0x0000FFFF))
    word = word ^ ((word >> 8) & ti.u32(0x00FF00FF))
    word = word ^ ((word >> 4) & ti.u32(0x0F0F0F0F))
    return word ^ ((word >> 2) & ti.u32(0x33333333))


@ti.func
def add_upper_bits(word):
    """In each pair of bits, "exclusive or" of the upper bit to the lower one."""
    return word ^ ((word >> 1) & ti.u32(0x55555555))
