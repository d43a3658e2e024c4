"""What students hand in: zip files and folders, unpacked safely, and the rules of the course that concern them.

A zip file is data from a stranger. It is refused as a whole if an entry could leave the folder (an absolute path, or
".."), or if it could fill the disk (too many files, too many bytes). ``zipfile`` unpacks no more bytes of an entry than
its header says, and a link as a text. What operating systems add by themselves (``__MACOSX``, ``.DS_Store``), a folder
around the files, and missing files are normal.
"""

import io
import re
import unicodedata
import zipfile
import zlib
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path, PurePath, PurePosixPath

from taichi_tracer.system.errors import InputError, MissingFileError

MOST_ENTRIES = 400  # an assignment has about ten files
MOST_BYTES = 20 << 20  # unpacked
LONGEST_NAME = 200  # characters of a path
IGNORED = ("__MACOSX", "__pycache__", ".git", ".ipynb_checkpoints", ".idea", ".vscode", ".venv")
IGNORED_FILES = (".DS_Store", "Thumbs.db", "desktop.ini")
Entry = tuple[str, int, Callable[[], bytes]]  # the path of a file, its bytes when unpacked, and what reads them
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
    wanted = {file.casefold() for file in files}
    zips = [p for p in entries if p.suffix.casefold() == ".zip"]
    if not zips and (any(p.name.casefold() in wanted for p in entries) or is_one_deeper(entries, wanted)):
        return [submission(path)]
    found = [p for p in entries if p.is_dir() or p in zips]
    if not found:
        raise InputError(f"{path}: neither zip files, nor folders of students, nor any of {', '.join(files)} are in it")
    return [submission(p) for p in found]


def is_one_deeper(entries: list[Path], wanted: set[str]) -> bool:
    """Whether the only folder in a folder is not named as a student is, and has the files."""
    folders = [p for p in entries if p.is_dir()]
    if len(folders) != 1 or ID.search(folders[0].name):
        return False
    return any(p.name.casefold() in wanted for p in folders[0].iterdir())


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
    target.mkdir(parents=True)
    entries = entries_of_folder if submitted.path.is_dir() else entries_of_zip
    try:
        found = [(place_of(name), size, read) for name, size, read in entries(submitted.path)]
        found = [entry for entry in found if not is_ignored(entry[0])]
        if len(found) > MOST_ENTRIES:
            raise RefusedError(f"it has more than {MOST_ENTRIES} files")
        if sum(size for _, size, _ in found) > MOST_BYTES:
            raise RefusedError(f"its files have more than {MOST_BYTES >> 20} MB")
        for place, _, read in found:
            path = target / place
            path.parent.mkdir(parents=True, exist_ok=True)
            with path.open("xb") as file:
                file.write(read())
    except RefusedError:
        raise
    except (zipfile.BadZipFile, zlib.error, EOFError, RuntimeError, ValueError, OSError) as error:
        raise RefusedError(f"it cannot be unpacked ({type(error).__name__}: {shown(error)})") from None
    return look_at(target, files)


def place_of(name: str) -> PurePosixPath:
    """The path of an entry below the target; a RefusedError if it is none."""
    plain = unicodedata.normalize("NFC", name.replace("\\", "/"))
    path = PurePosixPath(plain)
    if len(plain) > LONGEST_NAME or not plain.isprintable():
        raise RefusedError(f"the name {shown(name)} is too long, or has characters that cannot be printed")
    if plain.startswith("/") or re.match("[A-Za-z]:", plain):
        raise RefusedError(f"{shown(name)} is an absolute path")
    if ".." in path.parts:
        raise RefusedError(f"{shown(name)} leads out of the folder")
    return path


def entries_of_zip(path: Path) -> list[Entry]:
    """The files in a zip file."""
    archive = zipfile.ZipFile(io.BytesIO(path.read_bytes()))
    files = [entry for entry in archive.infolist() if not entry.filename.endswith(("/", "\\"))]
    return [(file.filename, file.file_size, partial(archive.read, file)) for file in files]


def entries_of_folder(folder: Path) -> list[Entry]:
    """The files in a folder; a RefusedError if one is a link or a device."""
    entries: list[Entry] = []
    for file in sorted(folder.rglob("*")):
        name = file.relative_to(folder)
        if is_ignored(name) or (file.is_dir() and not file.is_symlink()):
            continue
        if file.is_symlink() or not file.is_file():
            raise RefusedError(f"{shown(name)} is a link or a device")
        entries.append((name.as_posix(), file.stat().st_size, file.read_bytes))
    return entries


def shown(name: object) -> str:
    """A name that a stranger chose, safe to print."""
    return repr(str(name)[:LONGEST_NAME])


# ── what is in it ──


def look_at(target: Path, files: Sequence[str]) -> tuple[Path, list[str]]:
    """The folder that has the assignment's files, and what is unusual about it, one sentence each."""
    wanted = {file.casefold(): file for file in files}
    places: dict[Path, list[Path]] = {target: []}
    for path in sorted(target.rglob("*")):
        if path.is_file() and path.name.casefold() in wanted:
            places.setdefault(path.parent, []).append(path)
    folder = min(places, key=lambda p: (-len(places[p]), len(p.parts), str(p)))
    notes = [f"the files are in the folder {shown(folder.relative_to(target))}"] if folder != target else []
    for path in places[folder]:
        right = wanted[path.name.casefold()]
        if path.name != right and not path.with_name(right).exists():
            notes.append(f"{shown(path.name)} should be called {right!r}, and is used as this file")
            path.rename(path.with_name(right))
    return folder, notes
