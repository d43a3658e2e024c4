"""A submission that a worker grades: it comes as a zip file, and runs between the walls that this machine has."""

import io
import tempfile
from pathlib import Path

import numpy as np

from taichi_tracer.files.disk import replace_file
from taichi_tracer.system.errors import InputError
from taichi_tracer.teaching import catalogue, submissions
from taichi_tracer.teaching.grade import GradingSettings, grade
from taichi_tracer.teaching.reference import Reference
from taichi_tracer.teaching.sandbox import best_level


def mark_of_zip(assignment: str, name: str, content: bytes, seed: int, trust: bool, folder: Path) -> dict:
    """The mark of one submission without the rules of a course, as ``Mark.facts``; and its pictures, as an npz file.

    Args:
        assignment: the name of one that comes with the package.
        name, content: of the zip file.
        trust: whether limits alone are enough where bubblewrap does not work.
        folder: where the file is written, for as long as it is graded.
    """
    if Path(name).name != name:
        raise InputError(f"{name!r} is no file name")
    graded = catalogue.load(assignment)
    with tempfile.TemporaryDirectory(dir=folder) as place, Reference(graded, seed) as reference:
        path = Path(place) / name
        replace_file(path, content)
        (one,) = submissions.find(path, graded.files)
        mark, pictures = grade(reference, one, GradingSettings(best_level(trust), seed=seed))
    buffer = io.BytesIO()
    np.savez(buffer, **pictures)
    return {"facts": mark.facts(), "pictures": buffer.getvalue()}
