"""Wavefront MTL: the materials of an OBJ file (A1-17)."""

from dataclasses import replace
from pathlib import Path

from taichi_tracer.errors import InputError, MissingFileError
from taichi_tracer.files.text import logical_lines, number, read_text
from taichi_tracer.materials import Material

COLORS = {"kd": "Kd", "ka": "Ka", "ks": "Ks", "ke": "Ke", "f0": "F0"}
NUMBERS = {"ns": "Ns", "ni": "Ni", "d": "d", "alpha_x": "alpha_x", "alpha_y": "alpha_y"}


def read_mtl(path: Path) -> dict[str, Material]:
    """Name → material of every ``newmtl``; of two with one name the last counts. Texture maps are ignored.

    Raises:
        InputError: a value that is no number, with file and line.
    """
    materials: dict[str, Material] = {}
    name = None
    for line_number, line in logical_lines(read_text(path)):
        words = line.split("#", 1)[0].split()
        if not words:
            continue
        where = f"{path}:{line_number}"
        keyword = words[0].lower()
        if keyword == "newmtl":
            name = line.split(None, 1)[1].strip() if len(words) > 1 else ""
            if name == "":
                raise InputError(f"{where}: newmtl needs a name")
            materials[name] = Material(name=name)
        elif keyword in COLORS or keyword in NUMBERS or keyword == "tr":
            if name is None:
                raise InputError(f"{where}: {words[0]} stands before the first newmtl")
            materials[name] = replace(materials[name], **_values(keyword, words, where))
    return materials


def _values(keyword: str, words: list[str], where: str) -> dict:
    """The field of ``Material`` that a line sets."""
    if keyword in COLORS and len(words) > 1 and words[1].lower() in ("spectral", "xyz"):
        raise InputError(f"{where}: {words[0]} {words[1]} is not supported: give three numbers r g b")
    values = [number(word, where) for word in words[1:]]
    if keyword in COLORS:
        if len(values) not in (1, 3):
            raise InputError(f"{where}: {words[0]} needs 1 or 3 numbers, not {len(values)}")
        return {COLORS[keyword]: tuple(values * 3 if len(values) == 1 else values)}
    if len(values) != 1:
        raise InputError(f"{where}: {words[0]} needs 1 number, not {len(values)}")
    if keyword == "tr":
        return {"d": 1.0 - values[0]}
    return {NUMBERS[keyword]: values[0]}


def find_library(statement: str, beside: Path, where: str) -> list[Path]:
    """The files that an ``mtllib`` line names: one whose name may have spaces, or several."""
    folder = beside.parent
    for names in ([statement], statement.split()):
        paths = [folder / name.replace("\\", "/") for name in names]
        if all(path.is_file() for path in paths):
            return paths
    raise MissingFileError(f"{where}: material library {statement!r} not found in {folder}/")
