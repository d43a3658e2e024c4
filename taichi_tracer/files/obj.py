"""Wavefront OBJ: triangles in the file's order, exact floats, materials by first use (A1-17, C-16, C-18).

Lines are sorted by keyword and parsed in one go for each keyword and shape. Whatever does not have the common shape is
parsed line by line, which gives the same result and knows the line of every error.
"""

import warnings
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from taichi_tracer.errors import InputError
from taichi_tracer.files.mtl import find_library, read_mtl
from taichi_tracer.files.text import logical_lines, number, read_text
from taichi_tracer.geometry import Mesh
from taichi_tracer.materials import Material

SPACE, TAB, NEWLINE, SLASH, COMMENT = b" \t\n/#"
PARTS_OF_STYLE = {"v": 1, "v/t": 2, "v//n": 2, "v/t/n": 3}


@dataclass
class Statements:
    """Lines of one keyword without it, and their line numbers."""

    lines: list[str] = field(default_factory=list)
    numbers: list[int] = field(default_factory=list)


def read_obj(path: str | Path) -> Mesh:
    """Read an OBJ file and its material libraries.

    Polygons become fans of triangles; negative indices count back from where they stand; faces before the first
    ``usemtl`` get the material "default". Groups, smoothing groups, texture coordinates, lines and points are ignored.

    Raises:
        InputError: with file, line and value, for what cannot be used.
    """
    path = Path(path)
    statements = _sort_lines(read_text(path))
    vertices = _rows(statements["v"], path)
    normals = _rows(statements["vn"], path)
    corners = _Corners(statements["f"], path)
    counts = {
        "vertex": (len(vertices), statements["v"], "vertices"),
        "normal": (len(normals), statements["vn"], "normals"),
    }
    faces = _resolve(corners.vertex, corners.line, counts["vertex"], "vertex", path)
    face_normals = np.zeros((0, 3), np.int32)
    if corners.normal is not None:
        face_normals = _resolve(corners.normal, corners.line, counts["normal"], "normal", path)
    face_materials, materials = _materials(statements, corners.line, path)
    return Mesh(
        vertices=vertices,
        faces=faces,
        normals=normals if len(face_normals) > 0 else np.zeros((0, 3)),
        face_normals=face_normals,
        face_materials=face_materials,
        materials=materials,
        source=str(path),
    )


def _sort_lines(text: str) -> dict[str, Statements]:
    """Lines by keyword; those of other keywords are left out."""
    kept = {keyword: Statements() for keyword in ("v", "vn", "f", "usemtl", "mtllib")}
    v, vn, f = kept["v"], kept["vn"], kept["f"]
    lines = logical_lines(text) if "\\\n" in text else enumerate(text.split("\n"), 1)
    for line_number, line in lines:
        start = line[:2]
        if start == "f ":
            f.lines.append(line[2:])
            f.numbers.append(line_number)
        elif start == "v ":
            v.lines.append(line[2:])
            v.numbers.append(line_number)
        elif start == "vn" and line[2:3] == " ":
            vn.lines.append(line[3:])
            vn.numbers.append(line_number)
        elif start not in ("vt", "", "# ", "g ", "s ", "o "):
            words = line.split(None, 1)
            if words and words[0] in kept:
                kept[words[0]].lines.append(words[1] if len(words) > 1 else "")
                kept[words[0]].numbers.append(line_number)
    return kept


def _token_counts(joined: np.ndarray) -> np.ndarray:
    """Words on each line of text that ends with a newline, given as bytes."""
    is_end = joined == NEWLINE
    is_gap = is_end | (joined == SPACE) | (joined == TAB)
    is_start = ~is_gap
    is_start[1:] &= is_gap[:-1]
    return _per_line(is_start, is_end)


def _per_line(what: np.ndarray, is_end: np.ndarray) -> np.ndarray:
    """How often something is true on each line."""
    before_end = np.searchsorted(np.flatnonzero(what), np.flatnonzero(is_end))
    return np.diff(before_end, prepend=0)


def _as_bytes(lines: list[str]) -> np.ndarray:
    """Lines as one array of bytes; a character beyond ASCII counts as one that no number has."""
    return np.frombuffer(("\n".join(lines) + "\n").encode("ascii", "replace"), np.uint8)


