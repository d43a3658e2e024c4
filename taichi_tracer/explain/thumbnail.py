"""The picture, small, with a ring around the pixel that is explained."""

import base64
import html

import numpy as np

from taichi_tracer.files.images import encode_png
from taichi_tracer.tones.display import Display

SIDE = 160  # at most this wide and high, in pixels
RING = 7  # its radius, in pixels
STRETCHED = "preserveAspectRatio='none' style='image-rendering:pixelated'"
RINGS = ("stroke='#000' stroke-width='4'", "stroke='#fff' stroke-width='1.6'")  # seen on bright and on dark ground


def thumbnail(image: np.ndarray, column: int, row: int, display: Display, srgb: bool) -> str:
    """SVG with the picture as PNG data.

    Args:
        image: (height, width, 3) linear. column, row: the pixel, from the left and from the top.
        display, srgb: how the picture is shown, see ``srgb.to_bytes``.
    """
    small = shrunk(image)
    scale = SIDE / max(image.shape[:2])
    height, width = (round(scale * n, 1) for n in image.shape[:2])
    data = base64.b64encode(encode_png(small, srgb, display)).decode()
    picture = f"<image href='data:image/png;base64,{data}' width='{width}' height='{height}' {STRETCHED}/>"
    x, y = scale * (column + 0.5), scale * (row + 0.5)
    rings = "".join(f"<circle cx='{x:.1f}' cy='{y:.1f}' r='{RING}' fill='none' {look}/>" for look in RINGS)
    title = html.escape(f"the picture so far: the ring is around column {column}, row {row}")
    head = f"<svg viewBox='0 0 {width} {height}' width='{width}' height='{height}' role='img' aria-label='{title}'>"
    return f"<figure style='max-width: {SIDE}px'>{head}{picture}{rings}</svg><figcaption>{title}</figcaption></figure>"


def shrunk(image: np.ndarray) -> np.ndarray:
    """An image of at most ``SIDE`` pixels on a side: each is the mean of a block."""
    block = -(-max(image.shape[:2]) // SIDE)
    small = np.asarray(image, np.float64)
    for axis in (0, 1):
        starts = np.arange(0, image.shape[axis], block)
        sizes = np.diff([*starts, image.shape[axis]]).reshape((-1, 1, 1) if axis == 0 else (1, -1, 1))
        small = np.add.reduceat(small, starts, axis) / sizes
    return small
