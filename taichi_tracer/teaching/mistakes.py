"""Says which known mistake would give the same wrong answers.

A known mistake is a small change of the solution's text, see ``base.Mistake``. The changed solution is run on the
inputs of the part. If it gives the student's answer on every input, the mistake is named. If no mistake fits, the error
is described as far as numbers show it, see ``descriptions``.
"""

import ast
import math
import tempfile
import time
from pathlib import Path
from typing import Any

import numpy as np

from taichi_tracer.system.errors import InputError
from taichi_tracer.teaching.base import Arrays, Assignment, Mistake, Part
from taichi_tracer.teaching.handout import sealed
from taichi_tracer.teaching.handout.descriptions import describe
from taichi_tracer.teaching.handout.strip_solution import written
from taichi_tracer.teaching.judges import agree
from taichi_tracer.teaching.running import answer
from taichi_tracer.teaching.student_import import OK, load_classes, solution_of


def find(
    assignment: Assignment, part: Part, seed: int, answers: Arrays, expected: Arrays, seconds: float = math.inf
) -> list[dict[str, Any]]:
    """What is probably wrong with the answers to a part, see ``PartResult.findings``; nothing if they are right.

    Args:
        seconds: that the search may take. The first mistake that fits ends it: frequent ones come first.
    """
    inputs, judge = assignment.inputs(part, seed), part.judge
    is_right = judge.agrees(inputs, answers, expected)
    if is_right.all():
        return []
    start = time.monotonic()
    for mistake in assignment.mistakes_of(part):
        if time.monotonic() - start > seconds:
            break
        wrong = answers_of(assignment, part, mistake, seed)
        is_wrong = wrong is not None and not judge.agrees(inputs, wrong, expected).all()
        if is_wrong and agree(judge, inputs, answers, wrong).all():
            text = f"all {len(is_right)} {getattr(judge, 'called', 'inputs')} agree with: {mistake.name}"
            return [{"names": [mistake.name], "text": text, "hint": mistake.hint}]
    texts = describe(judge.means_of(answers), judge.means_of(expected), is_right)
    return [{"names": [], "text": text, "hint": ""} for text in texts]


# ── the solution with a mistake in it ──


_answers: dict[tuple, Arrays | None] = {}


def answers_of(assignment: Assignment, part: Part, mistake: Mistake, seed: int) -> Arrays | None:
    """What the solution with a mistake answers, computed once in a process; None if it does not run."""
    if assignment.is_sealed:
        return sealed.answers_of_mistake(assignment, mistake)
    key = (assignment.folder, mistake, seed)
    if key not in _answers:
        solution, file = solution_of(assignment), assignment.classes[part.replaces]
        with tempfile.TemporaryDirectory() as folder, np.errstate(all="ignore"):  # a mistake may divide by 0
            (Path(folder) / file).write_text(changed_source(assignment, part, mistake), encoding="utf-8")
            changed = load_classes(folder, [file], solution)
            found = answer(part, changed, solution, assignment.inputs(part, seed), dict(assignment.classes))
        _answers[key] = found.arrays if found.status == OK else None
    return _answers[key]


def changed_source(assignment: Assignment, part: Part, mistake: Mistake) -> str:
    """The file of the solution with a mistake in the method of a part.

    Raises:
        InputError: a text that is to be changed does not stand exactly once in the method.
    """
    path = assignment.solution_folder / assignment.classes[part.replaces]
    lines = written(path.read_text(encoding="utf-8"), str(path), "solved").splitlines(keepends=True)
    first, last = lines_of_body("".join(lines), part, str(path))
    method = "".join(lines[first:last])
    for old, new in mistake.changes:
        count = method.count(old)
        if count != 1:
            where = f"{part.name} of assignment {assignment.name}"
            raise InputError(f"mistake {mistake.name!r}: {old!r} stands {count} times in {where}, not once")
        method = method.replace(old, new)
    return "".join([*lines[:first], method, *lines[last:]])


def lines_of_body(source: str, part: Part, file: str) -> tuple[int, int]:
    """Where the body of a part's method begins and ends, without its docstring: a slice of the lines of a file."""
    for cls in (node for node in ast.parse(source).body if isinstance(node, ast.ClassDef)):
        for member in cls.body:
            if isinstance(member, ast.FunctionDef) and (cls.name, member.name) == (part.replaces, part.method):
                body = member.body[1:] if ast.get_docstring(member) is not None else member.body
                return body[0].lineno - 1, member.end_lineno or 0
    raise InputError(f"{file}: there is no method {part.replaces}.{part.method}")
