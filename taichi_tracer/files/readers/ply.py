"""PLY files: binary and text, with triangles and polygons, normals, colours, and the picture that a comment names."""

import re
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from taichi_tracer.files.images import linear_colors, read_image
from taichi_tracer.files.readers.text import all_numbers
from taichi_tracer.geometry import Mesh
from taichi_tracer.materials import Material, Texture
from taichi_tracer.meshes.polygons import triangulate
from taichi_tracer.system.errors import InputError, MissingFileError

TYPES = {
    "char": "i1",
    "uchar": "u1",
    "short": "i2",
    "ushort": "u2",
    "int": "i4",
    "uint": "u4",
    "float": "f4",
    "int8": "i1",
    "uint8": "u1",
    "int16": "i2",
    "uint16": "u2",
    "int32": "i4",
    "uint32": "u4",
    "double": "f8",
    "int64": "i8",
    "uint64": "u8",
    "float32": "f4",
    "float64": "f8",
}
ORDERS = {"ascii": "", "binary_little_endian": "<", "binary_big_endian": ">"}
HEADER_END = re.compile(rb"^end_header[ \t]*(?:\r\n|\n|\r)", re.MULTILINE)
TEXTURE = re.compile(r"^comment\s+TextureFile\s+(.+)$", re.MULTILINE | re.IGNORECASE)
LISTS = ("vertex_indices", "vertex_index")  # the names of a face's list of vertex ids
COORDINATES = (("texture_u", "texture_v"), ("u", "v"), ("s", "t"))  # the names of a vertex's texture coordinates
COLOURS = (("red", "green", "blue"), ("diffuse_red", "diffuse_green", "diffuse_blue"), ("r", "g", "b"))


# The elements of a header by name: how many rows, and name → (type of a list's count, or "" for a number; type).
Elements = dict[str, tuple[int, dict[str, tuple[str, str]]]]


def read_ply(raw: bytes, path: Path, notes: list[str]) -> Mesh:
    """The triangles of a file; ``notes`` gets a line for what is not read."""
    end = HEADER_END.search(raw)
    if raw[:3] != b"ply" or end is None:
        raise InputError("it must begin with ply, and its header must end with end_header")
    head, body = raw[: end.start()].decode("latin-1"), raw[end.end() :]
    order, elements = elements_of(head)
    is_text, at, tables = order == "", 0, {}
    if is_text:
        numbers = all_numbers(body, np.float64)
        body = (np.array(body.split(), np.float64) if numbers is None else numbers).tobytes()
    for name, (rows, properties) in elements.items():
        kinds = {key: (count and order + count, order + kind) for key, (count, kind) in properties.items()}
        if is_text:
            kinds = {key: (count and "f8", "f8") for key, (count, _) in kinds.items()}
        tables[name], at = rows_of(name, rows, kinds, body, at)
    if at < len(body):
        rest = f"{(len(body) - at) // 8} numbers" if is_text else f"{len(body) - at} bytes"
        notes.append(f"{rest} after the last element are not read")
    return mesh_of(elements, tables, head, path, notes)


def elements_of(head: str) -> tuple[str, Elements]:
    """The order of bytes ("" for text) and the elements of a header."""
    order, elements, properties = "", {}, {}
    for line in head.splitlines():
        words = line.split()
        try:
            if words[:1] == ["format"]:
                order = ORDERS[words[1]]
            elif words[:1] == ["element"]:
                properties = {}
                elements[words[1]] = int(words[2]), properties
            elif words[:2] == ["property", "list"]:
                properties[words[4]] = TYPES[words[2]], TYPES[words[3]]
            elif words[:1] == ["property"]:
                properties[words[2]] = "", TYPES[words[1]]
        except (LookupError, ValueError):
            raise InputError(f"the line {line!r:.80} of the header cannot be read") from None
    return order, elements


def rows_of(element: str, count: int, kinds: dict, body: bytes, at: int) -> tuple[dict, int]:
    """Name → (n,) numbers, or (sizes, all numbers) of a list; and the byte after the element.

    Usually, all lists have as many numbers as those of the first row: the rows are an array then.
    """
    if not kinds or count <= 0:
        return {}, at
    first, _ = one_by_one(element, count, kinds, body, at, 1)
    row: list[tuple] = []
    for name, (size, kind) in kinds.items():
        row += [("n " + name, size), (name, kind, tuple(first[name][0]))] if size else [(name, kind)]
    if at + count * np.dtype(row).itemsize <= len(body):
        table = np.frombuffer(body, row, count, at)
        lists = {name: table["n " + name] for name, (size, _) in kinds.items() if size}
        if all((sizes == first[name][0]).all() for name, sizes in lists.items()):
            numbers = {name: table[name].reshape(-1) for name in kinds}
            found = {name: (sizes.astype(np.int64), numbers[name]) for name, sizes in lists.items()}
            return numbers | found, at + table.nbytes
    return one_by_one(element, count, kinds, body, at, count)


