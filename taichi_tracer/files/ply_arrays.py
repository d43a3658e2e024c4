"""The plainest PLY files, read without trimesh: binary, with the coordinates of vertices and with triangles alone.

Most large meshes are such files. Their arrays stand in the file as numpy would write them: reading them takes no time
and no memory beyond their own, and trimesh need not be imported.
"""

import numpy as np

from taichi_tracer.files.ply_strips import FACES, VERTICES, Element, elements_of

ORDERS = {"binary_little_endian": "<", "binary_big_endian": ">"}
LISTS = ("vertex_indices", "vertex_index")  # the names of a triangle's list of vertex ids
COORDINATES = ["x", "y", "z"]


def plain_triangles(raw: bytes) -> tuple[np.ndarray, np.ndarray] | None:
    """(V, 3) float64 vertices and (F, 3) int32 faces; None if the file is any other PLY, or is damaged."""
    head, mark, _ = raw[: 1 << 16].partition(b"end_header\n")
    lines = head.decode("latin-1").splitlines()
    order = next((ORDERS.get(line.split()[1]) for line in lines if line.startswith("format ")), None)
    if not mark or order is None:
        return None
    try:
        _, elements = elements_of(lines)
        vertices, faces = elements
    except (KeyError, ValueError, IndexError):
        return None
    if not (is_of_points(vertices) and is_of_triangles(faces)):
        return None
    points = np.dtype([(name, order + kind) for name, (_, kind) in zip(COORDINATES, vertices.properties, strict=True)])
    count, ids = faces.properties[0]
    polygons = np.dtype([("count", order + count), ("ids", order + ids, 3)])
    start = len(head) + len(mark)
    if len(raw) != start + vertices.count * points.itemsize + faces.count * polygons.itemsize:
        return None
    rows = np.frombuffer(raw, polygons, faces.count, start + vertices.count * points.itemsize)
    if not (rows["count"] == 3).all():
        return None
    columns = np.frombuffer(raw, points, vertices.count, start)
    found = np.empty((vertices.count, 3))
    for k, name in enumerate(COORDINATES):
        found[:, k] = columns[name]
    found += 0.0  # −0 becomes 0, as where trimesh reads the file
    return found, rows["ids"].astype(np.int32)


def names_of(element: Element) -> list[str]:
    """The names of the properties of an element."""
    return [line.split()[-1] for line in element.lines if line.startswith("property ")]


def is_of_points(element: Element) -> bool:
    """Whether an element has the coordinates of vertices and nothing else."""
    return element.name == VERTICES and names_of(element) == COORDINATES and not any(c for c, _ in element.properties)


def is_of_triangles(element: Element) -> bool:
    """Whether an element has at least one polygon, and nothing but a list of vertex ids for each."""
    is_list = len(element.properties) == 1 and element.properties[0][0] != ""
    return element.name == FACES and element.count > 0 and is_list and names_of(element)[0] in LISTS
