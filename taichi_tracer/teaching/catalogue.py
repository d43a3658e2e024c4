"""Finds assignments: those that come with the package, by their names, and others by their folders.

An assignment is a folder with

    README.md      the text that students read; its first line is the title
    parts.py       PARTS, a tuple of ``Part``
    mistakes.py    MISTAKES: part → name of a mistake → (hint, change, change …), see ``base.Mistake``;
                   those that students make most often first, at most eight of a part; the file may be missing
    solution/      the tagged solution; a student hands in its files, except a program such as A1.py

The solution of an assignment that comes with the package is in the package, as the renderer itself is. The solution of
a teacher's own assignment is not handed out. In its place, students get the file ``ANSWERS``: the answers of the
solution and of the known mistakes to the inputs of one seed.
"""

import ast
import json
import runpy
import sys
import zipfile
from functools import lru_cache
from pathlib import Path
from typing import Any

import numpy as np

from taichi_tracer.system.errors import InputError, one_of
from taichi_tracer.system.parts import where_in
from taichi_tracer.teaching.base import Arrays, Assignment, Mistake, parted

SHIPPED, ANSWERS = Path(__file__).parent / "assignments", "answers.npz"


def names() -> list[str]:
    """The names of the assignments that come with the package."""
    return sorted(path.parent.name for path in SHIPPED.glob("*/parts.py"))


def load(name_or_folder: str | Path) -> Assignment:
    """The assignment of this name, or in this folder.

    Raises:
        InputError: there is none, or its files do not fit together; the message says what is missing.
    """
    if str(name_or_folder) in names():
        return load_folder((SHIPPED / str(name_or_folder)).resolve())
    folder = Path(name_or_folder).expanduser()
    if not folder.is_dir():
        raise one_of("assignment", str(name_or_folder), [*names(), "or the folder of an assignment"])
    return load_folder(folder.resolve())


@lru_cache(maxsize=32)
def load_folder(folder: Path) -> Assignment:
    """The assignment in a folder."""
    sealed = (folder / ANSWERS).is_file() and not (folder / "solution").exists()
    for needed in ("README.md", "parts.py") if sealed else ("README.md", "parts.py", "solution"):
        if not (folder / needed).exists():
            raise InputError(f"{folder}: {needed} is missing, so this is no assignment: see docs/teaching.md")
    facts = answers_in(folder)[0] if sealed else facts_of_solution(folder)
    parts, classes, mistakes = tuple(constant(folder / "parts.py", "PARTS")), facts["classes"], facts["mistakes"]
    for part in parts:
        if part.replaces not in ("", *classes):
            raise InputError(
                f"assignment {folder.name}: the part {part.name!r} tests the class {part.replaces}, which is in no "
                f"file: the classes are {', '.join(classes)}"
            )
    for mistake in mistakes:
        if mistake.part not in [part.name for part in parts]:
            raise InputError(f"{folder / 'mistakes.py'}: there is no part {mistake.part!r}")
    files = tuple(dict.fromkeys(classes.values()))
    title = (folder / "README.md").read_text(encoding="utf-8").partition("\n")[0].lstrip("# ").strip()
    return Assignment(facts["name"], title, folder, parts, files, classes, mistakes, facts["program"], sealed)


def facts_of_solution(folder: Path) -> dict[str, Any]:
    """The name, the classes, the program and the known mistakes of an assignment with its solution."""
    solution = sorted((folder / "solution").glob("*.py"))
    known = folder / "mistakes.py"
    of_parts = constant(known, "MISTAKES") if known.exists() else {}
    if not isinstance(of_parts, dict):
        raise InputError(f"{known}: MISTAKES must be a dict: part → name → (hint, change, …): see docs/teaching.md")
    entries = [(part, name, entry) for part, by_name in of_parts.items() for name, entry in by_name.items()]
    return {
        "name": folder.name,
        "classes": {name: path.name for path in solution for name in classes_in(path)},
        "program": next((path.name for path in solution if not classes_in(path)), ""),
        "mistakes": tuple(Mistake(part, name, hint, tuple(changes)) for part, name, (hint, *changes) in entries),
    }


@lru_cache(maxsize=4)
def answers_in(folder: Path) -> tuple[dict[str, Any], dict[str, Arrays]]:
    """What ``export.seal`` wrote: the name, the classes, … and "part NUMBER" or "mistake NUMBER" → its answers."""
    try:
        with np.load(folder / ANSWERS, allow_pickle=False) as found:
            answers = parted(dict(found))
        facts = json.loads(str(answers[""]["facts"]))
        facts["mistakes"] = tuple(Mistake(part, name, hint, ()) for part, name, hint in facts["mistakes"])
    except (OSError, ValueError, EOFError, KeyError, TypeError, zipfile.BadZipFile):
        raise InputError(f"{folder / ANSWERS}: the file is damaged: take the folder from the course again") from None
    return facts, answers


def constant(file: Path, name: str) -> Any:
    """A constant of a Python file of an assignment, which may import files beside it."""
    sys.path.insert(0, str(file.parent))
    try:
        found = runpy.run_path(str(file), run_name=f"_assignment_{file.parent.name}_{file.stem}")
    except Exception as error:
        raise InputError(
            f"{where_in(error, file, str(file))}: {type(error).__name__}: {getattr(error, 'msg', error)}"
        ) from error
    finally:
        sys.path.remove(str(file.parent))
    if name not in found:
        raise InputError(f"{file}: the file has no {name}: see docs/teaching.md")
    return found[name]


def classes_in(file: Path) -> list[str]:
    """The names of the classes that a file defines."""
    try:
        tree = ast.parse(file.read_text(encoding="utf-8"))
    except SyntaxError as error:
        raise InputError(f"{file}:{error.lineno}: {error.msg}") from None
    return [node.name for node in tree.body if isinstance(node, ast.ClassDef)]
