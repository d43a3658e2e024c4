"""From where does a mesh show most? And which of its axes points upwards? Both are guessed from its shape, in numpy.

Points on all surfaces, in proportion to the area, are projected into ``CELLS``² cells of the picture of each camera
that comes into question. In each cell, the nearest point is seen. A view has the score

    S = √c f² (0.3 + 0.7 H) (1 + 0.1 e),

where c is the share of the cells that show something, f the share of these that show a front side, H the entropy of
the normals that are seen, as a fraction of that of ``DIRECTIONS`` equally frequent ones, and e is 1 if a lamp is seen.
"""

import math
from typing import Any, NamedTuple

import numpy as np

from taichi_tracer.formulas.view import FROM, box_of, camera_frame, up_of, view_of_points, world_axes

CELLS, DIRECTIONS = 48, 20
EACH = 8  # of so many points of the surfaces, one is enough to place the camera of a view that is only tried
GOOD_ENOUGH = 0.75  # of the best score: the usual view is kept if it has so much
# Azimuth and elevation in degrees, of views from outside: straight at a side, or at an edge.
AROUND = (0.0, 3.5), (90.0, 3.5), (180.0, 3.5), (270.0, 3.5), (35.0, 20.0), (125.0, 20.0), (215.0, 20.0), (305.0, 20.0)
INSIDE = (0.85, 0.2, 0.85), (-0.5, -0.1, -0.5), 75.0  # eye and point looked at, in half boxes; degrees
BASE, OF_BASE, DOWN = 0.01, 0.2, -0.98  # the thickness of a base, its share of the box, and the normal's part


class Surface(NamedTuple):
    """Points on the surfaces of a mesh, one for each equal part of the area.

    Attributes:
        points, normals: (n, 3) float64. emits: (n,) bool. area: of all surfaces.
    """

    points: np.ndarray
    normals: np.ndarray
    emits: np.ndarray
    area: float


def best_view(surface: Surface, up_axis: str, further: tuple[dict, ...]) -> dict | tuple[float, float]:
    """The view that shows most: as a view, or as the angles of ``view_of_points``.

    Args:
        further: views that come into question, too.
    """
    if len(surface.points) == 0:
        return FROM
    some = surface.points[::EACH]
    choices: list[dict | tuple[float, float]] = [FROM, *AROUND, *inside(surface, up_axis), *further]
    views = (one if isinstance(one, dict) else view_of_points(some, up_axis, seen_from=one) for one in choices)
    scores = [score(view, surface) for view in views]
    return FROM if scores[0] >= GOOD_ENOUGH * max(scores) else choices[int(np.argmax(scores))]


def inside(surface: Surface, up_axis: str) -> list[dict]:
    """Views from four corners of the box into it; none if it is flat."""
    low, high = box_of(surface.points)
    middle, half, (eye, at, fov) = (low + high) / 2, (high - low) / 2, INSIDE
    found = []
    for x, z in ((-1, -1), (-1, 1), (1, -1), (1, 1)):
        to, of = (middle + half * (world_axes(up_axis) @ (np.array(one) * (x, 1, z))) for one in (eye, at))
        found.append({"eye": to, "at": of, "up": up_of(up_axis), "fov": fov})
    return found if (half > 0).all() else []


def score(view: dict[str, Any], surface: Surface) -> float:
    """S of a square picture."""
    eye, at, up = (np.asarray(view[name], np.float64) for name in ("eye", "at", "up"))
    x, y, z = ((surface.points - eye) @ camera_frame(eye, at, up)[:3, :3]).T
    half = z * math.tan(math.radians(view["fov"]) / 2)
    point = np.flatnonzero((z > 0) & (abs(x) < half) & (abs(y) < half))
    place = (np.stack([x, y])[:, point] / half[point] + 1) / 2 * CELLS
    cell = place.astype(np.int64).T @ (1, CELLS)
    nearest = np.full((CELLS + 1) ** 2, np.inf)  # a point at the border may be rounded into the row behind it
    np.minimum.at(nearest, cell, z[point])
    at_front = np.flatnonzero(z[point] == nearest[cell])
    _, first = np.unique(cell[at_front], return_index=True)  # the first of equally near points
    seen = point[at_front[first]]
    is_front = (surface.normals[seen] * (eye - surface.points[seen])).sum(axis=1) > 0
    if not is_front.any():  # or nothing is seen
        return 0.0
    rounded = np.round(1.2 * surface.normals[seen][is_front]).astype(np.int64)
    _, counts = np.unique(rounded @ (1, 3, 9), return_counts=True)
    share = counts / counts.sum()
    entropy = -float((share * np.log(share)).sum()) / math.log(DIRECTIONS)
    covered, lamp = len(seen) / CELLS**2, surface.emits[seen][is_front].any()
    return math.sqrt(covered) * is_front.mean() ** 2 * (0.3 + 0.7 * entropy) * (1 + 0.1 * lamp)


def guessed_up_axis(surface: Surface) -> str:
    """ "z" if the lowest points in z are a flat base, and those in y are none; else "y".

    A base looks down, and its area is a good part of the box. What is as flat on the other side is no base.
    """
    if len(surface.points) == 0:
        return "y"
    y, z = (base(surface, axis) for axis in (1, 2))
    return "z" if z > OF_BASE and z > 2 * y else "y"


def base(surface: Surface, axis: int) -> float:
    """How much larger the flat lower end along an axis is than the upper one, as a share of the box's side."""
    points, normal = surface.points, surface.normals[:, axis]
    low, high = box_of(points)
    side = np.delete(high - low, axis).prod()
    thickness = BASE * (high - low)[axis]
    lower = (points[:, axis] <= low[axis] + thickness) & (normal < DOWN)
    upper = (points[:, axis] >= high[axis] - thickness) & (normal > -DOWN)
    is_solid = side > 0 and thickness > 0
    return max(0.0, float(lower.mean() - upper.mean()) * surface.area / side) if is_solid else 0.0
