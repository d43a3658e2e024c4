"""PLY files: binary and text, with triangles and polygons, normals, colours, and the picture that a comment names."""

import re
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from taichi_tracer.files.images import read_image
from taichi_tracer.files.readers.text import all_numbers
from taichi_tracer.files.srgb import linear_from_srgb
from taichi_tracer.geometry import Mesh
from taichi_tracer.materials import Material
from taichi_tracer.meshes.polygons import triangulate
from taichi_tracer.system.errors import InputError, MissingFileError
from taichi_tracer.textures import Texture

TYPES = {"char": "i1", "uchar": "u1", "short": "i2", "ushort": "u2", "int": "i4", "uint": "u4"}
TYPES |= {"float": "f4", "double": "f8", "int8": "i1", "uint8": "u1", "int16": "i2", "uint16": "u2"}
TYPES |= {"int32": "i4", "uint32": "u4", "float32": "f4", "float64": "f8", "int64": "i8", "uint64": "u8"}
ORDERS = {"ascii": "", "binary_little_endian": "<", "binary_big_endian": ">"}
HEADER_END = re.compile(rb"^end_header[ \t]*(?:\r\n|\n|\r)", re.MULTILINE)
TEXTURE = re.compile(r"^comment\s+TextureFile\s+(.+)$", re.MULTILINE | re.IGNORECASE)
LISTS = ("vertex_indices", "vertex_index")  # the names of a face's list of vertex ids
COORDINATES = (("texture_u", "texture_v"), ("u", "v"), ("s", "t"))  # the names of a vertex's texture coordinates
COLOURS = (("red", "green", "blue"), ("diffuse_red", "diffuse_green", "diffuse_blue"), ("r", "g", "b"))
LARGEST = 255  # of colours that are floating point and above 1


@dataclass
class Element:
    """An element of the header; ``properties``: name → (type of the count of a list, or "" for one number; type)."""

    name: str
    count: int
    properties: dict[str, tuple[str, str]] = field(default_factory=dict)


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
    for element in elements:
        kinds = {name: tuple(one and order + one for one in of) for name, of in element.properties.items()}
        if is_text:
            kinds = {name: (count and "f8", "f8") for name, (count, _) in kinds.items()}
        tables[element.name], at = rows_of(element, kinds, body, at)
    if at < len(body):
        rest = f"{(len(body) - at) // 8} numbers" if is_text else f"{len(body) - at} bytes"
        notes.append(f"{rest} after the last element are not read")
    return mesh_of(elements, tables, head, path, notes)


def elements_of(head: str) -> tuple[str, list[Element]]:
    """The order of bytes ("" for text) and the elements of a header."""
    order, elements = None, []
    for line in head.splitlines():
        words = line.split()
        try:
            if words[:1] == ["format"]:
                order = ORDERS[words[1]]
            elif words[:1] == ["element"]:
                elements.append(Element(words[1], int(words[2])))
            elif words[:2] == ["property", "list"]:
                elements[-1].properties[words[4]] = TYPES[words[2]], TYPES[words[3]]
            elif words[:1] == ["property"]:
                elements[-1].properties[words[2]] = "", TYPES[words[1]]
        except (LookupError, ValueError):
            raise InputError(f"the line {line!r:.80} of the header cannot be read") from None
    if order is None:
        raise InputError(f"its format must be one of {', '.join(ORDERS)}")
    return order, elements


def rows_of(element: Element, kinds: dict, body: bytes, at: int) -> tuple[dict, int]:
    """Name → (n,) numbers, or (sizes, all numbers) of a list; and the byte after the element.

    Usually, all lists have as many numbers as those of the first row: the rows are an array then.
    """
    if not kinds or element.count <= 0:
        return {}, at
    first, _ = one_by_one(element, kinds, body, at, 1)
    row: list[tuple] = []
    for name, (count, kind) in kinds.items():
        row += [("n " + name, count)] * bool(count) + [(name, kind, (len(first[name][0]),))]
    if at + element.count * np.dtype(row).itemsize <= len(body):
        table = np.frombuffer(body, row, element.count, at)
        if all((table["n " + name] == len(first[name][0])).all() for name, (count, _) in kinds.items() if count):
            at += table.nbytes
            return {name: listed(table[name], kinds[name][0]) for name in kinds}, at
    found, at = one_by_one(element, kinds, body, at, element.count)
    return {name: listed(rows, kinds[name][0]) for name, rows in found.items()}, at


