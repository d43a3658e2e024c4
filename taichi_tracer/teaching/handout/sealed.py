"""The checks of an assignment without its solution: what students need to check their work if they have none.

The solution of an assignment that comes with the package is in the package, as the renderer itself is. The solution of
a teacher's own assignment is not handed out. In its place, the folder ``checks`` has the answers of the solution and of
the known mistakes to the inputs of one seed. With these, each method is checked beside the student's other methods.
"""

import json
import shutil
import zipfile
from functools import lru_cache
from pathlib import Path

import numpy as np

from taichi_tracer.system import runtime
from taichi_tracer.system.errors import InputError
from taichi_tracer.teaching.base import Arrays, Assignment, Mistake, Part, joined, parted

ANSWERS, FACTS = "answers.npz", "checks.json"


def is_sealed(folder: Path) -> bool:
    """Whether a folder has the answers of a solution, and not the solution itself."""
    return (folder / ANSWERS).is_file() and not (folder / "solution").exists()


def facts_of(folder: Path) -> dict:
    """What ``seal`` wrote about an assignment: its name, classes and mistakes."""
    try:
        facts = json.loads((folder / FACTS).read_text(encoding="utf-8"))
        facts["mistakes"] = tuple(Mistake(part, name, hint, ()) for part, name, hint in facts["mistakes"])
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
    return answers_in(assignment.folder)[f"part {assignment.parts.index(part)}"]


def answers_of_mistake(assignment: Assignment, mistake: Mistake) -> Arrays | None:
    """What a mistake answers; None if it does not run."""
    return answers_in(assignment.folder).get(f"mistake {assignment.mistakes.index(mistake)}")


@lru_cache(maxsize=4)
def answers_in(folder: Path) -> dict[str, Arrays]:
    """ "part NUMBER" or "mistake NUMBER" → the answers that ``seal`` wrote into a folder."""
    try:
        with np.load(folder / ANSWERS, allow_pickle=False) as found:
            return parted(dict(found))
    except (OSError, ValueError, EOFError, KeyError, zipfile.BadZipFile):
        raise InputError(f"{folder / ANSWERS}: the file is damaged: take the folder from the course again") from None


def seal(assignment: Assignment, folder: Path, seed: int) -> None:
    """Write the checks of an assignment into a new folder.

    Raises:
        InputError: the solution does not run.
    """
    from taichi_tracer.teaching import checking, running  # which need this module

    runtime.ensure()
    found: dict[str, Arrays] = {}
    for i, part in enumerate(assignment.parts):
        found[f"part {i}"] = running.expected(assignment, part, assignment.inputs(part, seed))
    for i, mistake in enumerate(assignment.mistakes):
        found[f"mistake {i}"] = checking.answers_of(assignment, assignment.part(mistake.part), mistake, seed) or {}
    facts = {
        "name": assignment.name,
        "seed": seed,
        "classes": dict(assignment.classes),
        "program": assignment.program,
        "mistakes": [[m.part, m.name, m.hint] for m in assignment.mistakes],
    }
    folder.mkdir()
    for path in (assignment.folder / "README.md", *assignment.folder.glob("*.py")):
        if path.name != "mistakes.py":
            shutil.copyfile(path, folder / path.name)
    np.savez(folder / ANSWERS, **joined(found))  # type: ignore[arg-type]
    (folder / FACTS).write_text(json.dumps(facts, indent=1, ensure_ascii=False) + "\n", encoding="utf-8")
