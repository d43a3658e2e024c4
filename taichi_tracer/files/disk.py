"""Reading and writing of whole files, with clear errors; a file is replaced only by a complete new file.

Also: where the scenes and environments are that come with the package.
"""

import contextlib
import os
import secrets
import stat
from collections.abc import Iterator
from pathlib import Path

from taichi_tracer.system import new_folders
from taichi_tracer.system.errors import InputError, MissingFileError

_noting: list[dict[Path, None]] = []  # for those who want to know which files are read


def read_bytes(path: str | Path) -> bytes:
    """The content of a file. An InputError says why it cannot be read.

    Folders, pipes and devices are refused: reading a pipe may wait for ever, and a device never ends.
    """
    try:
        mode = os.stat(path).st_mode
        for paths in _noting:
            paths[Path(path).absolute()] = None
        if stat.S_ISDIR(mode):
            raise InputError(f"{path}: this is a folder: give a file in it")
        if not stat.S_ISREG(mode):
            raise InputError(f"{path}: this is a pipe or a device: give a file that lies on a disk")
        return Path(path).read_bytes()
    except FileNotFoundError:
        raise MissingFileError(f"{path}: no such file") from None
    except OSError as error:
        raise InputError(f"{path}: cannot be read ({error.strerror})") from None


@contextlib.contextmanager
def noting_reads() -> Iterator[dict[Path, None]]:
    """The files that are read from now on, each once, in the order in which they are read."""
    paths: dict[Path, None] = {}
    _noting.append(paths)
    try:
        yield paths
    finally:
        _noting[:] = [one for one in _noting if one is not paths]


def check_place(*paths: str | Path | None, ending: str = "") -> None:
    """Raise an InputError if ``replace_file`` could not write to one of the places later; None is none.

    Args:
        ending: what their names must end with, so that a report is not written over a program or a picture.
    """
    for path in (Path(one) for one in paths if one is not None):
        folder = path.parent
        if not path.name.endswith(ending):
            raise InputError(f"{path}: the name of this file must end with {ending}")
        if path.is_dir():
            raise InputError(f"{path}: this is a folder: give a file name in it")
        if not folder.is_dir():
            raise InputError(f"{path}: the folder {folder} does not exist")
        if not os.access(folder, os.W_OK) or (path.exists() and not os.access(path, os.W_OK)):
            raise InputError(f"{path}: no permission to write there")


def replace_file(path: str | Path, content: bytes) -> None:
    """Write ``content`` into a file, either completely or not at all. An InputError says why it cannot be written."""
    path = Path(path)
    try:
        part = path.with_name(f".{secrets.token_hex(8)}.part")
        try:
            with part.open("xb") as file:
                file.write(content)
            os.replace(part, path)
        finally:
            part.unlink(missing_ok=True)
    except OSError as error:
        raise InputError(f"{path}: cannot be written ({error.strerror})") from None


def make_folder(folder: str | Path, why: str) -> None:
    """Make a folder and its parents. If nothing can be written there, raise an InputError that begins with ``why``."""
    new_folders.made.extend(path for path in (*reversed(Path(folder).parents), Path(folder)) if not path.exists())
    try:
        Path(folder).mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise InputError(f"{why}: the folder {folder} cannot be made ({error.strerror})") from None
    if not os.access(folder, os.W_OK):
        raise InputError(f"{why}: no permission to write there")


# ── the scenes and environments that come with the package ──


def scene_data_dir() -> Path:
    """The folder of shipped scenes: inside the installed package, or beside it in a checkout."""
    package = Path(__file__).parent.parent
    inside = package / "scene_data_dir"
    return inside if inside.is_dir() else package.parent / "scene_data_dir"


def shipped_environments() -> dict[str, Path]:
    """Name → file of every shipped environment."""
    return {p.stem: p for p in sorted((scene_data_dir() / "environments").glob("*.npy"))}
