"""The field of four elements and the (0, 4)-sequence over it, against their definitions in Python integers."""

import itertools

import numpy as np
import pytest
import taichi as ti
from oracles import finite_fields as oracle

from taichi_tracer.formulas import finite_fields, hashes

OMEGA = 2
BITS = 10  # the points that are counted in boxes are 2^BITS


@ti.kernel
def _numbers(rows: ti.types.ndarray(ndim=2)):
    for i in range(rows.shape[0]):
        word = ti.cast(rows[i, 0], ti.u32)
        a, b = finite_fields.first_pair(word)
        c, d = finite_fields.second_pair(word)
        rows[i, 1], rows[i, 2] = ti.cast(hashes.reverse_bits(a), ti.i64), ti.cast(hashes.reverse_bits(b), ti.i64)
        rows[i, 3], rows[i, 4] = ti.cast(hashes.reverse_bits(c), ti.i64), ti.cast(hashes.reverse_bits(d), ti.i64)


@ti.kernel
def _products(rows: ti.types.ndarray(ndim=2)):
    for i in range(rows.shape[0]):
        word = ti.cast(rows[i, 0], ti.u32)
        for exponent in ti.static(range(4)):
            rows[i, 1 + exponent] = ti.cast(finite_fields.times_power(word, exponent), ti.i64)


def apply(kernel, words):
    rows = np.zeros((len(words), 5), np.int64)
    rows[:, 0] = words
    kernel(rows)
    return rows[:, 1:]


def digits(words):
    """(N, 16) of words, digit 0 first, which is the least significant one."""
    return (np.asarray(words)[:, None] >> 2 * np.arange(oracle.DIGITS)) & 3


def test_digits_are_multiplied_as_elements_of_the_field(f32, rng):
    words = rng.integers(0, 2**32, 200)
    found = apply(_products, words)
    for row, word in zip(found, digits(words).tolist(), strict=True):
        powers = [oracle.power(OMEGA, exponent) for exponent in range(4)]
        assert digits(row).tolist() == [[oracle.times(power, digit) for digit in word] for power in powers]


def test_the_field_of_the_oracle_is_a_field():
    """Distributive, every element but 0 has an inverse, and ω² = ω + 1."""
    for a, b, c in itertools.product(range(4), repeat=3):
        assert oracle.times(a, b ^ c) == oracle.times(a, b) ^ oracle.times(a, c)
        assert oracle.times(a, oracle.times(b, c)) == oracle.times(oracle.times(a, b), c)
    assert all(sorted(oracle.times(a, b) for b in range(4)) == [0, 1, 2, 3] for a in (1, 2, 3))
    assert oracle.times(2, 2) == 3


def test_the_numbers_are_those_of_the_sequence(f32, rng):
    """α = 1 and α = ω² have the order of their digits changed: the upper bit of a digit is added to the lower one."""
    words = np.concatenate([np.arange(64), rng.integers(0, 2**32, 100)])
    found = apply(_numbers, words)
    for row, word in zip(found.tolist(), words.tolist(), strict=True):
        for alpha, elements in enumerate(oracle.niederreiter(word)):
            if alpha in (1, 3):
                elements = [e ^ (e >> 1) for e in elements]
            bits = "".join(f"{e & 1}{e >> 1}" for e in elements)  # a digit's lower bit is the more significant one
            assert row[alpha] == int(bits, 2)


def boxes_hold_one_each(numbers, depths, count):
    """Whether each box has one point: number k is divided into 2^depths[k] intervals."""
    key = np.zeros(count, np.int64)
    for column, depth in zip(numbers.T, depths, strict=True):
        key = (key << depth) | (column[:count] >> (32 - depth) if depth else 0)
    return len(np.unique(key)) == count


@pytest.mark.parametrize("begin", [0, 3 << BITS])
def test_four_numbers_are_nets_in_base_4_and_pairs_are_nets_in_base_2(f32, begin):
    found = apply(_numbers, begin + np.arange(1 << BITS))
    for m in range(1, BITS // 2 + 1):
        for depths in itertools.product(range(m + 1), repeat=4):
            if sum(depths) == m:
                assert boxes_hold_one_each(found, [2 * d for d in depths], 4**m), (m, depths)
    for pair in ((0, 1), (2, 3)):
        for m in range(1, BITS + 1):
            for k in range(m + 1):
                assert boxes_hold_one_each(found[:, list(pair)], (k, m - k), 1 << m), (pair, m, k)


def test_vectors_of_words_have_the_bits_of_single_words(f32, rng):
    words = rng.integers(0, 2**32, (20, 4))

    @ti.kernel
    def both(rows: ti.types.ndarray(ndim=2), out: ti.types.ndarray(ndim=3)):
        for i in range(rows.shape[0]):
            a, b = finite_fields.second_pair(ti.Vector([ti.cast(rows[i, k], ti.u32) for k in range(4)]))
            for k in ti.static(range(4)):
                c, d = finite_fields.second_pair(ti.cast(rows[i, k], ti.u32))
                out[0, i, k], out[1, i, k] = ti.cast(a[k], ti.f64), ti.cast(b[k], ti.f64)
                out[2, i, k], out[3, i, k] = ti.cast(c, ti.f64), ti.cast(d, ti.f64)

    out = np.zeros((4, 20, 4))
    both(words, out)
    np.testing.assert_array_equal(out[:2], out[2:])
