"""Wavefront OBJ: triangles in the file's order, exact floats, materials by first use (A1-17, C-16, C-18).

All lines with the same keyword are parsed together. If any of them is not well formed, they are parsed one by one. This
is slower, but it finds the line of the error.
"""

import io
import re
from dataclasses import replace
from pathlib import Path

import numpy as np

from taichi_tracer.files.images import linear_from_srgb
from taichi_tracer.files.readers.mtl import find_library, read_mtl
from taichi_tracer.files.readers.text import (
    NEWLINE,
    SLASH,
    SPACES,
    KeywordLines,
    Lines,
    all_numbers,
    name_in,
    number,
    read_text,
)
from taichi_tracer.geometry import Mesh
from taichi_tracer.materials import Material
from taichi_tracer.meshes.polygons import triangulate
from taichi_tracer.system.errors import InputError, MissingFileError

DIGIT = ord("0")
# The classes of characters: blanks, slashes, line ends, and 0 for all others.
KINDS = bytes(c if c in b"\n/" else ord(" ") if c in SPACES else DIGIT for c in range(256))
CORNER = re.compile(r"([+-]?\d+)(?:/([+-]?\d+)?(?:/([+-]?\d+)?)?)?", re.ASCII)  # v, v/vt, v//vn, v/vt/vn
INT64 = np.iinfo(np.int64)
COLOURED = (6, 7)  # numbers of a v line with a colour: x y z r g b, and alpha
LONGEST_NORMAL = 1e20  # the square of a longer one is no number of f32
IGNORED = ["o", "g", "s", "l", "p", "vt", "vp"]


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
    lines = Lines(_read(path))
    positions = lines.take(b"v").without_comments()
    directions = lines.take(b"vn").without_comments()
    faces = lines.take(b"f").without_comments()

    sizes, ids = _polygons_at_once(faces) or _polygons_one_by_one(faces, path)
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
    first, last = positions.text.partition(b"\n")[0], positions.text.rstrip().rpartition(b"\n")[2]
    most = max(len(line.split()) for line in (first, last))
    rows = _table(positions, COLOURED[0]) if most in COLOURED else None
    if rows is None and most >= COLOURED[0]:
        needed = "x y z r g b, or x y z r g b a, is needed in every v line"
        notes.append(f"{path}: colours of vertices are not used: {needed}")
    if rows is None:
        return None
    colors = np.nan_to_num(rows[:, 3:])
    return linear_from_srgb(np.clip(colors / (255 if (colors > 1).any() else 1), 0, 1))


def _coordinates(lines: Lines, ids: np.ndarray, sizes: np.ndarray, faces: KeywordLines, path: Path) -> np.ndarray:
    """(corners, 2) the texture coordinates of all corners of all polygons; 0 for a corner that has none."""
    block = lines.take(b"vt").without_comments()
    rows = np.concatenate([_rows(block, path, "u v"), np.zeros((1, 2))])  # the last one for −1
    return rows[_resolve(ids, sizes, faces, block, "texture coordinate", path)]


def _read(path: Path) -> bytes:
    """The text of a file; an InputError if it does not look like OBJ."""
    text = read_text(path)
    if not text.strip():
        raise InputError(f"{path}: the file is empty")
    known = "|".join(["#", *(rf"(?:{word})\s" for word in ("v", "vn", "f", "usemtl", "mtllib", *IGNORED))])
    if re.search(rf"^\s*(?:{known})".encode(), text, re.MULTILINE) is None:
        raise InputError(f"{path}: no line begins with v, f or another word of OBJ: this is some other kind of file")
    return text


def _rows(block: KeywordLines, path: Path, names: str = "x y z") -> np.ndarray:
    """(n, 3 or 2) float64 from ``v``, ``vn`` or ``vt`` lines. What follows (w, colours) is ignored."""
    count = len(names.split())
    rows = _table(block, count)
    if rows is not None:
        return rows
    found = []
    for line_number, line in zip(block.numbers.tolist(), block.lines(), strict=True):
        words, where = line.split(), f"{path}:{line_number}"
        if len(words) < count:
            raise InputError(f"{where}: {names} are needed, and there are {len(words)} numbers")
        found.append([number(word, where) for word in words[:count]])
    return np.array(found)


