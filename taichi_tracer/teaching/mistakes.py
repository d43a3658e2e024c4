"""Says which known mistake would give the same wrong answers.

A known mistake is a small change of the solution's text, see ``base.Mistake``. The changed solution is run on the
inputs of the part. If it gives the student's answer on every input, the mistake is named. If no mistake fits, the error
is described as far as numbers show it, see ``descriptions``.
"""

import ast
import math
import tempfile
import time
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np

from taichi_tracer.system.errors import InputError
from taichi_tracer.teaching.base import Arrays, Assignment, Mistake, Part
from taichi_tracer.teaching.handout import sealed
from taichi_tracer.teaching.handout.descriptions import describe
from taichi_tracer.teaching.handout.strip_solution import solved
from taichi_tracer.teaching.judges import agree
from taichi_tracer.teaching.running import answer
from taichi_tracer.teaching.student_import import OK, Loaded, load_classes, solution_of


def find(
    assignment: Assignment, part: Part, seed: int, answers: Arrays, expected: Arrays, seconds: float = math.inf
) -> list[dict[str, Any]]:
    """What is probably wrong with the answers to a part, see ``PartResult.findings``; nothing if they are right.

    Args:
        seconds: that the search may take; the first mistake that fits then ends it. Infinity compares all of them, so
            that the result is the same on every machine.
    """
    inputs, judge = assignment.inputs(part, seed), part.judge
    is_right = judge.agrees(inputs, answers, expected)
    if is_right.all():
        return []
    waiting = list(assignment.mistakes_of(part))
    fitting: list[Mistake] = []
    now, longest = time.monotonic(), 0.0
    end = now + seconds
    while waiting and now + longest < end and not (fitting and seconds < math.inf):
        mistake = waiting.pop(0)
        wrong = answers_of(assignment, part, mistake, seed)
        longest, now = max(longest, time.monotonic() - now), time.monotonic()
        if wrong is None or judge.agrees(inputs, wrong, expected).all():
            continue
        if agree(judge, inputs, answers, wrong).all():
            fitting.append(mistake)
    if fitting:
        called = f"all {len(is_right)} {getattr(judge, 'called', 'inputs')} agree with: "
        return [{"names": [one.name], "text": called + one.name, "hint": one.hint} for one in fitting]
    texts = describe(inputs, judge.means_of(answers), judge.means_of(expected), is_right)
    if waiting:
        texts.append(f"{len(waiting)} known mistakes were not compared, because time was up: check again")
    return [{"names": [], "text": text, "hint": ""} for text in texts]


# ── the solution with a mistake in it ──


_answers: dict[tuple, Arrays | None] = {}


def answers_of(assignment: Assignment, part: Part, mistake: Mistake, seed: int) -> Arrays | None:
    """What the solution with a mistake answers, computed once in a process; None if it does not run."""
    if assignment.is_sealed:
        return sealed.answers_of_mistake(assignment, mistake)
    key = (assignment.folder, mistake, seed)
    if key not in _answers:
        changed, inputs = with_mistake(assignment, part, mistake), assignment.inputs(part, seed)
        with np.errstate(all="ignore"):  # a mistake may divide by 0
            found = answer(part, changed, solution_of(assignment), inputs, dict(assignment.classes))
        _answers[key] = found.arrays if found.status == OK else None
    return _answers[key]


def with_mistake(assignment: Assignment, part: Part, mistake: Mistake) -> Loaded:
    """The classes of one file of the solution, with a mistake in it. Taichi reads it from a temporary file."""
    file, text = assignment.classes[part.replaces], changed_source(assignment, part, mistake)
    folder = Path(tempfile.mkdtemp(dir=work_folder().name))
    (folder / file).write_text(text, encoding="utf-8")
    return load_classes(folder, [file], solution_of(assignment))


@cache
def work_folder() -> tempfile.TemporaryDirectory:
    """A folder that is removed when the process ends."""
    return tempfile.TemporaryDirectory(prefix="taichi_tracer_mistakes_")


def changed_source(assignment: Assignment, part: Part, mistake: Mistake) -> str:
    """The file of the solution with a mistake in the method of a part.

    Raises:
        InputError: a text that is to be changed does not stand exactly once in the method.
    """
    path = assignment.solution_folder / assignment.classes[part.replaces]
    lines = solved(path.read_text(encoding="utf-8"), str(path)).splitlines(keepends=True)
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
