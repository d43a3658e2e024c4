"""Reads the answers of a solution that is not handed out; ``sealing`` writes them."""

import json
from functools import lru_cache
from pathlib import Path

import numpy as np

from taichi_tracer.system.errors import InputError
from taichi_tracer.teaching.base import Arrays, Assignment, Mistake, Part
from taichi_tracer.teaching.kept import arrays_in

ANSWERS, FACTS = "answers.npz", "checks.json"


def is_sealed(folder: Path) -> bool:
    """Whether a folder has the answers of a solution, and not the solution itself."""
    return (folder / ANSWERS).is_file() and not (folder / "solution").exists()


def facts_of(folder: Path) -> dict:
    """What ``seal`` wrote about an assignment: its name, classes and mistakes."""
    try:
        facts = json.loads((folder / FACTS).read_text(encoding="utf-8"))
        facts["mistakes"] = tuple(Mistake(part, name, hint, (), topic) for part, name, hint, topic in facts["mistakes"])
    except (OSError, ValueError, KeyError, TypeError):
        raise InputError(
            f"{folder / FACTS}: the file is missing or damaged: take the folder from the course again"
        ) from None
    return facts


def answers_to_part(assignment: Assignment, part: Part, inputs: Arrays) -> Arrays:
    """What the solution answers; an InputError if the inputs have another seed than the answers."""
    seed = facts_of(assignment.folder)["seed"]
    known = assignment.inputs(part, seed)
    if any(not np.array_equal(known[name], inputs.get(name), equal_nan=True) for name in known):
        raise InputError(f"{assignment.folder}: only the answers to the inputs of seed {seed} are there")
    return arrays_of(assignment.folder, f"part {assignment.parts.index(part)}/")


def answers_of_mistake(assignment: Assignment, mistake: Mistake) -> Arrays | None:
    """What a mistake answers."""
    return arrays_of(assignment.folder, f"mistake {assignment.mistakes.index(mistake)}/") or None


@lru_cache(maxsize=4)
def _arrays(path: Path) -> Arrays:
    found = arrays_in(path)
    if found is None:
        raise InputError(f"{path}: the file is damaged: take the folder from the course again")
    return found


def arrays_of(folder: Path, beginning: str) -> Arrays:
    """The arrays whose names begin with a text, without it."""
    arrays = _arrays(folder / ANSWERS)
    return {name.removeprefix(beginning): array for name, array in arrays.items() if name.startswith(beginning)}