def _table(block: KeywordLines, count: int) -> np.ndarray | None:
    """(n, count) float64, the first numbers of each line; None if a line has fewer, or other words."""
    if len(block) == 0:
        return np.zeros((0, count))
    try:
        lines = io.BytesIO(block.text.replace(b"\r", b" "))
        rows = np.loadtxt(lines, comments=None, usecols=range(count), ndmin=2)
    except ValueError:
        return None
    return rows if len(rows) == len(block) else None


def _polygons_at_once(block: KeywordLines) -> tuple[np.ndarray, np.ndarray] | None:
    """(P,) the numbers of corners of all faces; and (C, 3) of each corner, as the file counts them, 0 for none: vertex,
    texture coordinate and normal. None if a line is not a face.

    A number belongs to the corner that begins after the last blank. How many slashes stand before it in its corner says
    what it is.
    """
    kinds = block.text.translate(KINDS)
    text = np.frombuffer(kinds, np.uint8)
    is_digit = text == DIGIT
    starts = 1 + np.flatnonzero(is_digit[1:] > is_digit[:-1])  # of numbers; every line begins with a blank
    numbers = all_numbers(block.text.replace(b"/", b" "), np.int64)
    if not kinds or numbers is None or len(numbers) != len(starts) or b" /" in kinds or b"///" in kinds:
        return None
    follows = text[starts - 1] == SLASH
    begins = np.flatnonzero(~follows)
    sizes = np.diff(np.searchsorted(starts[begins], np.flatnonzero(text == NEWLINE)), prepend=0)
    slashes = np.cumsum(np.add(follows, follows & (text[starts - 2] == SLASH), dtype=np.int32))
    corner = np.cumsum(~follows) - 1
    place = slashes - slashes[begins][corner]
    if sizes.min() < 3 or not numbers.all() or place.max() > 2:
        return None
    corners = np.zeros((len(begins), 3), np.int64)
    corners[corner, place] = numbers
    return sizes, corners


def _polygons_one_by_one(block: KeywordLines, path: Path) -> tuple[np.ndarray, np.ndarray]:
    """The same; the error names the line that is not a face."""
    sizes, corners = [], []
    for line_number, line in zip(block.numbers.tolist(), block.lines(), strict=True):
        where, words = f"{path}:{line_number}", line.split()
        if len(words) < 3:
            raise InputError(f"{where}: a face needs at least 3 corners, not {len(words)}")
        sizes.append(len(words))
        corners += [_corner(word, where) for word in words]
    return np.array(sizes, np.int64), np.array(corners, np.int64).reshape(-1, 3)


def _corner(word: str, where: str) -> list[int]:
    """The indices of vertex, texture coordinate and normal of ``v``, ``v/vt``, ``v//vn`` or ``v/vt/vn``; 0 for none."""
    match = CORNER.fullmatch(word)
    if match is None:
        raise InputError(f"{where}: {word!r} is not a corner: write v, v/vt, v//vn or v/vt/vn")
    if any(part is not None and int(part) == 0 for part in match.groups()):
        raise InputError(f"{where}: index 0 in {word!r}: OBJ indices start at 1")
    return [max(INT64.min, min(INT64.max, int(part or 0))) for part in match.groups()]


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
    is_complete, mtllib = True, lines.take(b"mtllib")
    for line_number, line in zip(mtllib.numbers, mtllib.lines(), strict=True):
        try:
            for mtl in find_library(line.strip(), path, f"{path}:{line_number}"):
                library |= read_mtl(mtl, notes)
        except MissingFileError as error:
            is_complete = False
            notes.append(f"{error}: its materials are grey (Kd 0.8)")

    usemtl = lines.take(b"usemtl")
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
