"""Two drawings of a sample, as SVG: its path, seen from the side, and the first surface with its BRDF's lobe."""

import html
import itertools
from collections.abc import Sequence
from typing import Any

import numpy as np

WIDTH, HEIGHT, MARGIN = 460, 300, 34  # of a drawing, in pixels
RAY, LIGHT, BLOCKED, SURFACE, LOBE = "#2f7fc1", "#d9820b", "#d1495b", "#8a97a5", "#2f9e5b"
STUB = 0.35  # of the extent of the path: the length of an arrow that leaves it
Arrow = tuple[Any, Any, str, str]  # from where, along which direction, its colour, what it is
Direction = tuple[Any, str, str]  # a unit vector, its colour, what it is
FLAT = 1e-9  # of the extent: points that are nearer to a line than this lie on it
Label = tuple[tuple[float, float], tuple[float, float], str]  # where it belongs, to which side of that, the words
LETTER, BASELINE, LINE = 8, 11, 15  # of labels, in pixels: a wide letter; from the top to the baseline; the height
TURNS = np.deg2rad([0, 30, -30, 60, -60, 90, -90, 120, -120, 150, -150, 180])  # from the side where a label belongs
REACHES = (12, 20, 30, 42, 56, 72, 90)  # how far from its point the middle of a label may be, beside its half size
LEADER = 24  # a label that is farther away than this gets a line to its point
HEAD = "<svg viewBox='0 0 {w} {h}' width='{w}' height='{h}' role='img' aria-label='{label}' class='drawing'>"
STYLE = "<style>.drawing text{{font:12px system-ui,sans-serif;fill:currentColor}}</style>"


def path_drawing(
    points: np.ndarray, triangles: Sequence[np.ndarray], arrows: Sequence[tuple[Any, Any, str, str]]
) -> str:
    """The path on the plane that fits it best.

    Args:
        points: (n, 3): the eye, then the surfaces; the last one may be far away.
        triangles: (3, 3) vertices of what was hit.
        arrows: of the directions that were sampled.
    """
    frame = plane_of(points, triangles)
    flat = points @ frame.T
    extent = max(float(np.ptp(flat, axis=0).max()), 1e-12)
    ends = [(np.asarray(o) @ frame.T, np.asarray(d) @ frame.T) for o, d, _, _ in arrows]
    everything = [flat, *(o + STUB * extent * unit(d) for o, d in ends)]
    low, high = (f(np.vstack([np.atleast_2d(e) for e in everything]), axis=0) for f in (np.min, np.max))
    to_page = fitted(low, high)
    parts = [polygon([to_page(p) for p in t @ frame.T], SURFACE) for t in triangles]
    parts += [line(to_page(a), to_page(b), RAY) for a, b in zip(flat[:-1], flat[1:], strict=True)]
    places, names = [to_page(p) for p in flat], ["eye", *(f"hit {k}" for k in range(1, len(points)))]
    labels: list[Label] = [(place, (1, -1), name) for place, name in zip(places, names, strict=True)]
    for (o, d), (_, _, colour, what) in zip(ends, arrows, strict=True):
        a, b = to_page(o), to_page(o + STUB * extent * unit(d))
        parts.append(line(a, b, colour))
        labels.append((b, (b[0] - a[0], b[1] - a[1]), what))
    parts += [dot(place) for place in places]
    return drawing("the path from the eye, seen from the side", parts, labels)


def lobe_drawing(
    lobe: np.ndarray, w_o: np.ndarray, normal: np.ndarray, directions: Sequence[tuple[Any, str, str]]
) -> str:
    """The first surface in the plane of its normal and the viewer, with f_r cos θ for every direction in this plane.

    Args:
        lobe: (n,) f_r max(n·ω_i, 0) at n angles from −90° to 90°, positive on the viewer's side.
        w_o, normal: unit vectors.
        directions: that were sampled; they are turned about the normal into the plane.
    """
    angles = np.linspace(-np.pi / 2, np.pi / 2, len(lobe))
    size = lobe / max(float(lobe.max()), 1e-30)
    lowest = min([0.0, *(float(np.dot(w, normal)) for w, _, _ in directions)])
    to_page = fitted(np.array([-1.1, lowest - 0.15]), np.array([1.1, 1.15]))
    curve = [to_page((r * np.sin(a), r * np.cos(a))) for r, a in zip(size, angles, strict=True)]
    parts = [polygon([to_page((0, 0)), *curve], LOBE)]
    parts.append(line(to_page((-1.1, 0)), to_page((1.1, 0)), SURFACE))
    foot, labels = to_page((0, 0)), []
    tangent = w_o - np.dot(w_o, normal) * normal
    tangent = unit(tangent) if np.linalg.norm(tangent) > FLAT else any_tangent(normal)
    for w, colour, what in [(normal, SURFACE, "n"), (w_o, RAY, "ω_o"), *directions]:
        height = float(np.dot(w, normal))
        across = np.sqrt(max(0.0, 1 - height * height)) * (1 if np.dot(w, tangent) >= 0 else -1)
        end = to_page((across, height))
        parts.append(line(foot, end, colour))
        labels.append((end, (end[0] - foot[0], end[1] - foot[1]), what))
    title = "the first surface: its normal, the viewer, the lobe f_r cos θ and the sampled directions"
    return drawing(title, parts, labels)


# ── geometry ──


