"""Where rays meet spheres, from the closed form; exact where the numbers are rational."""

from fractions import Fraction

import numpy as np


def roots(origins, directions, centre, radius):
    """(n,) t of where each ray enters and leaves, and the signed gap of its line from the sphere in radii.

    The gap is negative where the line meets the sphere. In long double, about the foot of the perpendicular.
    """
    o, d, c = (np.asarray(a, np.longdouble) for a in (origins, directions, centre))
    f = o - c
    a = (d * d).sum(axis=-1)
    t_foot = -(f * d).sum(axis=-1) / a
    foot = f + t_foot[..., None] * d
    gap = np.sqrt((foot * foot).sum(axis=-1)) / np.longdouble(radius) - 1
    with np.errstate(invalid="ignore"):
        half = np.sqrt((np.longdouble(radius) ** 2 - (foot * foot).sum(axis=-1)) / a)
    return t_foot - half, t_foot + half, gap


def nearest(origins, directions, spheres, t_min=0.0):
    """(id, t, normal, margin) of the nearest hit beyond t_min; −1 and ∞ for none.

    ``margin`` is the smallest |gap| of all spheres: below it a computation in less precision may decide otherwise.
    """
    o, d = np.asarray(origins, np.longdouble), np.asarray(directions, np.longdouble)
    best_id, best = np.full(len(o), -1), np.full(len(o), np.inf, np.longdouble)
    normal, margin = np.zeros((len(o), 3)), np.full(len(o), np.inf)
    for i, (x, y, z, radius) in enumerate(np.asarray(spheres, np.longdouble)):
        centre = np.array([x, y, z])
        t0, t1, gap = roots(o, d, centre, radius)
        margin = np.minimum(margin, np.abs(gap).astype(float))
        t = np.where(t0 > t_min, t0, t1)
        hit = (gap <= 0) & (t > t_min) & (t < best)
        best_id[hit], best[hit] = i, t[hit]
        normal[hit] = (((o + t[:, None] * d - centre) / radius)[hit]).astype(float)
    return best_id, best.astype(float), normal, margin


def discriminant_sign(origin, direction, centre, radius):
    """−1, 0 or 1: whether the line misses, touches or meets the sphere; exact, in rational numbers."""
    o, d, c = ([Fraction(float(x)) for x in v] for v in (origin, direction, centre))
    f = [a - b for a, b in zip(o, c, strict=True)]
    a = sum(x * x for x in d)
    b = sum(x * y for x, y in zip(f, d, strict=True))
    q = b * b - a * (sum(x * x for x in f) - Fraction(float(radius)) ** 2)
    return (q > 0) - (q < 0)
