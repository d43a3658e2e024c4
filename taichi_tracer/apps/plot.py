"""A small drawing of error against seconds, for the window: Taichi's own interface can draw none."""

import math

import numpy as np

BACKGROUND, GRID, LINE, TEXT = (0.07, 0.07, 0.09), (0.2, 0.2, 0.24), (0.35, 0.75, 1.0), (0.75, 0.75, 0.78)
LEFT, BOTTOM, TOP, RIGHT = 38, 18, 16, 10  # pixels around the curve, for numbers
DIGIT = 6  # pixels: half of a label's height, and of the width of a short one
GAP = 3  # pixels between a number and what is next to it


def decades(low: float, high: float) -> tuple[int, int]:
    """The exponents of the two powers of ten that enclose an interval."""
    first = math.floor(math.log10(low))
    return first, max(first + 1, math.ceil(math.log10(high)))


def draw_curve(points: list[tuple[float, float]], width: int, height: int) -> np.ndarray:
    """A picture of the error in percent against seconds, both on logarithmic axes.

    Args:
        points: (seconds, relative error), a fraction. Points whose error is not known are left out.

    Returns:
        (height, width, 3) float32, top row first.
    """
    from PIL import Image, ImageDraw

    colours = [tuple(round(255 * c) for c in colour) for colour in (BACKGROUND, GRID, LINE, TEXT)]
    background, grid, line, text = colours
    picture = Image.new("RGB", (width, height), background)
    pen = ImageDraw.Draw(picture)
    pen.text((LEFT, 2), "error in % against seconds", fill=text)
    known = [(s, 100 * e) for s, e in points if s > 0 and e > 0]
    if len(known) >= 2:
        (x0, x1), (y0, y1) = (decades(min(values), max(values)) for values in zip(*known, strict=True))

        def place(seconds: float, percent: float) -> tuple[float, float]:
            x = LEFT + (math.log10(seconds) - x0) / (x1 - x0) * (width - LEFT - RIGHT)
            return x, TOP + (y1 - math.log10(percent)) / (y1 - y0) * (height - TOP - BOTTOM)

        for k in range(x0, x1 + 1):
            x, _ = place(10.0**k, 10.0**y0)
            pen.line((x, TOP, x, height - BOTTOM), fill=grid)
            label = f"{10.0**k:g}"
            farthest = width - pen.textlength(label) - GAP
            pen.text((min(x - DIGIT, farthest), height - BOTTOM + GAP), label, fill=text)
        for k in range(y0, y1 + 1):
            _, y = place(10.0**x0, 10.0**k)
            pen.line((LEFT, y, width - RIGHT, y), fill=grid)
            pen.text((GAP, y - DIGIT), f"{10.0**k:g}", fill=text)
        pen.line([place(*p) for p in known], fill=line, width=2)
    return np.asarray(picture, np.float32) / 255
