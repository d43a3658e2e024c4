"""Hashes and bit operations against their definitions, in Python integers."""

import numpy as np
import pytest
import taichi as ti
from oracles import numbers

from taichi_tracer.formulas import hashes
from taichi_tracer.system import runtime

MASK = 0xFFFFFFFF


@ti.kernel
def _words(function: ti.template(), out: ti.types.ndarray(ndim=2)):
    for i in range(out.shape[0]):
        word = ti.cast(out[i, 0], ti.u32)
        out[i, 1] = ti.cast(function(word), ti.i64)


def apply(function, words):
    out = np.stack([words, words], axis=1).astype(np.int64)
    _words(function, out)
    return out[:, 1].tolist()


@ti.kernel
def _pcg4d(keys: ti.types.ndarray(ndim=2)):
    for i in range(keys.shape[0]):
        key = ti.Vector([ti.cast(keys[i, k], ti.u32) for k in range(4)])
        a, b, c, d = hashes.pcg4d(key[0], key[1], key[2], key[3])
        keys[i, 0], keys[i, 1] = ti.cast(a, ti.i64), ti.cast(b, ti.i64)
        keys[i, 2], keys[i, 3] = ti.cast(c, ti.i64), ti.cast(d, ti.i64)


@ti.kernel
def _scramble(rows: ti.types.ndarray(ndim=2)):
    for i in range(rows.shape[0]):
        word = hashes.scramble_reversed(ti.cast(rows[i, 0], ti.u32), ti.cast(rows[i, 1], ti.u32))
        rows[i, 2] = ti.cast(word, ti.i64)


def test_the_hash_is_that_of_the_paper(f32, rng):
    keys = np.concatenate([[[0, 0, 0, 0], [1, 2, 3, 4], [MASK, 77, 2**31, 5]], rng.integers(0, 2**32, (500, 4))])
    found = keys.copy()
    _pcg4d(found)
    assert found.tolist() == [numbers.pcg4d(*key) for key in keys.tolist()]


def test_the_hash_mixes_the_bits_that_pictures_use(f32, rng):
    """Bits 0 to 17 of the key change each of the upper 24 bits of the hash in half of the cases.

    Those are the bits of pixels and samples, and those of numbers in f32. |z| < 5 for 2,304 pairs, p = 6e-7 each.
    """
    count = 400
    keys = rng.integers(0, 2**32, (count, 4))
    plain = keys.copy()
    _pcg4d(plain)
    for word in range(4):
        for bit in range(0, 18, 3):
            other = keys.copy()
            other[:, word] ^= 1 << bit
            _pcg4d(other)
            changed = ((plain ^ other)[:, :, None] >> np.arange(8, 32)) & 1
            assert np.abs(changed.mean(axis=0) - 0.5).max() < 5 * 0.5 / np.sqrt(count)


def test_bits_are_reversed(f32, rng):
    words = np.concatenate([np.arange(64), rng.integers(0, 2**32, 500), [MASK]])
    assert apply(hashes.reverse_bits, words) == [numbers.sobol(word)[0] for word in words.tolist()]


def test_the_second_matrix_is_that_of_sobol(f32, rng):
    words = np.concatenate([np.arange(64), rng.integers(0, 2**32, 500)])
    reversed_ = [int(f"{word:032b}"[::-1], 2) for word in apply(hashes.pascal_matrix, words)]
    assert reversed_ == [numbers.sobol(word)[1] for word in words.tolist()]


def test_scrambling_is_nested(f32, rng):
    """Of reversed words, the lowest k bits of the result depend on the lowest k bits of the word, one to one."""
    count = 200
    words, seeds = rng.integers(0, 2**32, (2, count))
    rows = np.stack([words, seeds, np.zeros(count, np.int64)], axis=1)
    _scramble(rows)
    for bits in range(1, 32):
        low = (1 << bits) - 1
        same_low = rows.copy()
        same_low[:, 0] = (words & low) | (rng.integers(0, 2**32, count) & (MASK ^ low))
        _scramble(same_low)
        assert ((same_low[:, 2] ^ rows[:, 2]) & low == 0).all()
        flipped = rows.copy()
        flipped[:, 0] ^= 1 << (bits - 1)
        _scramble(flipped)
        assert ((flipped[:, 2] ^ rows[:, 2]) & low == 1 << (bits - 1)).all()


@ti.kernel
def _fractions(words: ti.types.ndarray(ndim=1), out: ti.types.ndarray(ndim=1)):
    for i in range(words.shape[0]):
        out[i] = hashes.as_fraction(ti.cast(words[i], ti.u32))


def test_a_word_is_a_fraction_below_one(precision, rng):
    """The upper 24 bits in f32 and all 32 in f64, exactly; the largest word is not 1."""
    words = np.concatenate([[0, 1, 255, 256, MASK], rng.integers(0, 2**32, 500)])
    out = np.zeros(len(words), runtime.dtype())
    _fractions(words, out)
    expected = (words >> 8) / 2**24 if precision == "f32" else words / 2**32
    np.testing.assert_array_equal(out, expected)
    assert out[4] == (1 - 2.0**-24 if precision == "f32" else 1 - 2.0**-32)


@pytest.mark.parametrize("function", [hashes.reverse_bits, hashes.pascal_matrix, hashes.as_fraction])
def test_vectors_of_words_have_the_bits_of_single_words(f32, rng, function):
    words = rng.integers(0, 2**32, (50, 4))

    @ti.kernel
    def both(rows: ti.types.ndarray(ndim=2), out: ti.types.ndarray(ndim=3)):
        for i in range(rows.shape[0]):
            vector = function(ti.Vector([ti.cast(rows[i, k], ti.u32) for k in range(4)]))
            for k in ti.static(range(4)):
                out[0, i, k] = ti.cast(vector[k], ti.f64)
                out[1, i, k] = ti.cast(function(ti.cast(rows[i, k], ti.u32)), ti.f64)

    out = np.zeros((2, 50, 4))
    both(words, out)
    np.testing.assert_array_equal(out[0], out[1])