def plane_of(points: np.ndarray, triangles: Sequence[np.ndarray]) -> np.ndarray:
    """(2, 3) two unit vectors that span the plane that fits the path best, the second one upwards."""
    first = unit(points[1] - points[0]) if len(points) > 1 else np.array([1.0, 0, 0])
    spread = points - points[0]
    spread = spread - np.outer(spread @ first, first)
    second = np.linalg.svd(spread)[2][0] if np.abs(spread).max() > FLAT * np.abs(points).max() else None
    if second is None or abs(np.dot(second, first)) > 0.9:
        for normal in (np.cross(*(t[1:] - t[0])) for t in triangles):
            across = normal - np.dot(normal, first) * first
            if np.linalg.norm(across) > 1e-3 * np.linalg.norm(normal):
                second = unit(across)
                break
        else:
            second = any_tangent(first)
    return upright(np.stack([first, unit(second - np.dot(second, first) * first)]))


def upright(frame: np.ndarray) -> np.ndarray:
    """The two vectors turned within their plane, so that y points upwards as far as the plane allows."""
    across, up = frame[:, 1]
    length = np.hypot(across, up)
    if length < FLAT:
        return frame
    cos, sin = up / length, across / length
    return np.array([[cos, -sin], [sin, cos]]) @ frame


def unit(v: np.ndarray) -> np.ndarray:
    """The vector with length 1; 0 stays 0."""
    length = np.linalg.norm(v)
    return v / length if length > 0 else v


def any_tangent(v: np.ndarray) -> np.ndarray:
    """Some unit vector that is perpendicular to v."""
    other = np.eye(3)[np.abs(v).argmin()]
    return unit(np.cross(v, other))


def fitted(low: np.ndarray, high: np.ndarray):
    """The function that places a point of the plane on the page, with the same scale along both axes."""
    size = np.maximum(high - low, 1e-12)
    scale = min((WIDTH - 2 * MARGIN) / size[0], (HEIGHT - 2 * MARGIN) / size[1])
    middle = (low + high) / 2

    def to_page(p) -> tuple[float, float]:
        """The place of a point of the plane on the page, in pixels."""
        x, y = (np.asarray(p, float) - middle) * scale
        return WIDTH / 2 + x, HEIGHT / 2 - y

    return to_page


# ── SVG ──


def drawing(label: str, parts: list[str], labels: Sequence[Label]) -> str:
    """A whole drawing."""
    head = HEAD.format(w=WIDTH, h=HEIGHT, label=html.escape(label))
    body = "".join([*parts, *placed(labels)])
    caption = f"<figcaption>{html.escape(label)}</figcaption>"
    return f"<figure style='max-width: {WIDTH}px'>{head}{STYLE.format()}{body}</svg>{caption}</figure>"


def placed(labels: Sequence[Label]) -> list[str]:
    """The labels as near to their points as they can be without overlapping; one that has no room is left out.

    Each label tries the side where it belongs, then the sides next to it, and then the same farther away.
    """
    boxes: list[tuple[float, float, float, float]] = []
    found = []
    for (x, y), side, text in labels:
        width, first = LETTER * len(text), np.arctan2(side[1], side[0])
        for reach, turn in itertools.product(REACHES, TURNS):
            cos, sin = np.cos(first + turn), np.sin(first + turn)
            left, top = x + (reach + width / 2) * cos - width / 2, y + (reach + LINE / 2) * sin - LINE / 2
            box = left, top, left + width, top + LINE
            is_within = left >= 0 and top >= 0 and box[2] <= WIDTH and box[3] <= HEIGHT
            if is_within and not any(overlap(box, other) for other in boxes):
                boxes.append(box)
                if reach > LEADER:
                    end = f"x2='{x + reach * cos:.1f}' y2='{y + reach * sin:.1f}'"
                    found.append(f"<line x1='{x:.1f}' y1='{y:.1f}' {end} stroke='{SURFACE}' stroke-width='0.7'/>")
                found.append(f"<text x='{left:.1f}' y='{top + BASELINE:.1f}'>{html.escape(text)}</text>")
                break
    return found


def overlap(a: Sequence[float], b: Sequence[float]) -> bool:
    """Whether two boxes (left, top, right, bottom) overlap."""
    return a[0] < b[2] and b[0] < a[2] and a[1] < b[3] and b[1] < a[3]


def line(a: tuple[float, float], b: tuple[float, float], colour: str) -> str:
    """A line with an arrow head."""
    (x0, y0), (x1, y1) = a, b
    length = max(np.hypot(x1 - x0, y1 - y0), 1e-9)
    ux, uy = (x1 - x0) / length, (y1 - y0) / length
    barbs = " ".join(f"{x1 - 8 * ux - s * 4 * uy:.1f},{y1 - 8 * uy + s * 4 * ux:.1f}" for s in (1, -1))
    head = f"<polygon points='{x1:.1f},{y1:.1f} {barbs}' fill='{colour}'/>" if length > 12 else ""
    shaft = f"<line x1='{x0:.1f}' y1='{y0:.1f}' x2='{x1:.1f}' y2='{y1:.1f}' stroke='{colour}' stroke-width='2'/>"
    return shaft + head


def polygon(points: list[tuple[float, float]], colour: str) -> str:
    """A shape that is filled lightly."""
    text = " ".join(f"{x:.1f},{y:.1f}" for x, y in points)
    return f"<polygon points='{text}' fill='{colour}' fill-opacity='0.25' stroke='{colour}'/>"


def dot(p: tuple[float, float]) -> str:
    """A point."""
    return f"<circle cx='{p[0]:.1f}' cy='{p[1]:.1f}' r='4' fill='{RAY}'/>"
