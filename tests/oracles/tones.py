"""Tone curves in float64, term by term as their sources print them."""

import numpy as np


def uncharted2(x):
    """John Hable's curve of 2010, with the exposure bias of 2 and the linear white point 11.2 of his listing."""
    shoulder, linear, angle, toe, numerator, denominator = 0.15, 0.50, 0.10, 0.20, 0.02, 0.30

    def partial(v):
        above = v * (shoulder * v + angle * linear) + toe * numerator
        below = v * (shoulder * v + linear) + toe * denominator
        return above / below - numerator / denominator

    return partial(2.0 * np.asarray(x, np.float64)) / partial(11.2)


def srgb(linear):
    """IEC 61966-2-1, value by value."""
    return np.array([12.92 * v if v <= 0.0031308 else 1.055 * v ** (1 / 2.4) - 0.055 for v in np.ravel(linear)])
