"""What ``formulas.triangles`` computes for one triangle, for arrays of triangles in numpy, with the same bits.

All functions take the corners v0, v1, v2 as (n, 3) arrays of one precision, and compute in it. Triangles without area
give NaN, without a warning.
"""

import numpy as np


def unit_normals(v0: np.ndarray, v1: np.ndarray, v2: np.ndarray) -> np.ndarray:
    """(n, 3) ``unit(stable_normal(v0, v1, v2))``: normals of length 1."""
    e0, e1, e2 = v1 - v0, v2 - v1, v0 - v2
    with np.errstate(all="ignore"):
        l0, l1, l2 = (dot(e, e)[:, None] for e in (e0, e1, e2))
        is_0_longest = (l0 >= l1) & (l0 >= l2)
        is_1_longest = l1 >= l2
        p = np.where(is_0_longest, e1, np.where(is_1_longest, e2, e0))
        q = np.where(is_0_longest, e2, np.where(is_1_longest, e0, e1))
        normal = cross(p, q)
        within_1 = normal / abs(normal).max(axis=1, keepdims=True)
        return within_1 / norm(within_1)[:, None]


def thinness_of(v0: np.ndarray, v1: np.ndarray, v2: np.ndarray) -> np.ndarray:
    """(n,) ``thinness(v0, v1, v2)``: 1/sin of the angle between the two shortest edges."""
    with np.errstate(all="ignore"):
        a, b, c = norm(v1 - v0), norm(v2 - v1), norm(v0 - v2)
        longest = np.maximum(np.maximum(a, b), c)
        others = np.where(longest == a, b * c, np.where(longest == b, c * a, a * b))
        return others / norm(cross(v1 - v0, v2 - v0))


def dot(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """(n,) dot products of (n, 3) vectors, added from left to right."""
    return a[:, 0] * b[:, 0] + a[:, 1] * b[:, 1] + a[:, 2] * b[:, 2]


def norm(a: np.ndarray) -> np.ndarray:
    """(n,) lengths of (n, 3) vectors."""
    return np.sqrt(dot(a, a))


def cross(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """(n, 3) cross products of (n, 3) vectors."""
    (ax, ay, az), (bx, by, bz) = a.T, b.T
    return np.stack([ay * bz - az * by, az * bx - ax * bz, ax * by - ay * bx], axis=1)
