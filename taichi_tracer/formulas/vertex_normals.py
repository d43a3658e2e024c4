"""Smooth vertex normals of a mesh that has none, computed in float64 by numpy."""

import numpy as np

USUAL_CREASE = 30.0  # degrees; modelling programs have it as their default too
ROUNDING = 1e-6  # degrees by which the rounding of vertices may change the angle of an edge


def area_weighted(vertices: np.ndarray, faces: np.ndarray) -> np.ndarray:
    """(V, 3) normals, not of unit length: for each vertex, the sum of its triangles' normals, weighted by area.

    Args:
        vertices: (V, 3). faces: (F, 3) int vertex ids, counted from 0.
    """
    v0, v1, v2 = (vertices[faces[:, k]] for k in range(3))
    with np.errstate(all="ignore"):
        normal = np.nan_to_num(np.cross(v1 - v0, v2 - v0))
    total = np.zeros_like(vertices)
    for k in range(3):
        np.add.at(total, faces[:, k], normal)
    return total


def smooth_normals(vertices: np.ndarray, faces: np.ndarray, crease: float) -> tuple[np.ndarray, np.ndarray]:
    """Normals that are smooth across every edge whose two triangles differ by at most the crease angle.

    An edge is a crease if the normals of its two triangles differ by more than ``crease`` degrees, or if it does not
    have exactly two triangles whose fronts lie on the same side. Around a vertex, the creases separate the triangles
    into groups, and each group has a normal of its own: the sum of the unit normals of its triangles, each weighted by
    the angle of its corner at the vertex (Thürmer & Wüthrich, "Computing vertex normals from polygonal facets", JGT
    3(1), 1998). Unlike a sum that is weighted by area, it does not depend on how a polygon was cut into triangles.
    Vertices at the same position count as one, because many files repeat each vertex for every triangle.

    Args:
        vertices: (V, 3) float64. faces: (F, 3) int vertex ids, counted from 0. crease: degrees, from 0 to 180.

    Returns:
        (N, 3) float64 normals of unit length, or 0 where all triangles are without area; and (F, 3) int32 ids into
        them, one for each corner.
    """
    normals, angles = normals_and_angles(vertices[faces])
    first, second = smooth_edges(welded(vertices)[faces], normals, crease)
    ends = np.concatenate([first, next_corner(first)]), np.concatenate([next_corner(second), second])
    group = components(faces.size, *ends)
    _, ids = np.unique(group, return_inverse=True)
    weighted = (angles[..., None] * normals[:, None]).reshape(-1, 3)
    total = np.stack([np.bincount(ids, weights=weighted[:, k]) for k in range(3)], axis=1)
    lengths = np.linalg.norm(total, axis=1, keepdims=True)
    return total / np.where(lengths > 0, lengths, 1), ids.reshape(-1, 3).astype(np.int32)


def normals_and_angles(corners: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Unit normals (F, 3) and angles in radians (F, 3) of triangles (F, 3, 3); 0 where they are not defined."""
    edges = np.roll(corners, -1, axis=1) - corners  # edge k leads from corner k to the next one
    with np.errstate(all="ignore"):
        edges = edges / np.linalg.norm(edges, axis=2, keepdims=True)
        sines = np.cross(edges, -np.roll(edges, 1, axis=1))
        cosines = -(edges * np.roll(edges, 1, axis=1)).sum(axis=2)
        lengths = np.linalg.norm(sines, axis=2)
        normals = sines[:, 0] / lengths[:, :1]
    return np.nan_to_num(normals), np.nan_to_num(np.arctan2(lengths, cosines))


def welded(vertices: np.ndarray) -> np.ndarray:
    """(V,) for each vertex, a number that all vertices at the same position share."""
    vertices = vertices + 0.0  # −0 becomes 0
    order = np.lexsort(vertices.T)
    is_new = (vertices[order[1:]] != vertices[order[:-1]]).any(axis=1)
    number = np.zeros(len(vertices), np.int64)
    number[order[1:]] = np.cumsum(is_new)
    return number


def smooth_edges(faces: np.ndarray, normals: np.ndarray, crease: float) -> tuple[np.ndarray, np.ndarray]:
    """The edges that are no creases: two (n,) arrays, the corners at which the two triangles of an edge begin it.

    A corner has the number 3 · triangle + its place in the triangle. Along an edge, the two triangles go in opposite
    directions, if their fronts lie on the same side.

    Args:
        faces: (F, 3) ids of welded vertices. normals: (F, 3) unit normals, 0 for a triangle without area.
    """
    begin, end = faces.reshape(-1), np.roll(faces, -1, axis=1).reshape(-1)
    key = np.minimum(begin, end) * (faces.max(initial=0) + 1) + np.maximum(begin, end)
    order = np.argsort(key, kind="stable")
    starts = np.flatnonzero(np.diff(key[order], prepend=-1) != 0)
    pairs = starts[np.diff(starts, append=len(key)) == 2]
    first, second = order[pairs], order[pairs + 1]
    n, m = normals[first // 3], normals[second // 3]
    angle = np.degrees(np.arctan2(np.linalg.norm(np.cross(n, m), axis=1), (n * m).sum(axis=1)))
    is_smooth = (begin[first] == end[second]) & (angle <= crease + ROUNDING) & n.any(axis=1) & m.any(axis=1)
    return first[is_smooth], second[is_smooth]


def next_corner(corner: np.ndarray) -> np.ndarray:
    """The corner that follows another one in its triangle, by number."""
    return corner - corner % 3 + (corner + 1) % 3


def components(count: int, a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """(count,) for each of some things, the lowest number among all things to which the links a[i] – b[i] lead."""
    label = np.arange(count)
    while True:
        low, high = np.minimum(label[a], label[b]), np.maximum(label[a], label[b])
        if (low == high).all():
            return label
        np.minimum.at(label, high, low)
        while (label != label[label]).any():
            label = label[label]
