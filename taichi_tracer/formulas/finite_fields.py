"""Four numbers per index that are evenly distributed together: Niederreiter's (0, 4)-sequence in base 4.

Any 4^m consecutive indices that begin at a multiple of 4^m give a (0, m, 4)-net: every box of volume 4^−m whose sides
are powers of 1/4 contains exactly one of the points (Faure 1982 for prime bases; Niederreiter, "Point sets and
sequences with small discrepancy", 1987, for powers of primes). In base 2, such a sequence exists for two numbers only.

**Digits.** A word has 16 digits in base 4 of two bits each. A digit is an element of the field GF(4) = {0, 1, ω, ω²},
with ω² = ω + 1: the lower bit of a digit is the coefficient of 1, the upper bit that of ω. Elements are added by
"exclusive or".

**Matrices.** The number that belongs to the element α has the matrix C(c, r) α^(c − r), which is multiplied by the
digits of the index. α = 0 is the identity; α = 1 is Pascal's matrix P; α = ω is D⁻¹ P D, and α = ω² is D P D⁻¹, where D
multiplies digit j by ω^j. For α = 1 and α = ω², one more bit operation within each digit changes the order of the four
digits. It makes each of the two pairs a (0, 2)-sequence in base 2 as well, as Sobol' points are (Ahmed, Skopenkov,
Hadwiger & Wonka, "Analysis and synthesis of digital dyadic sequences", SIGGRAPH Asia 2023, study such sequences).

All functions work on numbers and on vectors of numbers. Results are bit-reversed: digit 0 is the most significant one.
"""

import taichi as ti

from taichi_tracer.formulas.hashes import add_upper_bits, pascal_matrix, pascal_matrix_of_digits

LOWER_BITS = 0x55555555  # of each digit
DIGITS_0, DIGITS_1, DIGITS_2 = 0xC30C30C3, 0x0C30C30C, 0x30C30C30  # digits j with j mod 3 = 0, 1 and 2


@ti.func
def first_pair(word):
    """The numbers of α = 0 and α = 1, which are the first two Sobol' numbers."""
    return word, pascal_matrix(word)


@ti.func
def second_pair(word):
    """The numbers of α = ω and α = ω²."""
    x = divide_by_powers(pascal_matrix_of_digits(multiply_by_powers(word)))
    y = multiply_by_powers(pascal_matrix_of_digits(divide_by_powers(word)))
    return x, add_upper_bits(y)


@ti.func
def times_omega(word):
    """Every digit times ω: (H ω + L) ω = (H + L) ω + H."""
    upper = (word >> 1) & ti.u32(LOWER_BITS)
    return (((word & ti.u32(LOWER_BITS)) ^ upper) << 1) | upper


@ti.func
def over_omega(word):
    """Every digit times ω² = 1/ω: (H ω + L) ω² = L ω + (H + L)."""
    lower = word & ti.u32(LOWER_BITS)
    return (lower << 1) | (((word >> 1) & ti.u32(LOWER_BITS)) ^ lower)


@ti.func
def multiply_by_powers(word):
    """D: digit j times ω^j; ω³ is 1."""
    once, twice = times_omega(word & ti.u32(DIGITS_1)), over_omega(word & ti.u32(DIGITS_2))
    return (word & ti.u32(DIGITS_0)) | once | twice


@ti.func
def divide_by_powers(word):
    """D⁻¹: digit j over ω^j."""
    once, twice = over_omega(word & ti.u32(DIGITS_1)), times_omega(word & ti.u32(DIGITS_2))
    return (word & ti.u32(DIGITS_0)) | once | twice
