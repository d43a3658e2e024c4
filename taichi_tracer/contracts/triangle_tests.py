"""What every triangle test must do: solve o + t d = (1 − u − v) v0 + u v1 + v v2, and say what lies inside.

It is compared with the linear system in float64, on triangles and directions of any size.
"""

import numpy as np

from taichi_tracer.contracts.lab import WHOLE, Rows
from taichi_tracer.system import runtime

COUNT = 20_000
# A test subtracts the ray's origin from the vertices; that rounding is magnified by the distance over the triangle's
# size, and by the grazing angle. Both are bounded in ``trials``, so that this many ε are enough.
ROUNDINGS = 1e3
MARGIN = 1e-2  # of the barycentrics from an edge, where inside and outside are beyond doubt


def solved(test, rows):
    """is_inside (N,) bool and (t, u, v, det) (N, 4) float64 of (N, 5, 3) rows o, d, v0, v1, v2."""
    inside, *found = Rows(test.solve, [3] * 5, [WHOLE, 1, 1, 1, 1])(*rows.transpose(1, 0, 2))
    return inside != 0, np.column_stack(found)


def exact(rows):
    """(t, u, v, det) of the same by solving the linear system in float64; det = −d · (v1 − v0) × (v2 − v0)."""
    o, d, v0, v1, v2 = (rows[:, k].astype(np.float64) for k in range(5))
    matrix = np.stack([-d, v1 - v0, v2 - v0], axis=-1)
    solution = np.linalg.solve(matrix, (o - v0)[..., None])[..., 0]
    return np.column_stack([solution, np.linalg.det(matrix)])


def trials():
    """(N, 5, 3) rays aimed at points in, beside and behind triangles: 1e-6 to 1e6 in size, and so the directions."""
    rng = np.random.default_rng(8)
    corners = rng.normal(size=(COUNT, 3, 3))
    size = 10.0 ** rng.uniform(-6, 6, (COUNT, 1))
    b = rng.uniform(-1, 2, (COUNT, 2))
    target = corners[:, 0] + b[:, :1] * (corners[:, 1] - corners[:, 0]) + b[:, 1:] * (corners[:, 2] - corners[:, 0])
    o = rng.normal(size=(COUNT, 3)) * 3
    d = (target - o) * np.where(rng.random((COUNT, 1)) < 0.2, -1, 1) * 10.0 ** rng.uniform(-3, 3, (COUNT, 1))
    n = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    cosine = np.abs((n * d).sum(1)) / np.linalg.norm(n, axis=1) / np.linalg.norm(d, axis=1)
    longest = np.square(corners - np.roll(corners, 1, axis=1)).sum(axis=2).max(axis=1)
    usual = (cosine > 0.1) & (np.linalg.norm(n, axis=1) > 0.1 * longest)
    rows = np.stack([o * size, d, *(corners[:, k] * size for k in range(3))], axis=1)
    return rows[usual].astype(np.float32).astype(np.float64)


# ── the checks ──


def check_solution(test):
    """t, u, v, inside, and the sign of det, against the linear system."""
    rows = trials()
    inside, found = solved(test, rows)
    expected = exact(rows)
    u, v = expected[:, 1], expected[:, 2]
    depth = np.minimum(np.minimum(u, v), 1 - u - v)  # in barycentrics, how far inside
    limit = ROUNDINGS * runtime.epsilon()
    for what, column, scale in (("t", 0, np.abs(expected[:, 0])), ("u", 1, 1 + np.abs(u)), ("v", 2, 1 + np.abs(v))):
        error = np.abs(found[:, column] - expected[:, column]) / scale
        is_right = (error < limit) | (depth <= -0.5)  # far outside nobody reads them
        _agree(test, rows, is_right, what, found[:, column], expected[:, column])
    _agree(test, rows, np.sign(found[:, 3]) == np.sign(expected[:, 3]), "the sign of det", found[:, 3], expected[:, 3])
    _agree(test, rows, (inside == (depth > 0)) | (np.abs(depth) <= MARGIN), "is_inside", inside, depth > 0)


def _agree(test, rows, holds, what, found, expected):
    wrong = np.flatnonzero(~holds)
    assert len(wrong) == 0, (
        f"{test.name}: {what} is {found[wrong[0]]}, not {expected[wrong[0]]}, on {len(wrong)} of {len(rows)} rays; "
        f"the first has o, d, v0, v1, v2 = {rows[wrong[0]].tolist()}"
    )


def check_parallel_rays_are_no_hits(test):
    """A ray in or beside the triangle's plane has det = 0, or is not inside; coordinates are small integers."""
    rng = np.random.default_rng(9)
    corners = rng.integers(-4, 5, (4000, 3, 3)).astype(float)
    e1, e2 = corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
    steps = rng.integers(-2, 3, (4000, 2))
    d = steps[:, :1] * e1 + steps[:, 1:] * e2
    o = corners[:, 0] + rng.integers(-1, 2, (4000, 1)) * e1 - d + rng.integers(0, 2, (4000, 1)) * np.cross(e1, e2)
    rows = np.stack([o, d, *corners.transpose(1, 0, 2)], axis=1)
    rows = rows[(np.cross(e1, e2) != 0).any(axis=1) & (d != 0).any(axis=1)]
    inside, found = solved(test, rows)
    accepted = inside & (found[:, 3] != 0)
    _agree(test, rows, ~accepted, "a hit of a ray parallel to the plane", accepted, np.zeros(len(rows), bool))


STEPS = (check_solution, check_parallel_rays_are_no_hits)
