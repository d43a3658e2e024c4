"""The field of four elements and Niederreiter's (0, 4)-sequence over it, by their definitions, in Python integers.

The elements 0, 1, ω, ω² = ω + 1 are written 0, 1, 2, 3: the bits of a number are the coefficients of 1 and of ω.
"""

import math

DIGITS = 16  # base-4 digits of a word of 32 bits


def times(a, b):
    """The product of two elements: that of polynomials in ω, with ω² = ω + 1."""
    product = (a & 1) * b ^ ((a >> 1) & 1) * (b << 1)
    return product ^ 0b111 if product & 0b100 else product


def power(a, exponent):
    """a to the power of ``exponent``; 0 to the power of 0 is 1."""
    result = 1
    for _ in range(exponent):
        result = times(result, a)
    return result


def niederreiter(index):
    """Four lists of the base-4 digits of the four numbers of an index, as elements, the most significant one first.

    The matrix of the number that belongs to the element α has the entries C(j, r) α^(j − r) (Faure 1982 for prime
    bases, Niederreiter 1987 for the powers of primes).
    """
    digits = [(index >> (2 * j)) & 3 for j in range(DIGITS)]
    numbers = []
    for alpha in range(4):
        number = []
        for r in range(DIGITS):
            total = 0
            for j in range(r, DIGITS):
                if math.comb(j, r) % 2:
                    total ^= times(power(alpha, j - r), digits[j])
            number.append(total)
        numbers.append(number)
    return numbers
