"""The part of a frame that is rendered: from fractions of the frame to pixels."""

import math
from collections.abc import Sequence

from taichi_tracer.system.errors import InputError


def crop_pixels(window: Sequence[float], width: int, height: int) -> tuple[int, int, int, int]:
    """(x0, x1, y0, y1) in pixels, from a crop window in fractions; an InputError if it contains no pixel."""
    x0, x1, y0, y1 = (float(edge) for edge in window)
    if not (0 <= x0 < x1 <= 1 and 0 <= y0 < y1 <= 1):
        edges = " ".join(f"{edge:g}" for edge in (x0, x1, y0, y1))
        raise InputError(f"a crop window is x0 x1 y0 y1 with 0 <= x0 < x1 <= 1 and the same for y, not {edges}")
    pixels = math.ceil(x0 * width), math.ceil(x1 * width), math.ceil(y0 * height), math.ceil(y1 * height)
    if pixels[0] == pixels[1] or pixels[2] == pixels[3]:
        raise InputError(f"the crop window {x0:g} {x1:g} {y0:g} {y1:g} holds no pixel of {width}x{height}")
    return pixels
