"""Eye rays and the nearest triangle, in float64."""

import numpy as np


def eye_rays(eye, at, up, fov, width, height, handedness="left"):
    """(height, width, 3) unit directions, row 0 at the bottom: A1-3 to A1-8."""
    eye, at, up = (np.asarray(v, np.float64) for v in (eye, at, up))
    z = (at - eye) / np.linalg.norm(at - eye)
    x = np.cross(up, z)
    x /= np.linalg.norm(x)
    y = np.cross(z, x)
    if handedness == "right":
        x = -x
    tangent = np.tan(np.deg2rad(fov) / 2)
    ndc_x = 2 * (np.arange(width) + 0.5) / width - 1
    ndc_y = 2 * (np.arange(height) + 0.5) / height - 1
    d = (
        (ndc_x * tangent * width / height)[None, :, None] * x
        + (ndc_y * tangent)[:, None, None] * y
        + np.broadcast_to(z, (height, width, 3))
    )
    return d / np.linalg.norm(d, axis=-1, keepdims=True)


def nearest(origins, directions, vertices, faces, chunk=200_000):
    """(id, t, u, v, margin) of the nearest triangle of every ray; id −1 and t ∞ where there is none.

    By Cramer's rule on A1-11. ``margin`` is the smallest distance, over all triangles that the ray could meet no later,
    of the barycentric coordinates from an edge: below it a computation in less precision may decide otherwise.
    """
    vertices = np.asarray(vertices, np.float64)
    v0, v1, v2 = (vertices[np.asarray(faces)[:, k]] for k in range(3))
    e1, e2 = v1 - v0, v2 - v0
    results = []
    for start in range(0, len(origins), chunk):
        o = np.asarray(origins[start : start + chunk], np.float64)
        d = np.asarray(directions[start : start + chunk], np.float64)
        best = [np.full(len(o), -1), np.full(len(o), np.inf), np.zeros(len(o)), np.zeros(len(o))]
        margins = []
        for i in range(len(v0)):
            with np.errstate(all="ignore"):
                q = np.cross(d, e2[i])
                det = q @ e1[i]
                s = o - v0[i]
                r = np.cross(s, e1[i])
                u, v, t = (s * q).sum(1) / det, (d * r).sum(1) / det, r @ e2[i] / det
                inside = np.minimum(np.minimum(u, v), 1 - u - v)
                hit = (det != 0) & (inside >= 0) & (t > 0) & (t < best[1])
                margins.append((t, np.where(t > 0, np.abs(inside), np.inf)))
            for array, value in zip(best, (i, t, u, v), strict=True):
                array[hit] = value if np.isscalar(value) else value[hit]
        margin = np.full(len(o), np.inf)
        for t, distance in margins:
            with np.errstate(all="ignore"):
                reachable = t <= best[1] * (1 + 1e-5) + 1e-12
            margin = np.minimum(margin, np.where(reachable, distance, np.inf))
        results.append((*best, margin))
    return tuple(np.concatenate(parts) for parts in zip(*results, strict=True))
