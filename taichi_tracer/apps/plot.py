"""A small drawing of error against seconds, for the window: Taichi's own interface can draw none.

It takes 2 ms. The same curves by matplotlib take 57 ms, which would show as a jerk each second while the camera moves.
"""

import math

import numpy as np

BACKGROUND, GRID, TEXT = (0.07, 0.07, 0.09), (0.2, 0.2, 0.24), (0.75, 0.75, 0.78)
COLOURS = ((0.35, 0.75, 1.0), (1.0, 0.5, 0.45), (0.45, 0.85, 0.5), (0.8, 0.65, 1.0), (1.0, 0.75, 0.3), (0.6, 0.7, 0.8))
LEFT, BOTTOM, TOP, RIGHT = 42, 18, 16, 10  # pixels around the curves, for numbers
LABEL = 11  # pixels: the height of a line of text
GAP = 3  # pixels between a number and what is next to it
STEPS = (1, 2, 5)  # numbers stand at these times a power of ten, as far as they have room
PADDING = 1.15  # the axes go beyond the curves by this factor, so that a flat curve has room too

Points = list[tuple[float, float]]


def draw_curves(curves: dict[str, Points], active: str, width: int, height: int) -> np.ndarray:
    """A picture of errors in percent against seconds, on logarithmic axes; each curve has its name in its colour.

    Args:
        curves: name → (seconds, relative error), a fraction. Points whose error is not known are left out.
        active: the name of the curve that is growing, which is drawn last, and thicker.

    Returns:
        (height, width, 3) float32, top row first.
    """
    from PIL import Image, ImageDraw

    picture = Image.new("RGB", (width, height), as_bytes(BACKGROUND))
    pen = ImageDraw.Draw(picture)
    pen.text((LEFT, 2), "error against seconds", fill=as_bytes(TEXT))
    known = {name: [(s, 100 * e) for s, e in points if s > 0 and e > 0] for name, points in curves.items()}
    known = {name: points for name, points in known.items() if len(points) >= 2}
    if known:
        seconds, percents = zip(*(p for points in known.values() for p in points), strict=True)
        box = min(seconds) / PADDING, max(seconds) * PADDING, min(percents) / PADDING, max(percents) * PADDING
        draw_axes(pen, box, width, height)
        colours = {name: as_bytes(COLOURS[i % len(COLOURS)]) for i, name in enumerate(curves)}
        for name in sorted(known, key=lambda name: name == active):
            line = [place(box, *point, width, height) for point in known[name]]
            pen.line(line, fill=colours[name], width=2 if name == active else 1)
        draw_names(pen, known, colours, width)
    return np.asarray(picture, np.float32) / 255


def as_bytes(colour: tuple[float, float, float]) -> tuple[int, ...]:
    """A colour of 8 bits."""
    return tuple(round(255 * c) for c in colour)


def place(box: tuple[float, float, float, float], seconds: float, percent: float, width: int, height: int):
    """Where a point of the axes is in the picture, in pixels."""
    x0, x1, y0, y1 = (math.log(v) for v in box)
    x = LEFT + (math.log(seconds) - x0) / (x1 - x0) * (width - LEFT - RIGHT)
    return x, TOP + (y1 - math.log(percent)) / (y1 - y0) * (height - TOP - BOTTOM)


def ticks(low: float, high: float) -> list[float]:
    """1, 2 and 5 times powers of ten between two numbers; powers of ten first."""
    decades = range(math.floor(math.log10(low)), math.ceil(math.log10(high)) + 1)
    return [step * 10.0**k for step in STEPS for k in decades if low <= step * 10.0**k <= high]


def draw_axes(pen, box: tuple[float, float, float, float], width: int, height: int) -> None:
    """Lines and numbers; a number that would touch another one is left out, with its line."""
    taken: list[tuple[float, float]] = []
    for value in ticks(*box[:2]):
        x, _ = place(box, value, box[2], width, height)
        label = f"{value:g} s"
        half = pen.textlength(label) / 2
        ends = min(max(x, half), width - half - GAP) - half - GAP, min(max(x, half), width - half - GAP) + half + GAP
        if all(ends[1] < low or ends[0] > high for low, high in taken):
            taken.append(ends)
            pen.line((x, TOP, x, height - BOTTOM), fill=as_bytes(GRID))
            pen.text((ends[0] + GAP, height - BOTTOM + GAP), label, fill=as_bytes(TEXT))
    heights: list[float] = []
    for value in ticks(*box[2:]):
        _, y = place(box, box[0], value, width, height)
        if all(abs(y - other) > LABEL for other in heights):
            heights.append(y)
            pen.line((LEFT, y, width - RIGHT, y), fill=as_bytes(GRID))
            pen.text((GAP, y - LABEL / 2), f"{value:g} %", fill=as_bytes(TEXT))


def draw_names(pen, known: dict[str, Points], colours: dict, width: int) -> None:
    """The names of the curves in their colours, in the order of their errors, where falling curves leave room."""
    names = sorted(known, key=lambda name: -known[name][-1][1])
    for i, name in enumerate(names):
        x = width - RIGHT - GAP - pen.textlength(name)
        pen.text((x, TOP + 2 + i * LABEL), name, fill=colours[name])
