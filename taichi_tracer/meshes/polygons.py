"""Polygons become triangles: fans where a fan covers the polygon, and ears of the concave ones."""

import numpy as np

from taichi_tracer.system.errors import InputError

FLAT = 1e-9  # of a polygon's area: by so much may a triangle of the fan be turned over, because numbers are rounded


def fan(sizes: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Triangles 0 1 2, 0 2 3, 0 3 4 … of polygons (C-18).

    Args:
        sizes: (P,) the number of corners of each polygon; fewer than 3 are no triangle.

    Returns:
        (F, 3) indices into the list of all corners, and (F,) the polygon of each triangle.
    """
    if (sizes == 3).all():
        return np.arange(3 * len(sizes)).reshape(-1, 3), np.arange(len(sizes))
    triangles = np.maximum(sizes - 2, 0)
    polygon_of = np.repeat(np.arange(len(sizes)), triangles)
    first_corner = (np.cumsum(sizes) - sizes)[polygon_of]
    first_triangle = (np.cumsum(triangles) - triangles)[polygon_of]
    second_corner = first_corner + 1 + np.arange(len(polygon_of)) - first_triangle
    return np.stack([first_corner, second_corner, second_corner + 1], axis=-1), polygon_of


def triangulate(points: np.ndarray, sizes: np.ndarray, ids: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """The same as ``fan``, but polygons of which a triangle of the fan is turned over are cut into ears.

    Args:
        points: (V, 3). ids: the vertices of all corners, one polygon after the other.
    """
    wrong = ids[(ids < 0) | (ids >= len(points))]
    if len(wrong) > 0:
        raise InputError(f"a face has vertex {wrong[0]}, and there are {len(points)}, counted from 0")
    corners, polygon_of = fan(sizes)
    if (sizes == 3).all():
        return corners, polygon_of
    with np.errstate(all="ignore"):
        a, b, c = (points[ids[corners[:, k]]] for k in range(3))
        areas = np.cross(b - a, c - a)
        normals = np.stack([np.bincount(polygon_of, column, len(sizes)) for column in areas.T], axis=1)
        along = (areas * normals[polygon_of]).sum(axis=1)
        is_turned = along < -FLAT * (normals**2).sum(axis=1)[polygon_of]
    is_concave = np.bincount(polygon_of, is_turned, len(sizes)) > 0
    firsts, is_fan = np.cumsum(sizes) - sizes, ~is_concave[polygon_of]
    found, owners = [corners[is_fan]], [polygon_of[is_fan]]
    for k in np.flatnonzero(is_concave).tolist():
        own = firsts[k] + np.arange(sizes[k])
        found.append(own[ears(points[ids[own]], normals[k])])
        owners.append(np.full(len(found[-1]), k))
    order = np.argsort(np.concatenate(owners), kind="stable")
    return np.concatenate(found)[order], np.concatenate(owners)[order]


def ears(points: np.ndarray, normal: np.ndarray) -> np.ndarray:
    """(F, 3) triangles of one polygon without holes, which face along its normal."""
    import mapbox_earcut

    flat = np.delete(points - points[0], np.argmax(abs(normal)), axis=1)
    cut = mapbox_earcut.triangulate_float64(np.ascontiguousarray(flat), np.array([len(flat)], np.uint32))
    triangles = cut.reshape(-1, 3).astype(np.int64)
    a, b, c = (points[triangles[:, k]] for k in range(3))
    is_turned = np.cross(b - a, c - a) @ normal < 0
    triangles[is_turned] = triangles[is_turned, ::-1]
    return triangles