def _parse(lines: list[str], dtype: type, separators: str = "") -> np.ndarray | None:
    """Every number of some lines in a row, or None where something is not a number."""
    text = " ".join(lines)
    for separator in separators:
        text = text.replace(separator, " ")
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        try:
            return np.fromstring(text, dtype, sep=" ")
        except (DeprecationWarning, ValueError):
            return None


def _rows(statements: Statements, path: Path) -> np.ndarray:
    """(n, 3) float64 from ``v`` or ``vn`` lines; what follows the third number (w, colours) is ignored."""
    if not statements.lines:
        return np.zeros((0, 3))
    counts = _token_counts(_as_bytes(statements.lines))
    width = int(counts[0])
    if width >= 3 and (counts == width).all():
        numbers = _parse(statements.lines, np.float64)
        if numbers is not None and numbers.size == width * len(statements.lines):
            return np.ascontiguousarray(numbers.reshape(-1, width)[:, :3])
    return np.array([_row(line, f"{path}:{n}") for line, n in zip(statements.lines, statements.numbers, strict=True)])


def _row(line: str, where: str) -> list[float]:
    words = line.split("#", 1)[0].split()
    if len(words) < 3:
        raise InputError(f"{where}: 3 numbers are needed, not {len(words)}")
    return [number(word, where) for word in words[:3]]


class _Corners:
    """The corners of all triangles as the file writes them: 1-based, negative from the end, 0 for absent.

    Attributes:
        vertex: (F, 3) int64. normal: the same, or None when no face has any. line: (F,) line numbers.
    """

    def __init__(self, statements: Statements, path: Path) -> None:
        count = len(statements.lines)
        sizes, styles = _shapes(statements.lines)
        triangles_of = np.maximum(sizes - 2, 0)
        first = np.cumsum(triangles_of) - triangles_of
        total = int(triangles_of.sum())
        self.vertex = np.zeros((total, 3), np.int64)
        normal = np.zeros((total, 3), np.int64)
        self.line = np.repeat(np.asarray(statements.numbers, np.int64).reshape(count), triangles_of)
        has_normals = False
        for size, style in sorted({*zip(sizes.tolist(), styles.tolist(), strict=True)}):
            chosen = np.flatnonzero((sizes == size) & (styles == style))
            lines = statements.lines if len(chosen) == count else [statements.lines[i] for i in chosen]
            polygons = _polygons(lines, size, style)
            if polygons is None:
                numbers = [statements.numbers[i] for i in chosen]
                polygons = np.array([_polygon(*pair, path) for pair in zip(lines, numbers, strict=True)])
            has_normals |= bool((polygons[..., 1] != 0).any())
            for k in range(size - 2):
                rows = first[chosen] + k
                fan = polygons[:, (0, k + 1, k + 2)]
                self.vertex[rows], normal[rows] = fan[..., 0], fan[..., 1]
        self.normal = normal if has_normals else None


def _shapes(lines: list[str]) -> tuple[np.ndarray, np.ndarray]:
    """Corners and style of every face line; style "?" where only a careful look can tell."""
    if not lines:
        return np.zeros(0, np.int64), np.zeros(0, "U5")
    joined = _as_bytes(lines)
    is_end, is_slash = joined == NEWLINE, joined == SLASH
    sizes = _token_counts(joined)
    slashes = _per_line(is_slash, is_end)
    is_double = is_slash.copy()
    is_double[1:] &= is_slash[:-1]
    is_double[0] = False
    doubles = _per_line(is_double, is_end)
    styles = np.full(len(lines), "?", "U5")
    styles[slashes == 0] = "v"
    styles[(slashes == sizes) & (doubles == 0)] = "v/t"
    styles[(slashes == 2 * sizes) & (doubles == sizes)] = "v//n"
    styles[(slashes == 2 * sizes) & (doubles == 0)] = "v/t/n"
    odd = np.flatnonzero((styles == "?") | (sizes < 3) | (_per_line(joined == COMMENT, is_end) > 0))
    styles[odd] = "?"
    for i in odd:  # a comment on the line is no corner
        sizes[i] = max(len(lines[i].split("#", 1)[0].split()), 3)
    return sizes.astype(np.int64), styles


