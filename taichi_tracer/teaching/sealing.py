"""The checks of an assignment without its solution: what students need to check their work if they have none.

The solution of an assignment that comes with the package is in the package, as the renderer itself is. The solution of
a teacher's own assignment is not handed out. In its place, the folder ``checks`` has the answers of the solution and of
the known mistakes to the inputs of one seed. With these, each method is checked beside the student's other methods.
"""

import json
import shutil
from pathlib import Path

import numpy as np

from taichi_tracer.system import runtime
from taichi_tracer.system.errors import InputError
from taichi_tracer.teaching.base import Assignment
from taichi_tracer.teaching.mistakes import answers_of
from taichi_tracer.teaching.running import expected
from taichi_tracer.teaching.sealed import ANSWERS, FACTS


def seal(assignment: Assignment, folder: Path, seed: int) -> None:
    """Write the checks of an assignment into a new folder.

    Raises:
        InputError: the solution or a mistake does not run, or a mistake gives the right numbers.
    """
    runtime.ensure()
    found: dict[str, np.ndarray] = {}
    for i, part in enumerate(assignment.parts):
        inputs = assignment.inputs(part, seed)
        right = expected(assignment, part, inputs)
        found |= {f"part {i}/{name}": array for name, array in right.items()}
        for j, mistake in enumerate(assignment.mistakes):
            if mistake.part != part.name:
                continue
            wrong = answers_of(assignment, part, (mistake,), inputs)
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
        "mistakes": [[m.part, m.name, m.hint, m.topic] for m in assignment.mistakes],
    }
    folder.mkdir()
    for path in assignment.folder.glob("*.py"):
        if path.name != "mistakes.py":
            shutil.copyfile(path, folder / path.name)
    shutil.copyfile(assignment.folder / "README.md", folder / "README.md")
    np.savez(folder / ANSWERS, **found)  # type: ignore[arg-type]
    (folder / FACTS).write_text(json.dumps(facts, indent=1, ensure_ascii=False) + "\n", encoding="utf-8")
