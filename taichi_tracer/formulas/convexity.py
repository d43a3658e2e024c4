"""Can the surfaces of a mesh see each other? If none lies in front of another, rays that leave them hit nothing."""

import numpy as np

from taichi_tracer.formulas.points import named

MOST_DISTANCES = 1 << 27  # between vertices and planes that are compared: about half a second
CHUNK = 1 << 22  # of them at once
# Vertices that were rounded to f32 lie this much beside their plane, in units of the largest coordinate.
ROUNDING = 4 * 2.0**-24


def sides_that_see_others(vertices: np.ndarray, faces: np.ndarray) -> str:
    """Which sides of its triangles can see other triangles: "none", only the "backs", or "all".

    In front of a triangle of a convex body, whose triangles face outwards, there is no vertex of the body. In a plane,
    there is none behind it, either. If a comparison of all triangles would take long, the answer is "all".

    Args:
        vertices: (V, 3) float. faces: (T, 3) int.
    """
    first, size, compared, answer = 0, 1, 0, "none"
    while first < len(faces):
        v0, v1, v2 = (vertices[faces[first : first + size, k]].astype(np.float64) for k in range(3))
        normals = np.cross(v1 - v0, v2 - v0)
        lengths = np.linalg.norm(normals, axis=1, keepdims=True)
        normals = np.divide(normals, lengths, out=np.zeros_like(normals), where=lengths > 0)
        if first == 0:
            points = vertices[named(faces, len(vertices))].astype(np.float64)
            most = ROUNDING * np.abs(points).max()
        compared += len(points) * len(normals)
        heights = points @ normals.T - (normals * v0).sum(axis=1)
        if compared > MOST_DISTANCES or heights.max() > most:
            return "all"
        if heights.min() < -most:
            answer = "backs"
        first += size
        size = max(1, min(8 * size, CHUNK // len(points)))
    return answer
