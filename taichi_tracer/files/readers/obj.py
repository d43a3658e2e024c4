"""Wavefront OBJ: triangles in the file's order, exact floats, materials by first use (A1-17, C-16, C-18).

All lines with the same keyword are parsed together. If this fails, half of them are parsed, and so on, to find the line
of the error.
"""

import io
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from taichi_tracer.files.images import linear_colors
from taichi_tracer.files.readers.mtl import find_library, read_mtl
from taichi_tracer.files.readers.text import (
    NEWLINE,
    SLASH,
    SPACES,
    KeywordLines,
    Lines,
    all_numbers,
    decode,
    name_in,
    read_text,
)
from taichi_tracer.geometry import Mesh
from taichi_tracer.materials import Material
from taichi_tracer.meshes.polygons import triangulate
from taichi_tracer.system.errors import InputError, MissingFileError

DIGIT = ord("0")
# The classes of characters: blanks, slashes, line ends, and 0 for all others.
KINDS = bytes(c if c in b"\n/" else ord(" ") if c in SPACES else DIGIT for c in range(256))
FACE = "a face needs at least 3 corners v, v/vt, v//vn or v/vt/vn, and no index is 0"
LONGEST_NORMAL = 1e20  # the square of a longer one is no number of f32


def read_obj(path: str | Path) -> Mesh:
    """Read an OBJ file and its material libraries.

    Polygons become fans of triangles, concave ones ears. Negative indices count backwards from the line in which they
    stand. Faces before the first ``usemtl`` get the material "default". Texture coordinates are read if a material has
    a texture; colours of vertices, if all have one. Groups, smoothing groups, lines and points are ignored.

    Raises:
        InputError: something cannot be used; the message has file, line and value. A joined line has the number of its
            first part.
    """
    path = Path(path)
    lines = Lines(read_text(path))
    positions = lines.take(b"v")
    directions = lines.take(b"vn")
    faces = lines.take(b"f")

    sizes, ids = _parsed(_polygons, faces, FACE, path)
    vertex_ids = _resolve(ids[:, 0], sizes, faces, positions, "vertex", path)
    vertices = _rows(positions, path)
    corners, polygon_of = triangulate(vertices, sizes, vertex_ids)
    normal_ids = _resolve(ids[:, 2], sizes, faces, directions, "normal", path)
    notes: list[str] = []
    normals = _rows(directions, path)
    _leave_out_wild(normals, normal_ids, path, notes)
    has_normals = bool((normal_ids >= 0).any())
    material_ids, materials = _materials(lines, faces.ids, path, notes)
    has_textures = any(material.textures for material in materials)
    colors = _colors(positions, path, notes)
    if colors is not None:
        white = {"Kd": (1.0, 1.0, 1.0)}
        materials = [replace(one, **white) if replace(one, name="default") == Material() else one for one in materials]
    return Mesh(
        vertices=vertices,
        faces=vertex_ids[corners],
        normals=normals if has_normals else np.zeros((0, 3)),
        face_normals=normal_ids[corners] if has_normals else np.zeros((0, 3), np.int32),
        face_materials=material_ids[polygon_of],
        materials=materials,
        source=str(path),
        notes=notes,
        corner_color=None if colors is None else colors[vertex_ids[corners]],
        corner_uv=_coordinates(lines, ids[:, 1], sizes, faces, path)[corners] if has_textures else None,
    )


def _leave_out_wild(normals: np.ndarray, ids: np.ndarray, path: Path, notes: list[str]) -> None:
    """Corners whose normal is not finite or too long have none: the geometric one is used."""
    is_usable = (abs(normals) <= LONGEST_NORMAL).all(axis=1)
    is_wrong = (ids >= 0) & ~np.append(is_usable, True)[ids]
    if is_wrong.any():
        wild = f"{len(np.unique(ids[is_wrong]))} normals are not finite or longer than {LONGEST_NORMAL:g}"
        notes.append(f"{path}: {wild}: the geometric normal is used")
        normals[~is_usable], ids[is_wrong] = 0.0, -1


def _colors(positions: KeywordLines, path: Path, notes: list[str]) -> np.ndarray | None:
    """(V, 3) linear colours, from x y z r g b in sRGB, from 0 to 1 or to 255; None if a vertex has none."""
    rows = _table(positions.text, 6)
    if rows is None:
        if len(positions.text.partition(b"\n")[0].split()) >= 6:
            notes.append(f"{path}: colours of vertices are not used: x y z r g b is needed in every v line")
        return None
    return linear_colors(rows[:, 3:])


def _coordinates(lines: Lines, ids: np.ndarray, sizes: np.ndarray, faces: KeywordLines, path: Path) -> np.ndarray:
    """(corners, 2) the texture coordinates of all corners of all polygons; 0 for a corner that has none."""
    block = lines.take(b"vt")
    rows = np.concatenate([_rows(block, path, "u v"), np.zeros((1, 2))])  # the last one for −1
    return rows[_resolve(ids, sizes, faces, block, "texture coordinate", path)]


def _parsed(parse: Callable[[bytes], Any], block: KeywordLines, needed: str, path: Path) -> Any:
    """What ``parse`` makes of all lines together; an InputError names the first line of which it makes nothing."""
    found = parse(block.text)
    if found is None:
        lines, first, last = block.text.split(b"\n"), 0, len(block)
        while last - first > 1:  # the first wrong line is one of these
            middle = (first + last) // 2
            is_before = parse(b"\n".join([*lines[first:middle], b""])) is None
            first, last = (first, middle) if is_before else (middle, last)
        line = decode(lines[first]).strip()[:80]
        raise InputError(f"{path}:{block.numbers[first]}: {line!r} cannot be read: {needed}")
    return found


