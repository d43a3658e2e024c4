"""Jittered strata: of every 16 samples of a pixel, one lies in each square of a grid of 4 × 4, anywhere in it."""

import taichi as ti
import taichi.math as tm

import taichi_tracer as tt

SIDE = 4
STRATA = SIDE * SIDE


@tt.register
class Stratified(tt.Sampler):
    """The error falls faster than that of independent numbers where light is smooth over the squares.

    In each dimension the squares come in an order of their own, so that the dimensions have nothing to do with each
    other: each square has a random word, and the k-th sample takes the square whose word is the k-th smallest.
    """

    name = "stratified"

    @ti.func
    def get_2d(self, seed, pixel, index, dimension):
        """vec2 in [0, 1)² of four u32."""
        key = mixed(seed ^ mixed(pixel ^ mixed(dimension ^ mixed(index // STRATA))))
        place = index % STRATA
        own, square = mixed(key ^ place), 0
        for other in range(STRATA):
            if mixed(key ^ ti.u32(other)) < own:
                square += 1
        jitter = tm.vec2(fraction(mixed(key ^ (place + 100))), fraction(mixed(key ^ (place + 200))))
        return (tm.vec2(square % SIDE, square // SIDE) + jitter) / SIDE


@ti.func
def mixed(word):
    """A word whose bits all depend on all bits of the given one (C. Wellons, "Prospecting for hash functions")."""
    word = (ti.u32(word) ^ (ti.u32(word) >> 16)) * ti.u32(0x7FEB352D)
    word = (word ^ (word >> 15)) * ti.u32(0x846CA68B)
    return word ^ (word >> 16)


@ti.func
def fraction(word):
    """A number in [0, 1) from the upper 24 bits of a word: f32 holds no more, and would round to 1."""
    return ti.cast(word >> 8, float) / (1 << 24)