def _polygons(lines: list[str], size: int, style: str) -> np.ndarray | None:
    """(n, size, 2) vertex and normal index of faces of one shape, or None where they are not."""
    if style == "?":
        return None
    numbers = _parse(lines, np.int64, "/")
    parts = PARTS_OF_STYLE[style]
    if numbers is None or numbers.size != len(lines) * size * parts:
        return None
    corners = numbers.reshape(len(lines), size, parts)
    if (corners == 0).any():
        return None
    normal = corners[..., -1] if style.endswith("n") else np.zeros_like(corners[..., 0])
    return np.stack([corners[..., 0], normal], axis=-1)


def _polygon(line: str, line_number: int, path: Path) -> list[tuple[int, int]]:
    """Vertex and normal index (0 for none) of every corner of one face."""
    where = f"{path}:{line_number}"
    words = line.split("#", 1)[0].split()
    if len(words) < 3:
        raise InputError(f"{where}: a face needs at least 3 corners, not {len(words)}")
    return [_corner(word, where) for word in words]


def _corner(word: str, where: str) -> tuple[int, int]:
    parts = word.split("/")
    try:
        if len(parts) > 3 or "_" in word:
            raise ValueError
        ids = [0 if part == "" and i > 0 else int(part) for i, part in enumerate(parts)]
    except ValueError:
        raise InputError(f"{where}: {word!r} is not a corner: write v, v/vt, v//vn or v/vt/vn") from None
    if any(i == 0 and part != "" for i, part in zip(ids, parts, strict=True)):
        raise InputError(f"{where}: index 0 in {word!r}: OBJ indices start at 1")
    return ids[0], ids[2] if len(ids) == 3 else 0


def _resolve(ids: np.ndarray, line: np.ndarray, counted: tuple, what: str, path: Path) -> np.ndarray:
    """0-based int32 ids from the file's; −1 where there is none."""
    count, statements, plural = counted
    before = count
    if (ids < 0).any():
        before = np.searchsorted(np.asarray(statements.numbers), line)[:, None]
    resolved = np.where(ids > 0, ids - 1, np.where(ids < 0, before + ids, -1))
    wrong = (ids > count) | ((ids < 0) & (resolved < 0))
    if wrong.any():
        triangle, corner = np.argwhere(wrong)[0]
        raise InputError(
            f"{path}:{line[triangle]}: {what} index {ids[triangle, corner]} is out of range "
            f"(the file has {count} {plural})"
        )
    return resolved.astype(np.int32)


def _materials(
    statements: dict[str, Statements], face_line: np.ndarray, path: Path
) -> tuple[np.ndarray, list[Material]]:
    """(F,) material ids in order of first use, and the materials."""
    library: dict[str, Material] = {}
    for statement, line_number in zip(statements["mtllib"].lines, statements["mtllib"].numbers, strict=True):
        for mtl in find_library(statement.strip(), path, f"{path}:{line_number}"):
            library |= read_mtl(mtl)

    uses = statements["usemtl"]
    names = [name.strip() for name in uses.lines]
    for name, line_number in zip(names, uses.numbers, strict=True):
        if name not in library:
            known = ", ".join(library) if library else "none, the file names no material library"
            raise InputError(f"{path}:{line_number}: unknown material {name!r}: known are {known}")
    use = np.searchsorted(np.asarray(uses.numbers, np.int64), face_line) - 1  # −1: before the first usemtl
    position = {name: i for i, name in enumerate(dict.fromkeys(names))}
    by_use = np.array([position[name] for name in names] + [len(position)])  # the last serves use −1
    wanted = by_use[use]
    used, first = np.unique(wanted, return_index=True)
    in_order = used[np.argsort(first)]
    id_of = np.zeros(len(position) + 1, np.int32)
    id_of[in_order] = np.arange(len(in_order))
    all_materials = [library[name] for name in position] + [Material()]
    return id_of[wanted], [all_materials[i] for i in in_order] or [Material()]