def _rows(block: KeywordLines, path: Path, names: str = "x y z") -> np.ndarray:
    """(n, 3 or 2) float64 from ``v``, ``vn`` or ``vt`` lines. What follows (w, colours) is ignored."""
    return _parsed(lambda text: _table(text, len(names.split())), block, f"the numbers {names} are needed", path)


def _table(text: bytes, count: int) -> np.ndarray | None:
    """(n, count) float64, the first numbers of each line; None if a line has fewer, or other words."""
    if not text:
        return np.zeros((0, count))
    try:
        rows = np.loadtxt(io.BytesIO(text.replace(b"\r", b" ")), comments=None, usecols=range(count), ndmin=2)
    except ValueError:
        return None
    return rows if len(rows) == text.count(b"\n") else None


def _polygons(lines: bytes) -> tuple[np.ndarray, np.ndarray] | None:
    """(P,) the numbers of corners of all faces; and (C, 3) of each corner, as the file counts them, 0 for none: vertex,
    texture coordinate and normal. None if a line is not a face.

    A number belongs to the corner that begins after the last blank. How many slashes stand before it in its corner says
    what it is.
    """
    kinds = lines.translate(KINDS)
    text = np.frombuffer(kinds, np.uint8)
    is_digit = text == DIGIT
    starts = 1 + np.flatnonzero(is_digit[1:] > is_digit[:-1])  # of numbers; every line begins with a blank
    numbers = all_numbers(lines.replace(b"/", b" "), np.int64)
    if numbers is None or len(numbers) != len(starts) or b" /" in kinds or b"///" in kinds:
        return None
    follows = text[starts - 1] == SLASH
    begins = np.flatnonzero(~follows)
    sizes = np.diff(np.searchsorted(starts[begins], np.flatnonzero(text == NEWLINE)), prepend=0)
    slashes = np.cumsum(np.add(follows, follows & (text[starts - 2] == SLASH), dtype=np.int32))
    corner = np.cumsum(~follows) - 1
    place = slashes - slashes[begins][corner]
    if sizes.min(initial=3) < 3 or not numbers.all() or place.max(initial=0) > 2:
        return None
    corners = np.zeros((len(begins), 3), np.int64)
    corners[corner, place] = numbers
    return sizes, corners


def _resolve(
    ids: np.ndarray, sizes: np.ndarray, faces: KeywordLines, of: KeywordLines, what: str, path: Path
) -> np.ndarray:
    """int32 ids that count from 0, from the indices of the file; −1 for none."""
    count, before = len(of), np.zeros(1, int)
    if ids.min(initial=0) < 0:
        before = np.repeat(np.searchsorted(of.ids, faces.ids), sizes)
    resolved = np.where(ids < 0, before + ids, ids - 1)
    wrong = np.flatnonzero((ids > count) | ((ids < 0) & (resolved < 0)))
    if len(wrong) > 0:
        index, line = ids[wrong[0]], faces.numbers[np.repeat(np.arange(len(sizes)), sizes)[wrong[0]]]
        plural = "vertices" if what == "vertex" else f"{what}s"
        has = f"the file has {count} {plural}" if index > 0 else f"{before[wrong[0]]} {plural} stand before it"
        raise InputError(f"{path}:{line}: {what} index {index} is out of range ({has})")
    return resolved.astype(np.int32)


def _materials(lines: Lines, face_ids: np.ndarray, path: Path, notes: list[str]) -> tuple[np.ndarray, list[Material]]:
    """(P,) the material id of each face, and the materials in the order of their first use (C-16).

    A material that no library has is grey, and a note names it, or the library that is missing.
    """
    library: dict[str, Material] = {}
    is_complete, mtllib = True, lines.take(b"mtllib", has_names=True)
    for line_number, line in zip(mtllib.numbers, mtllib.lines(), strict=True):
        try:
            for mtl in find_library(line.strip(), path, f"{path}:{line_number}"):
                library |= read_mtl(mtl, notes)
        except MissingFileError as error:
            is_complete = False
            notes.append(f"{error}: its materials are grey (Kd 0.8)")

    usemtl = lines.take(b"usemtl", has_names=True)
    names = [name_in(line) for line in usemtl.lines()]
    position = {name: k for k, name in enumerate(dict.fromkeys(names), start=1)}
    unknown = [name for name in position if name not in library]
    if unknown and is_complete:
        where, known = f"{path}:{usemtl.numbers[names.index(unknown[0])]}", ", ".join(library) or "none"
        notes.append(f"{where}: unknown material {', '.join(map(repr, unknown))}: grey (Kd 0.8); known are {known}")
    candidates = [Material(), *(library.get(name, Material(name=name)) for name in position)]
    by_statement = np.array([0, *(position[name] for name in names)])  # 0: faces before the first usemtl

    wanted = by_statement[np.searchsorted(usemtl.ids, face_ids)]
    used, first_face, ids = np.unique(wanted, return_index=True, return_inverse=True)
    order = np.argsort(first_face)
    return np.argsort(order)[ids].astype(np.int32), [candidates[used[i]] for i in order] or [Material()]
