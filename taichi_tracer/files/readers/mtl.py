"""Wavefront MTL: the materials of an OBJ file (A1-17)."""

import os
import re
from dataclasses import replace
from pathlib import Path

import numpy as np

from taichi_tracer.files.images import read_image, read_opacity
from taichi_tracer.files.readers.text import name_in, names_in, number, numbered_lines, read_text
from taichi_tracer.materials import Material, Texture
from taichi_tracer.system.errors import InputError, MissingFileError

COLORS = {"kd": "Kd", "ka": "Ka", "ks": "Ks", "ke": "Ke", "f0": "F0", "km": "Km"}
REFLECTANCES = ("Kd", "Ks", "F0", "Km")
NOT_NEGATIVE = (*COLORS, "alpha_x", "alpha_y")
NUMBERS = {"ns": "Ns", "ni": "Ni", "d": "d", "alpha_x": "alpha_x", "alpha_y": "alpha_y"}
# An option of a texture, with its values: on, off, the letter of a channel, or up to three numbers.
VALUE = r"(?:on|off|[rgbmlz]|[-+]?(?:\d+\.?\d*|\.\d+)(?:e[-+]?\d+)?)(?:\s+|$)"
OPTION = re.compile(rf"(-[a-z]+)\s+((?:{VALUE}){{1,3}})", re.IGNORECASE)
TEXTURES = {"map_kd": "map_Kd", "map_ks": "map_Ks", "map_d": "map_d"}  # keywords, and members of ``Material``
MAPS = ("map_", "bump", "disp", "decal", "refl", "norm")


def read_mtl(path: str | Path, notes: list[str]) -> dict[str, Material]:
    """Name → material for every ``newmtl``. If two have the same name, the last one is used.

    Args:
        path: the file.
        notes: a list to which lines are added: about maps other than ``TEXTURES``, which are not used, and about images
            that cannot be read.

    Raises:
        InputError: a value is not a number; the message has the file and the line.
    """
    materials: dict[str, Material] = {}
    maps: dict[str, int] = {}  # key → the first line that has it
    images: dict[tuple, Texture | None] = {}
    above: dict[str, str] = {}  # reflectance → where it is above 1 first
    name = None
    for line_number, line in numbered_lines(read_text(path)):
        words = line.split("#", 1)[0].split()
        if not words:
            continue
        where = f"{path}:{line_number}"
        keyword = words[0].lower()
        if keyword == "newmtl":
            name = name_in(line.strip()[len("newmtl") :])
            materials[name] = Material(name=name)
        elif keyword in COLORS or keyword in NUMBERS or keyword == "tr":
            if name is None:
                raise InputError(f"{where}: {words[0]} stands before the first newmtl")
            values = _values(keyword, words, where)
            materials[name] = replace(materials[name], **values)
            if COLORS.get(keyword) in REFLECTANCES and max(values[COLORS[keyword]]) > 1:
                above.setdefault(words[0], f"{where}: {line.split('#', 1)[0].strip()} is above 1")
        elif keyword in TEXTURES and name is not None:
            read = _texture(line, Path(path), where, notes, images)
            materials[name] = replace(materials[name], **{TEXTURES[keyword]: read})
        elif keyword.startswith(MAPS):
            maps.setdefault(words[0], line_number)
        elif name is not None and (extra := _numbers_of(words[1:])):
            materials[name] = replace(materials[name], extra={**materials[name].extra, keyword: extra})
    notes += [f"{text}: the surface reflects more than it receives" for text in above.values()]
    notes += [f"{path}:{line}: {word} is not used, here and in later lines" for word, line in maps.items()]
    return materials


def _texture(line: str, mtl: Path, where: str, notes: list[str], images: dict) -> Texture | None:
    """The texture of a line ``map_Kd [options] file``; None, with a note, if it cannot be read."""
    keyword, rest = line.split(None, 1) if len(line.split()) > 1 else (line.strip(), "")
    wrap, ignored, is_opacity = "repeat", [], keyword.lower() == "map_d"
    while option := OPTION.match(rest):
        rest = rest[option.end() :]
        if option[1] == "-clamp":
            wrap = "clamp" if option[2].strip() == "on" else "repeat"
        else:
            ignored.append(option[1])
    names = [name.replace("\\", "/") for name in names_in(rest)]
    file = next((name for name in names if os.path.isfile(mtl.parent / name)), names[0])
    if ignored:
        notes.append(f"{where}: options of a texture are not used: {', '.join(ignored)}")
    key = file, wrap, is_opacity
    if key not in images:
        try:
            if not file:
                raise InputError("the name of a file is missing")
            pixels = read_opacity(mtl.parent / file) if is_opacity else read_image(mtl.parent / file, srgb=True)
            images[key] = Texture(np.asarray(pixels), (wrap, wrap), file)
        except (InputError, OSError) as error:
            notes.append(f"{where}: the texture is not used: {error}")
            images[key] = None
    return images[key]


def _values(keyword: str, words: list[str], where: str) -> dict:
    """The field of ``Material`` that a line sets, with its value."""
    if keyword == "d" and words[1:2] == ["-halo"]:
        words = [words[0], *words[2:]]
    values = [number(word, where) for word in words[1:]]
    if keyword in NOT_NEGATIVE and min(values, default=0) < 0:
        raise InputError(f"{where}: {words[0]} must not be negative: {' '.join(words[1:])}")
    if keyword in COLORS:
        if len(values) not in (1, 3):
            raise InputError(f"{where}: {words[0]} needs 1 or 3 numbers, not {len(values)}")
        return {COLORS[keyword]: tuple(values * 3 if len(values) == 1 else values)}
    if len(values) != 1:
        raise InputError(f"{where}: {words[0]} needs 1 number, not {len(values)}")
    return {"d": 1.0 - values[0]} if keyword == "tr" else {NUMBERS[keyword]: values[0]}


def _numbers_of(words: list[str]) -> tuple[float, ...]:
    """The numbers of an unknown key, which a BRDF may need; empty if a value is not a finite number."""
    try:
        return tuple(number(word, "") for word in words)
    except InputError:
        return ()


def find_library(statement: str, beside: Path, where: str) -> list[Path]:
    """The files that an ``mtllib`` line names: one file, whose name may contain blanks, or several files."""
    folder = beside.parent
    for names in [*([name] for name in names_in(statement)), name_in(statement).split()]:
        paths = [folder / name.replace("\\", "/") for name in names]
        if names and all(path.is_file() for path in paths):
            return paths
    beside_it = ", ".join(sorted(p.name for p in folder.iterdir() if p.suffix.lower() == ".mtl")) or "no .mtl file"
    raise MissingFileError(
        f"{where}: material library {statement!r} not found beside the file (looked in {folder.resolve()}: {beside_it})"
    )
