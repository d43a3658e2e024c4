"""Bilinear look-ups in float64, one point at a time."""

import math


def wrapped(i, count, wrap):
    """The number of the texel that stands in for the i-th one."""
    if wrap == "repeat":
        return i % count
    if wrap == "clamp":
        return min(max(i, 0), count - 1)
    i %= 2 * count
    return i if i < count else 2 * count - 1 - i


def bilinear(pixels, uv, wrap):
    """The colour at (u, v), whose origin is at the bottom left of an (h, w, 3) picture."""
    height, width = pixels.shape[:2]
    x, y = uv[0] * width - 0.5, (1 - uv[1]) * height - 0.5
    i, j = math.floor(x), math.floor(y)
    total = 0.0
    for di in (0, 1):
        for dj in (0, 1):
            weight = (1 - abs(x - i - di)) * (1 - abs(y - j - dj))
            # Rows count from the top, v from the bottom; mirrors and repetitions are the same from both sides.
            total = total + weight * pixels[wrapped(j + dj, height, wrap[1]), wrapped(i + di, width, wrap[0])]
    return total
