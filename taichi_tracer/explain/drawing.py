"""Drawings of a sample, as HTML: its path, seen from the side, its first surface with the lobe, and its pixel."""

import base64
import html
import io
from collections.abc import Sequence
from typing import Any

import numpy as np

from taichi_tracer.files.drawing import FONT, INK, svg_of
from taichi_tracer.files.images import encode_png
from taichi_tracer.tones.display import Display

RAY, LIGHT, SURFACE, LOBE = "#2f7fc1", "#d9820b", "#8a97a5", "#2f9e5b"
SIZE = (6.0, 4.0)  # of a drawing, in inches
STUB = 0.35  # of the extent of the path: the length of an arrow that leaves it; twice the length of a drawn surface
LEAST = 1e-3  # the weight of normals for the plane of a path: they decide only where the path is a straight line
FLAT = 1e-9  # a shorter vector has no direction
SIDE, RING = 160, 7  # of the small picture, in pixels: the longer side, and the radius of the ring
Arrow = tuple[Any, Any, str, str]  # from where, along which direction, its colour, what it is
Direction = tuple[Any, str, str]  # a unit vector, its colour, what it is


def path_drawing(points: np.ndarray, normals: np.ndarray, arrows: Sequence[Arrow]) -> str:
    """The path on the plane that fits it best, as SVG.

    Args:
        points: (n, 3): the eye, then the surfaces; the last one may be far away.
        normals: (n − 1, 3) of the surfaces.
        arrows: of the directions that were sampled.
    """
    frame, axes = plane_of(points, normals), empty_axes()
    flat = points @ frame.T
    length = STUB * max(float(np.ptp(flat, axis=0).max()), FLAT)
    for a, b in zip(flat[:-1], flat[1:], strict=True):
        draw_arrow(axes, a, b, RAY)
    for k, (place, (x, y)) in enumerate(zip(flat[1:], normals @ frame.T, strict=True), start=1):
        across = length / 2 * np.array([-y, x])
        axes.plot(*zip(place - across, place + across, strict=True), color=SURFACE, linewidth=4, alpha=0.5)
        write(axes, place, f"hit {k}")
    write(axes, flat[0], "eye")
    for origin, direction, colour, what in arrows:
        draw_arrow(axes, frame @ origin, frame @ origin + length * (frame @ direction), colour, what)
    return as_figure(axes, "the path from the eye, seen from the side")


def lobe_drawing(lobe: np.ndarray, w_o: np.ndarray, normal: np.ndarray, directions: Sequence[Direction]) -> str:
    """The first surface in the plane of its normal and the viewer, with f_r cos θ for every direction in this plane.

    Args:
        lobe: (n,) f_r max(n·ω_i, 0) at n angles from −90° to 90°, positive on the viewer's side.
        w_o, normal: unit vectors.
        directions: that were sampled; they are turned about the normal into the plane.

    Returns:
        SVG.
    """
    axes, foot = empty_axes(), np.zeros(2)
    angles = np.linspace(-np.pi / 2, np.pi / 2, len(lobe))
    size = lobe / max(float(lobe.max()), FLAT)
    axes.fill(size * np.sin(angles), size * np.cos(angles), facecolor=f"{LOBE}40", edgecolor=LOBE)
    axes.plot([-1.1, 1.1], [0, 0], color=SURFACE)
    tangent = w_o - np.dot(w_o, normal) * normal
    for w, colour, what in [(normal, SURFACE, "n"), (w_o, RAY, "ω_o"), *directions]:
        height = float(np.dot(w, normal))
        across = np.sqrt(max(0.0, 1 - height * height)) * (1 if np.dot(w, tangent) >= 0 else -1)
        draw_arrow(axes, foot, np.array([across, height]), colour, what)
    return as_figure(axes, "the first surface: its normal, the viewer, the lobe f_r cos θ and the sampled directions")


def plane_of(points: np.ndarray, normals: np.ndarray) -> np.ndarray:
    """(2, 3) two unit vectors that span the plane that fits the path best, the second one as far upwards as it can."""
    spread = points - points[0]
    frame = np.linalg.svd(np.vstack([spread, LEAST * np.abs(spread).max() * normals]))[2][:2]
    turn = np.arctan2(*frame[:, 1])
    cos, sin = np.cos(turn), np.sin(turn)
    return np.array([[cos, -sin], [sin, cos]]) @ frame


# ── matplotlib ──


def empty_axes() -> Any:
    """Axes without a frame, with one scale for both directions."""
    from matplotlib.figure import Figure

    axes = Figure(figsize=SIZE, facecolor="none", layout="constrained").add_subplot(aspect="equal")
    axes.margins(0.1)
    axes.axis("off")
    return axes


def draw_arrow(axes: Any, start: np.ndarray, end: np.ndarray, colour: str, label: str = "") -> None:
    """An arrow between two points of the plane, with a label at its end."""
    axes.plot(*zip(start, end, strict=True), color=colour, linewidth=0)  # an annotation does not widen the axes
    axes.annotate("", end, start, arrowprops={"arrowstyle": "-|>", "color": colour, "shrinkA": 0, "shrinkB": 0})
    way = end - start
    write(axes, end, label, 14 * way / max(float(np.linalg.norm(way)), FLAT))


def write(axes: Any, place: np.ndarray, text: str, offset: Any = (14, 10)) -> None:
    """Words beside a point of the plane, so many points away from it."""
    axes.annotate(text, place, offset, textcoords="offset points", ha="center", va="center", fontsize=FONT, color=INK)


def as_figure(axes: Any, caption: str) -> str:
    """The drawing, with a caption; in a page and in a notebook, the letters have the colour of the text around it."""
    drawn = svg_of(axes.figure, caption).replace("var(--ink)", "currentColor")
    return f"<figure>{drawn}<figcaption>{html.escape(caption)}</figcaption></figure>"


def thumbnail(image: np.ndarray, column: int, row: int, display: Display, srgb: bool) -> str:
    """The picture, small, with a ring around a pixel.

    Args:
        image: (height, width, 3) linear. column, row: the pixel, from the left and from the top.
        display, srgb: how the picture is shown, see ``srgb.to_bytes``.
    """
    from PIL import Image, ImageDraw, ImageOps

    picture = Image.open(io.BytesIO(encode_png(image, srgb, display)))
    small = ImageOps.contain(picture, (SIDE, SIDE), Image.Resampling.BOX)
    centre = SIDE / max(image.shape[:2]) * np.array([column + 0.5, row + 0.5])
    for radius, colour in ((RING, "black"), (RING - 1, "white")):  # seen on bright and on dark ground
        ImageDraw.Draw(small).ellipse([*(centre - radius), *(centre + radius)], outline=colour)
    buffer = io.BytesIO()
    small.save(buffer, "PNG")
    title = html.escape(f"the picture so far: the ring is around column {column}, row {row}")
    source = f"data:image/png;base64,{base64.b64encode(buffer.getvalue()).decode()}"
    return (
        f"<figure style='width: {SIDE}px'><img src='{source}' alt='{title}'><figcaption>{title}</figcaption></figure>"
    )
