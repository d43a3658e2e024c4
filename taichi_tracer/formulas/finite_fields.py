"""Four numbers per index that are evenly distributed together: Niederreiter's (0, 4)-sequence in base 4.

Any 4^m consecutive indices that begin at a multiple of 4^m give a (0, m, 4)-net: every box of volume 4^−m whose sides
are powers of 1/4 contains exactly one of the points (Faure 1982 for prime bases; Niederreiter, "Point sets and
sequences with small discrepancy", 1987, for powers of primes). In base 2, such a sequence exists for two numbers only.

**Digits.** A word has 16 digits in base 4 of two bits each. A digit is an element of the field GF(4) = {0, 1, ω, ω²},
with ω² = ω + 1: the lower bit of a digit is the coefficient of 1, the upper bit that of ω. Elements are added by
"exclusive or".

**Matrices.** The number that belongs to the element α has the matrix C(c, r) α^(c − r), which is multiplied by the
digits of the index. α = 0 is the identity. C(c, r) mod 2 is 1 if the binary digits of r are among those of c (Lucas).
Therefore each of the others is a product of four matrices, for the distances 8, 4, 2 and 1 of digits: a digit gets the
one at this distance, times α to the power of the distance. For α = 1 and α = ω², one more bit operation within each
digit changes the order of the four digits. It makes each of the two pairs a (0, 2)-sequence in base 2 as well, as
Sobol' points are (Ahmed, Skopenkov, Hadwiger & Wonka, "Analysis and synthesis of digital dyadic sequences", SIGGRAPH
Asia 2023, study such sequences).

All functions work on numbers and on vectors of numbers. Results are bit-reversed: digit 0 is the most significant one.
"""

from taichi_tracer.formulas.hashes import HALVES, pascal_matrix
from taichi_tracer.system.compile_time import compile_time, variable

*DIGIT_HALVES, (ONE_BIT, LOWER_BITS) = HALVES  # groups of whole digits; the lower bit of each digit


@compile_time
def first_pair(word):
    """The numbers of α = 0 and α = 1, which are the first two Sobol' numbers."""
    return word, pascal_matrix(word)


@compile_time
def second_pair(word):
    """The numbers of α = ω and α = ω²."""
    x = y = variable(word)
    for bits, lower in DIGIT_HALVES:  # the digits that are "bits / 2" digits apart; c − r is a sum of such distances
        x = variable(x ^ times_power((x >> bits) & lower, bits // 2))
        y = variable(y ^ times_power((y >> bits) & lower, bits))
    return x, variable(y ^ ((y >> ONE_BIT) & LOWER_BITS))


@compile_time
def times_power(word, exponent):
    """Every digit times ω^exponent."""
    upper, lower = variable((word >> 1) & LOWER_BITS), variable(word & LOWER_BITS)
    if exponent % 3 == 1:  # (H ω + L) ω = (H + L) ω + H
        return ((upper ^ lower) << 1) | upper
    if exponent % 3 == 2:  # (H ω + L) ω² = L ω + (H + L)
        return (lower << 1) | (upper ^ lower)
    return word
