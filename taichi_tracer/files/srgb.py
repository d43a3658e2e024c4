"""Bytes of a picture: the sRGB transfer function, and 255 steps (C-14)."""

import numpy as np

from taichi_tracer.tones.display import Display

PLAIN = Display()


def to_bytes(image: np.ndarray, srgb: bool = False, display: Display = PLAIN) -> np.ndarray:
    """(h, w, 3) uint8: values are clipped to [0, 1] and rounded to the nearest of 255 steps; NaN becomes 0.

    Args:
        image: (h, w, 3) float, linear.
        srgb: whether to apply the sRGB transfer function first. It is meant for radiance; data such as normals is
            written unchanged (C-14).
        display: exposure and tone curve, which come first.
    """
    values = display.shown(image)
    if srgb:
        values = srgb_from_linear(values)
    return np.floor(values * 255 + 0.5).astype(np.uint8)


def srgb_from_linear(values: np.ndarray) -> np.ndarray:
    """The sRGB transfer function (IEC 61966-2-1) of values in [0, 1]."""
    return np.where(values <= 0.0031308, 12.92 * values, 1.055 * np.maximum(values, 0.0031308) ** (1 / 2.4) - 0.055)


def linear_from_srgb(values: np.ndarray) -> np.ndarray:
    """The inverse of ``srgb_from_linear``."""
    return np.where(values <= 0.04045, values / 12.92, ((np.maximum(values, 0.04045) + 0.055) / 1.055) ** 2.4)
