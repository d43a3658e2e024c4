"""Submissions of a class that workers grade: each is sent as its zip file, and runs between the walls of its worker."""

import tempfile
from pathlib import Path

from taichi_tracer.files.disk import replace_file
from taichi_tracer.system.errors import InputError
from taichi_tracer.teaching import catalogue, submissions
from taichi_tracer.teaching.grade import Settings, grade_class
from taichi_tracer.teaching.marks import Rules
from taichi_tracer.teaching.sandbox import best_level


def marks_of(assignment: str, name: str, content: bytes, seed: int, level: str | None, folder: Path) -> list[dict]:
    """The marks of one submission, as ``Mark.facts``.

    Args:
        assignment: the name of one that comes with the package.
        name, content: of the zip file.
        level: the walls; None takes the strongest that this machine has.
        folder: where the file is written, for as long as it is graded.
    """
    if Path(name).name != name:
        raise InputError(f"{name!r} is no file name")
    graded = catalogue.load(assignment)
    with tempfile.TemporaryDirectory(dir=folder) as place:
        path = Path(place) / name
        replace_file(path, content)
        found = submissions.find(path, graded.files)
        marks = grade_class(graded, found, Rules(), Settings(best_level(level), seed=seed))
    return [mark.facts() for mark in marks]