def listed(rows: Any, is_list: str) -> Any:
    """(n,) numbers; of a list, its (n,) sizes and all its numbers."""
    numbers = rows.reshape(-1) if isinstance(rows, np.ndarray) else np.concatenate(rows)
    if not is_list:
        return numbers
    is_table = isinstance(rows, np.ndarray)
    return np.full(len(rows), rows.shape[1]) if is_table else np.array([len(row) for row in rows]), numbers


def one_by_one(element: Element, kinds: dict, body: bytes, at: int, count: int) -> tuple[dict[str, list], int]:
    """Name → the arrays of the rows; and the byte after them."""
    found: dict[str, list] = {name: [] for name in kinds}
    try:
        for _ in range(count):
            for name, (of_count, kind) in kinds.items():
                length = 1
                if of_count:
                    length = int(np.frombuffer(body, of_count, 1, at)[0])
                    at += np.dtype(of_count).itemsize
                if length > 0:
                    found[name].append(np.frombuffer(body, kind, length, at))
                    at += found[name][-1].nbytes
                else:
                    found[name].append(np.zeros(0, kind))
    except (ValueError, OverflowError):
        rows = min(len(of) for of in found.values())
        problem = f"it announces {element.count} rows of {element.name} and has {rows}"
        raise InputError(f"the file is cut short: {problem}") from None
    return found, at


def mesh_of(elements: list[Element], tables: dict, head: str, path: Path, notes: list[str]) -> Mesh:
    """The triangles of the elements vertex and face, with what their corners have."""
    vertex, face = tables.get("vertex", {}), tables.get("face", {})
    if not set("xyz") <= set(vertex) and face:
        raise InputError("its vertices need the properties x, y and z")
    lists = [face[name] for name in LISTS if name in face]
    if not lists:
        strips = "it has triangle strips, which are not read: export it with triangles" if "tristrips" in tables else ""
        raise InputError(strips or "the file has no triangles")
    points = np.stack([vertex[name] for name in "xyz"], axis=1).astype(np.float64) + 0.0  # −0 becomes 0
    sizes, ids = lists[0]
    is_face = sizes >= 3
    if not is_face.all():
        notes.append(f"{(~is_face).sum()} faces with fewer than 3 corners are left out")
    is_corner = np.repeat(is_face, sizes)
    corners, polygon_of = triangulate(points, sizes[is_face], ids[is_corner].astype(np.int64))
    corners, polygon_of = np.flatnonzero(is_corner)[corners], np.flatnonzero(is_face)[polygon_of]
    mesh = Mesh(points, ids[corners].astype(np.int32), source=str(path))
    if {"nx", "ny", "nz"} <= set(vertex):
        mesh.normals = np.stack([vertex[name] for name in ("nx", "ny", "nz")], axis=1).astype(np.float64)
        mesh.face_normals = mesh.faces
    kinds = {element.name: element.properties for element in elements}
    of_vertices, of_faces = colours_of(vertex, kinds.get("vertex", {})), colours_of(face, kinds.get("face", {}))
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


def colours_of(table: dict, kinds: dict) -> np.ndarray | None:
    """(n, 3) linear colours from those in sRGB; None if there are none."""
    for names in COLOURS:
        if set(names) <= set(table):
            colors = np.nan_to_num(np.stack([table[name] for name in names], axis=1).astype(np.float64))
            is_whole = kinds[names[0]][1][0] in "iu"
            most = np.iinfo(kinds[names[0]][1]).max if is_whole else LARGEST if (colors > 1).any() else 1
            return linear_from_srgb(np.clip(colors / most, 0, 1))
    return None


def uv_of(vertex: dict, face: dict, corners: np.ndarray, faces: np.ndarray, sizes: np.ndarray) -> np.ndarray | None:
    """(F, 3, 2) texture coordinates: of the faces' corners, or of the vertices; None if there are none."""
    counts, of_corners = face.get("texcoord", (np.zeros(0), None))
    if of_corners is not None and np.array_equal(counts, 2 * sizes):
        return of_corners.reshape(-1, 2).astype(np.float64)[corners]
    names = next((names for names in COORDINATES if set(names) <= set(vertex)), None)
    return None if names is None else np.stack([vertex[name] for name in names], axis=1).astype(np.float64)[faces]


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
