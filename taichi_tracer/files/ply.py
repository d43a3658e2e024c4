"""PLY files that are read or rewritten here, before trimesh sees them: the plainest ones, and those with strips.

Most large meshes are binary, with the coordinates of vertices and with triangles alone. Their arrays stand in the file
as numpy would write them: reading them takes no time and no memory beyond their own, and trimesh need not be imported,
which takes 0.5 s.

Some scans have no element ``face``, but an element ``tristrips``: lists of vertex ids in which each id forms a triangle
with the two ids before it. Every second triangle has the opposite orientation, and −1 begins a new strip.
"""

from dataclasses import dataclass, field

import numpy as np

from taichi_tracer.system.errors import InputError

VERTICES, FACES, STRIPS = "vertex", "face", "tristrips"
RESTART = -1  # ends a strip of triangles
TYPES = {"char": "i1", "uchar": "u1", "short": "i2", "ushort": "u2", "int": "i4", "uint": "u4"}
TYPES |= {"float": "f4", "double": "f8", "int8": "i1", "uint8": "u1", "int16": "i2", "uint16": "u2"}
TYPES |= {"int32": "i4", "uint32": "u4", "float32": "f4", "float64": "f8"}
ORDERS = {"binary_little_endian": "<", "binary_big_endian": ">"}
LISTS = ("vertex_indices", "vertex_index")  # the names of a triangle's list of vertex ids
COORDINATES = ["x", "y", "z"]


@dataclass
class PlyElement:
    """An element of the header.

    Attributes:
        name: its name. count: the number of its rows. lines: the lines of the header that describe it.
        properties: (numpy type of the count of a list, or "" for one number; numpy type of the numbers).
    """

    name: str
    count: int
    lines: list[str]
    properties: list[tuple[str, str]] = field(default_factory=list)


def without_strips(raw: bytes) -> bytes:
    """The vertices and triangles of a PLY file with strips, as another PLY file; any other file is returned as it is.

    Raises:
        InputError: the file is cut short, or it has polygons as well as strips.
    """
    head, mark, body = raw.partition(b"end_header")
    if b"element " + STRIPS.encode() not in head or not mark:
        return raw
    body = body[body.index(b"\n") + 1 :]
    first, elements = elements_of(head.decode("latin-1").splitlines())
    if any(element.name == FACES and element.count > 0 for element in elements):
        raise InputError("it has polygons and triangle strips: export it with triangles only")
    is_text = any(line.split()[:2] == ["format", "ascii"] for line in first)
    order = ">" if any("big_endian" in line for line in first) else "<"
    kept, ids = split_text(elements, body) if is_text else split_binary(elements, body, order)
    faces = triangles_of(ids)
    vertices = [line for element in elements if element.name == VERTICES for line in element.lines]
    added = [f"element {FACES} {len(faces)}", "property list uchar int vertex_indices", "end_header"]
    header = "\n".join([*first, *vertices, *added]).encode("latin-1") + b"\n"
    if is_text:
        return header + kept + "".join(f"3 {a} {b} {c}\n" for a, b, c in faces.tolist()).encode()
    rows = np.empty(len(faces), [("count", "u1"), ("ids", f"{order}i4", 3)])
    rows["count"], rows["ids"] = 3, faces
    return header + kept + rows.tobytes()


def elements_of(lines: list[str]) -> tuple[list[str], list[PlyElement]]:
    """The lines of a header that stand before the first element, and the elements."""
    first, elements = [], []
    for line in lines:
        words = line.split()
        if words[:1] == ["element"]:
            elements.append(PlyElement(words[1], int(words[2]), [line]))
        elif not elements:
            first.append(line)
        else:
            elements[-1].lines.append(line)
            if words[:2] == ["property", "list"]:
                elements[-1].properties.append((TYPES[words[2]], TYPES[words[3]]))
            elif words[:1] == ["property"]:
                elements[-1].properties.append(("", TYPES[words[1]]))
    return first, elements