def one_by_one(element: str, count: int, kinds: dict, body: bytes, at: int, most: int) -> tuple[dict, int]:
    """The same as ``rows_of`` for the first ``most`` rows, row by row."""
    found: dict[str, list] = {name: [] for name in kinds}
    try:
        for _ in range(most):
            for name, (size, kind) in kinds.items():
                length = 1
                if size:
                    length = max(0, int(np.ndarray(1, size, body, at)[0]))
                    at += np.dtype(size).itemsize
                found[name].append(np.ndarray(length, kind, body, at))
                at += found[name][-1].nbytes
    except (ValueError, TypeError, OverflowError):
        rows = min(len(of) for of in found.values())
        raise InputError(f"the file is cut short: it announces {count} rows of {element} and has {rows}") from None
    numbers = {name: np.concatenate(rows) for name, rows in found.items()}
    lists = {name: np.array([len(row) for row in found[name]]) for name, (size, _) in kinds.items() if size}
    return numbers | {name: (sizes, numbers[name]) for name, sizes in lists.items()}, at


def mesh_of(elements: Elements, tables: dict, head: str, path: Path, notes: list[str]) -> Mesh:
    """The triangles of the elements vertex and face, with what their corners have."""
    vertex, face = tables.get("vertex", {}), tables.get("face", {})
    points, lists = columns(vertex, "xyz"), [face[name] for name in LISTS if name in face]
    if points is None or not lists:
        raise InputError("no triangles: vertices need x, y and z, and faces vertex_indices; strips are not read")
    sizes, ids = lists[0]
    corners, polygon_of = triangulate(points, sizes, ids.astype(np.int64))
    mesh = Mesh(points + 0.0, ids[corners].astype(np.int32), source=str(path))  # −0 becomes 0
    normals = columns(vertex, ("nx", "ny", "nz"))
    if normals is not None:
        mesh.normals, mesh.face_normals = normals, mesh.faces
    of_vertices, of_faces = (
        colours_of(tables.get(name, {}), elements.get(name, (0, {}))[1]) for name in ("vertex", "face")
    )
    if of_vertices is not None:
        mesh.corner_color = of_vertices[mesh.faces]
    elif of_faces is not None:
        mesh.corner_color = np.repeat(of_faces[polygon_of, None], 3, axis=1)
    picture, uv = picture_of(head, path, notes), uv_of(vertex, face, corners, mesh.faces, sizes)
    if uv is not None and picture is not None:
        mesh.corner_uv = uv
    if mesh.corner_color is not None or mesh.corner_uv is not None:
        mesh.materials = [Material(Kd=(1.0, 1.0, 1.0), map_Kd=None if mesh.corner_uv is None else picture)]
    return mesh


def columns(table: dict, names: Sequence[str]) -> np.ndarray | None:
    """(n, k) float64: the properties with these names; None if one of them is missing."""
    if not set(names) <= set(table):
        return None
    return np.stack([table[name] for name in names], axis=1).astype(np.float64)


def colours_of(table: dict, kinds: dict[str, tuple[str, str]]) -> np.ndarray | None:
    """(n, 3) linear colours from those in sRGB; None if there are none."""
    for names in COLOURS:
        colors = columns(table, names)
        if colors is not None:
            return linear_colors(colors.astype(kinds[names[0]][1]))
    return None


def uv_of(vertex: dict, face: dict, corners: np.ndarray, faces: np.ndarray, sizes: np.ndarray) -> np.ndarray | None:
    """(F, 3, 2) texture coordinates: of the faces' corners, or of the vertices; None if there are none."""
    counts, of_corners = face.get("texcoord", (np.zeros(0), None))
    if of_corners is not None and np.array_equal(counts, 2 * sizes):
        return of_corners.reshape(-1, 2).astype(np.float64)[corners]
    uv = next((uv for names in COORDINATES if (uv := columns(vertex, names)) is not None), None)
    return None if uv is None else uv[faces]


def picture_of(head: str, path: Path, notes: list[str]) -> Texture | None:
    """The picture that a comment names; a note if it cannot be read."""
    named = TEXTURE.search(head)
    if named is None:
        return None
    try:
        return Texture(np.asarray(read_image(path.parent / named[1].strip(), srgb=True)), source=named[1].strip())
    except (InputError, MissingFileError, OSError) as error:
        notes.append(f"the texture is not used: {error}")
        return None
