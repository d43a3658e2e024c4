"""The checks of an assignment without its solution: what students need to check their work if they have none.

The solution of an assignment that comes with the package is in the package, as the renderer itself is. The solution of
a teacher's own assignment is not handed out. In its place, the folder ``checks`` has the answers of the solution and of
the known mistakes to the inputs of one seed. With these, each method is checked beside the student's other methods.
"""

import json
import shutil
from functools import lru_cache
from pathlib import Path

import numpy as np

from taichi_tracer.system import runtime
from taichi_tracer.system.errors import InputError
from taichi_tracer.teaching.base import Arrays, Assignment, Mistake, Part
from taichi_tracer.teaching.cache import arrays_in

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


def seal(assignment: Assignment, folder: Path, seed: int) -> None:
    """Write the checks of an assignment into a new folder.

    Raises:
        InputError: the solution or a mistake does not run, or a mistake gives the right numbers.
    """
    from taichi_tracer.teaching import mistakes, running  # which need this module

    runtime.ensure()
    found: dict[str, np.ndarray] = {}
    for i, part in enumerate(assignment.parts):
        inputs = assignment.inputs(part, seed)
        right = running.expected(assignment, part, inputs)
        found |= {f"part {i}/{name}": array for name, array in right.items()}
        for j, mistake in enumerate(assignment.mistakes):
            if mistake.part != part.name:
                continue
            wrong = mistakes.answers_of(assignment, part, mistake, seed)
            where = f"assignment {assignment.name}: the mistake {mistake.name!r} of {part.name}"
            if wrong is None:
                raise InputError(f"{where} does not run: a mistake has to give numbers")
            if part.judge.agrees(inputs, wrong, right).all():
                raise InputError(f"{where} gives the right numbers: choose inputs that show it, or leave it out")
            found |= {f"mistake {j}/{name}": array for name, array in wrong.items()}
    facts = {
        "name": assignment.name,
        "seed": seed,
        "classes": dict(assignment.classes),
        "program": assignment.program,
        "mistakes": [[m.part, m.name, m.hint] for m in assignment.mistakes],
    }
    folder.mkdir()
    for path in assignment.folder.glob("*.py"):
        if path.name != "mistakes.py":
            shutil.copyfile(path, folder / path.name)
    shutil.copyfile(assignment.folder / "README.md", folder / "README.md")
    np.savez(folder / ANSWERS, **found)  # type: ignore[arg-type]
    (folder / FACTS).write_text(json.dumps(facts, indent=1, ensure_ascii=False) + "\n", encoding="utf-8")