def split_text(elements: list[PlyElement], body: bytes) -> tuple[bytes, np.ndarray]:
    """The rows of the vertices, and the ids of all strips with ``RESTART`` after each."""
    lines = iter([line for line in body.splitlines() if line.strip()])
    kept, lists = [], []
    for element in elements:
        rows = [line for _, line in zip(range(element.count), lines, strict=False)]
        if len(rows) < element.count:
            raise cut_short(element)
        if element.name == STRIPS:
            words = [np.array(row.split(), np.int64) for row in rows]
            lists += [row[1 : 1 + row[0]] for row in words if len(row) > row[0]]
            if len(lists) < len(words):
                raise cut_short(element)
        elif element.name == VERTICES:
            kept += rows
    return b"".join(line + b"\n" for line in kept), joined(lists)


def split_binary(elements: list[PlyElement], body: bytes, order: str) -> tuple[bytes, np.ndarray]:
    """The same as ``split_text``, for a binary file; ``order`` is < or >, the order of the bytes of a number."""
    kept, lists, at = [], [], 0
    for element in elements:
        start = at
        if all(count == "" for count, _ in element.properties):
            at += element.count * sum(np.dtype(kind).itemsize for _, kind in element.properties)
        else:
            for _ in range(element.count):
                for count, kind in element.properties:
                    length = 1
                    if count:
                        (length,) = read(element, body, order + count, 1, at).tolist()
                        at += np.dtype(count).itemsize
                    values = read(element, body, order + kind, length, at)
                    at += values.nbytes
                    if count and element.name == STRIPS:
                        lists.append(values.astype(np.int32))  # −1 of an unsigned type is its largest number
        if at > len(body):
            raise cut_short(element)
        if element.name == VERTICES:
            kept.append(body[start:at])
    return b"".join(kept), joined(lists)


def read(element: PlyElement, body: bytes, dtype: str, count: int, at: int) -> np.ndarray:
    """Some numbers of a binary file; an InputError if they are not there."""
    if count < 0 or at + count * np.dtype(dtype).itemsize > len(body):
        raise cut_short(element)
    return np.frombuffer(body, dtype, count, at)


def cut_short(element: PlyElement) -> InputError:
    """The error for a file that ends within an element."""
    return InputError(f"the file is cut short: it ends within its {element.count} rows of {element.name}")


def joined(lists: list[np.ndarray]) -> np.ndarray:
    """All lists of ids as one, with ``RESTART`` after each."""
    return np.concatenate([np.zeros(0, np.int64), *(np.append(ids, RESTART) for ids in lists)])


def triangles_of(ids: np.ndarray) -> np.ndarray:
    """(F, 3) vertex ids of the triangles of strips, all with the orientation of the first triangle of their strip.

    A triangle with a repeated id only joins two strips, and is left out.

    Args:
        ids: (n,) vertex ids, with ``RESTART`` between strips.
    """
    number, is_restart = np.arange(len(ids)), ids == RESTART
    place = number - np.maximum.accumulate(np.where(is_restart, number, -1)) - 1  # within the strip
    last = np.flatnonzero((place >= 2) & ~is_restart)
    a, b, c = ids[last - 2], ids[last - 1], ids[last]
    is_odd = place[last] % 2 == 1
    faces = np.stack([np.where(is_odd, b, a), np.where(is_odd, a, b), c], axis=1)
    return faces[(a != b) & (b != c) & (c != a)]


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


def names_of(element: PlyElement) -> list[str]:
    """The names of the properties of an element."""
    return [line.split()[-1] for line in element.lines if line.startswith("property ")]


def is_of_points(element: PlyElement) -> bool:
    """Whether an element has the coordinates of vertices and nothing else."""
    return element.name == VERTICES and names_of(element) == COORDINATES and not any(c for c, _ in element.properties)


def is_of_triangles(element: PlyElement) -> bool:
    """Whether an element has at least one polygon, and nothing but a list of vertex ids for each."""
    is_list = len(element.properties) == 1 and element.properties[0][0] != ""
    return element.name == FACES and element.count > 0 and is_list and names_of(element)[0] in LISTS
