"""What is true: exact integers where rounding could decide, float64 with a bound elsewhere. No code of the tracer."""

import numpy as np

SCALE_BITS = 149  # every finite f32 number is an integer times 2^−149

_as_int = np.frompyfunc(int, 1, 1)


def integers(values) -> np.ndarray:
    """f32 numbers as Python integers, in units of 2^−149."""
    return _as_int(np.ldexp(np.asarray(values, np.float64), SCALE_BITS))


def dot(a, b) -> np.ndarray:
    """Dot products of rows, for numbers of any kind."""
    return (a * b).sum(axis=-1)


def exact_hit(o, d, corners) -> tuple[np.ndarray, np.ndarray]:
    """(position, t) of f32 rays (n, 3) on triangles (n, 3, 3), in integers; t correctly rounded to float64.

    position is 1 inside, 0 on an edge or a vertex, −1 outside or where ray and plane are parallel; t is then NaN. Signs
    are those of the volumes d · (a × b) of the ray and each edge (Plücker coordinates).
    """
    o, d, corners = integers(o), integers(d), integers(corners)
    a, b, c = (corners[:, k] - o for k in range(3))
    n = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    volumes = np.stack([dot(d, np.cross(b, c)), dot(d, np.cross(c, a)), dot(d, np.cross(a, b))], axis=-1)
    det = dot(d, n)
    low, high = volumes.min(axis=1), volumes.max(axis=1)
    one_sided = ((low >= 0) | (high <= 0)) & (det != 0)
    on_edge = (volumes == 0).any(axis=1)
    position = np.where(one_sided, np.where(on_edge, 0, 1), -1)
    numerator = dot(a, n)
    t = np.array([p / q if q != 0 else np.nan for p, q in zip(numerator, det, strict=True)], np.float64)
    return position.astype(int), t


def margin(o, d, corners) -> np.ndarray:
    """The smallest barycentric coordinate of the point where rays meet the planes of triangles, in float64."""
    e1, e2, s = corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0], o - corners[:, 0]
    with np.errstate(all="ignore"):
        det = dot(e1, np.cross(d, e2))
        u, v = dot(s, np.cross(d, e2)) / det, dot(d, np.cross(s, e1)) / det
    return np.minimum(np.minimum(u, v), 1 - u - v)


def passes_by(o, d, corners) -> np.ndarray:
    """How far a line passes a triangle by, over the distance of the farthest corner: 0 where it goes through.

    In float64; the error of the result is below 64 ε of float64.
    """
    with np.errstate(all="ignore"):
        d = d / np.abs(d).max(axis=1, keepdims=True)
        d = d / np.linalg.norm(d, axis=1, keepdims=True)
        to = corners - o[:, None]
        reach = np.abs(to).max(axis=(1, 2))
        flat = to - d[:, None] * (to * d[:, None]).sum(axis=2, keepdims=True)
        sides, distance = [], np.full(len(o), np.inf)
        for k in range(3):
            p, q = flat[:, k], flat[:, (k + 1) % 3]
            edge = q - p
            length = (edge * edge).sum(axis=1)
            along = np.clip(-(p * edge).sum(axis=1) / np.where(length > 0, length, 1), 0, 1)
            distance = np.minimum(distance, np.linalg.norm(p + along[:, None] * edge, axis=1))
            sides.append((np.cross(p, q) * d).sum(axis=1))
        sides = np.array(sides)
        is_through = (sides >= 0).all(axis=0) | (sides <= 0).all(axis=0)
        return np.where(is_through, 0.0, distance / reach)


def polygon_irradiance(point, normal, corners) -> float:
    """E / L at a point with a unit normal, of a flat polygon that emits L from the side seen counter-clockwise.

    Lambert's formula of 1760; 0 from behind.

    Args:
        point, normal: (3,). corners: (n, 3), counter-clockwise as seen from the side that emits, none of them below the
            horizon of the point.
    """
    corners = np.asarray(corners, np.float64) - np.asarray(point, np.float64)
    front = np.cross(corners[1] - corners[0], corners[2] - corners[0])
    if front @ corners[0] >= 0:  # the point lies behind the polygon, or in its plane
        return 0.0
    to = corners / np.linalg.norm(corners, axis=1, keepdims=True)
    after = np.roll(to, -1, axis=0)
    normals = np.cross(to, after)
    length = np.linalg.norm(normals, axis=1)
    angle = np.arctan2(length, (to * after).sum(axis=1))
    parts = np.divide(angle * (normals @ normal), length, out=np.zeros_like(length), where=length > 0)
    return float(abs(parts.sum()) / 2)
