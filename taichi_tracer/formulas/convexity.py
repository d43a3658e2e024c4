"""Can the surfaces of a mesh see each other? If none lies in front of another, rays that leave them hit nothing."""

import numpy as np

from taichi_tracer.formulas.triangles import unit_normals

MOST_DISTANCES = 1 << 27  # between vertices and planes that are compared: about half a second
CHUNK = 1 << 18  # of them at once: most meshes are found to be "all" in the first ones
# Vertices that were rounded to f32 lie this much beside their plane, in units of the largest coordinate.
ROUNDING = 4 * 2.0**-24


def sides_that_see_others(vertices: np.ndarray, faces: np.ndarray) -> str:
    """Which sides of its triangles can see other triangles: "none", only the "backs", or "all".

    In front of a triangle of a convex body, whose triangles face outwards, there is no vertex of the body. In a plane,
    there is none behind it, either. If a comparison of all triangles would take long, the answer is "all".

    Args:
        vertices: (V, 3) float. faces: (T, 3) int.
    """
    points = vertices[np.isin(np.arange(len(vertices)), faces)].astype(np.float64)
    if len(points) * len(faces) > MOST_DISTANCES:
        return "all"
    most, size, answer = ROUNDING * np.abs(points).max(initial=0), 1 + CHUNK // (1 + len(points)), "none"
    for first in range(0, len(faces), size):
        v0, v1, v2 = (vertices[faces[first : first + size, k]].astype(np.float64) for k in range(3))
        normals = np.nan_to_num(unit_normals(v0, v1, v2))
        heights = points @ normals.T - (normals * v0).sum(axis=1)
        if heights.max() > most:
            return "all"
        if heights.min() < -most:
            answer = "backs"
    return answer
