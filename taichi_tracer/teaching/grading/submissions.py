"""What students hand in: zip files and folders, unpacked safely, and the rules of the course that concern them.

A zip file is data from a stranger. It is refused as a whole if an entry could leave the folder (an absolute path, or
".."), or if it could fill the disk (too many files, too many bytes). ``zipfile`` unpacks no more bytes of an entry than
its header says, and a link as a text. What operating systems add by themselves (``__MACOSX``, ``.DS_Store``), a folder
around the files, and missing files are normal.
"""

import io
import re
import zipfile
import zlib
from collections import Counter
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path, PurePath, PurePosixPath

from taichi_tracer.system.errors import InputError, MissingFileError

MOST_ENTRIES = 400  # an assignment has about ten files
MOST_BYTES = 20 << 20  # unpacked
LONGEST_NAME = 200  # characters of a path that are shown
IGNORED = ("__MACOSX", "__pycache__", ".git", ".ipynb_checkpoints", ".idea", ".vscode", ".venv")
IGNORED_FILES = (".DS_Store", "Thumbs.db", "desktop.ini")
Entry = tuple[PurePosixPath, int, Callable[[], bytes]]  # path of a file, its unpacked bytes, what reads them
ID = re.compile(r"(?<!\d)\d{9}(?!\d)")  # a student's number


class RefusedError(InputError):
    """A submission that is not unpacked; the message says why."""


@dataclass(frozen=True)
class Submission:
    """One thing that a student handed in.

    Attributes:
        path: the zip file or the folder. key: its name, which no other submission of the class has.
        student: the student's number of nine digits, or else the name of the file.
    """

    path: Path
    key: str
    student: str


# ── which submissions there are ──


def find(path: Path, files: Sequence[str]) -> list[Submission]:
    """The submissions at a path: one zip file, the folder of one student, or a folder with one entry per student.

    Args:
        files: the names of the files that a student hands in.
    """
    if not path.exists():
        raise MissingFileError(f"{path}: no such file or folder; give the zip file of one student, or a folder of them")
    if path.is_file():
        return [submission(path)]
    entries = [p for p in sorted(path.iterdir()) if not is_ignored(PurePosixPath(p.name)) and not p.is_symlink()]
    folders, zips = [p for p in entries if p.is_dir()], [p for p in entries if p.suffix.casefold() == ".zip"]
    wanted, places = {file.casefold() for file in files}, [path]
    if len(folders) == 1 and not ID.search(folders[0].name):  # a folder around the files
        places += folders
    if not zips and any(file.name.casefold() in wanted for place in places for file in place.iterdir()):
        return [submission(path)]
    found = [p for p in entries if p in folders or p in zips]
    if not found:
        raise InputError(f"{path}: neither zip files, nor folders of students, nor any of {', '.join(files)} are in it")
    return [submission(p) for p in found]


def submission(path: Path) -> Submission:
    """The submission of a zip file or a folder; its name says whose it is."""
    name = path.resolve().name
    stem = name[: -len(".zip")] if path.is_file() and name.casefold().endswith(".zip") else name
    numbers = ID.findall(stem)
    return Submission(path, name, numbers[0] if len(set(numbers)) == 1 else stem)


def is_ignored(path: PurePath) -> bool:
    """Whether the operating system or a tool made a file, and no student."""
    is_tools = any(part in IGNORED for part in path.parts)
    return is_tools or path.name in IGNORED_FILES or path.name.startswith("._") or path.suffix == ".pyc"


# ── unpacking ──


def unpack(submitted: Submission, target: Path, files: Sequence[str]) -> tuple[Path, list[str]]:
    """Unpack or copy a submission into a folder that does not exist.

    Returns:
        The folder in it that has the files of the assignment, and what is unusual about them, one sentence each.

    Raises:
        RefusedError: the submission is not as it may be. What was written until then stays in ``target``.
    """
    wanted, notes = {file.casefold(): file for file in files}, []
    target.mkdir(parents=True)
    try:
        found = [entry for entry in entries_of(submitted.path) if not is_ignored(entry[0])]
        if len(found) > MOST_ENTRIES:
            raise RefusedError(f"it has more than {MOST_ENTRIES} files")
        if sum(size for _, size, _ in found) > MOST_BYTES:
            raise RefusedError(f"its files have more than {MOST_BYTES >> 20} MB")
        for place, _, read in found:
            if place.is_absolute() or ".." in place.parts or not str(place).isprintable():
                raise RefusedError(f"the name {shown(place)} leads out of the folder, or cannot be printed")
            right = wanted.get(place.name.casefold(), place.name)
            if right != place.name:
                notes.append(f"{shown(place.name)} should be called {right!r}, and is used as this file")
            path = target / place.with_name(right)
            path.parent.mkdir(parents=True, exist_ok=True)
            path.write_bytes(read())
    except RefusedError:
        raise
    except (zipfile.BadZipFile, zlib.error, EOFError, RuntimeError, ValueError, OSError) as error:
        raise RefusedError(f"it cannot be unpacked ({type(error).__name__}: {shown(error)})") from None
    places = Counter(path.parent for path in target.rglob("*") if path.name in files)
    folder = min([target, *places], key=lambda p: (-places[p], len(p.parts), str(p)))
    notes += [f"the files are in the folder {shown(folder.relative_to(target))}"] * (folder != target)
    return folder, notes


def entries_of(path: Path) -> list[Entry]:
    """The files in a folder or a zip file."""
    if path.is_dir():
        files = [file for file in sorted(path.rglob("*")) if file.is_symlink() or not file.is_dir()]
        return [(PurePosixPath(f.relative_to(path)), f.lstat().st_size, partial(content_of, f)) for f in files]
    archive = zipfile.ZipFile(io.BytesIO(path.read_bytes()))
    packed = [one for one in archive.infolist() if not one.filename.endswith(("/", "\\"))]
    return [(PurePosixPath(p.filename.replace("\\", "/")), p.file_size, partial(archive.read, p)) for p in packed]


def content_of(file: Path) -> bytes:
    """What is in a file of a folder; a RefusedError if it is a link or a device."""
    if file.is_symlink() or not file.is_file():
        raise RefusedError(f"{shown(file.name)} is a link or a device")
    return file.read_bytes()


def shown(name: object) -> str:
    """A name that a stranger chose, safe to print."""
    return repr(str(name)[:LONGEST_NAME])
