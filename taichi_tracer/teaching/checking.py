"""What a student runs: each part of an assignment, with the first wrong number beside the right one, and the mistake.

A known mistake is a small change of the solution's text, see ``base.Mistake``. The changed solution is run on the
inputs of the part. If it gives the student's answer on every input, the mistake is named. If no mistake fits, the error
is described as far as numbers show it: mirrored, transposed, scaled or moved.
"""

import json
import math
import tempfile
import time
import warnings
from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np

from taichi_tracer.system import runtime
from taichi_tracer.system.errors import InputError, one_of
from taichi_tracer.system.own_code.checks import unwrap
from taichi_tracer.teaching import catalogue
from taichi_tracer.teaching.base import BEGUN, NOT_WRITTEN, RIGHT, Arrays, Assignment, Mistake, Part, PartResult
from taichi_tracer.teaching.handout.export import RECORD, written
from taichi_tracer.teaching.html_boxes import Report
from taichi_tracer.teaching.running import (
    OK,
    Loaded,
    answer,
    expected,
    has_own_distribution,
    is_asked,
    load_classes,
    load_submission,
    solution_of,
)

# ── descriptions ──


TOLERANCE = 1e-3  # of a relation such as "always twice as large"
# Factors with a name, for "scaled by".
KNOWN = {math.pi: "π", 1 / math.pi: "1/π", 2 * math.pi: "2π", 1 / (2 * math.pi): "1/(2π)", 180 / math.pi: "180/π"}
KNOWN |= {math.pi / 180: "π/180"} | {1 / n: f"1/{n}" for n in range(2, 10)}
AXES = "xyzw"


def describe(answers: Arrays, expected: Arrays, is_right: np.ndarray) -> list[str]:
    """Sentences about how the answers differ from the expected ones; at least one.

    Args:
        is_right: (n,) which answers are right.
    """
    missing = [name for name in expected if np.shape(answers.get(name)) != np.shape(expected[name])]
    if missing or len(is_right) != len(next(iter(expected.values()))):
        return [f"the answer {missing[0]!r} has another shape than it should" if missing else "the answer is wrong"]
    texts, rows = [], ~is_right
    if "is_hit" in expected:
        yours, right = answers["is_hit"] != 0, expected["is_hit"] != 0
        missed, invented = (right & ~yours).sum(), (yours & ~right).sum()
        texts += [f"{missed} hits are missed"] * bool(missed)
        texts += [f"{invented} rays hit something, although they should miss"] * bool(invented)
        rows = rows & yours & right
    for name, right in expected.items():
        y, r = np.asarray(answers[name])[rows], np.asarray(right)[rows]
        if not np.array_equal(y, r) and not near(y, r):
            texts.append(f"{name} {difference(y, r)}")
    return texts or ["the numbers differ in no way that is known"]


def difference(yours: np.ndarray, right: np.ndarray) -> str:
    """In words how (n, …) numbers differ, all of which belong to wrong answers."""
    y, r = (numbers.reshape(len(right), -1).astype(np.float64) for numbers in (yours, right))
    if not np.isfinite(y).all():
        return f"is not a finite number in {int((~np.isfinite(y)).any(axis=1).sum())} of {len(y)} cases"
    if right.ndim == 3 and right.shape[1] == right.shape[2] and near(np.swapaxes(yours, 1, 2), right):
        return "is transposed"
    for text, numbers in guesses(y, r):
        if near(y, numbers):
            return text
    return f"is wrong by up to {abs(y - r).max():.3g}"


def guesses(y: np.ndarray, r: np.ndarray) -> Iterator[tuple[str, np.ndarray]]:
    """What is often wrong with (n, k) numbers r, in words, and the numbers that it would give; y are the student's."""
    k, axes = r.shape[1], range(r.shape[1] if 1 < r.shape[1] <= len(AXES) else 0)
    yield "is always 0", 0 * r
    if not near(r, np.broadcast_to(r[:1], r.shape)):
        yield "is the same for every input", np.broadcast_to(y[:1], r.shape)
    yield "has the opposite sign" if k == 1 else "points the opposite way", -r
    for i in axes:
        yield f"is mirrored: its {AXES[i]} has the opposite sign", r * np.where(np.arange(k) == i, -1, 1)
        for j in range(i):
            order = [{i: j, j: i}.get(axis, axis) for axis in range(k)]
            yield f"has its {AXES[j]} and its {AXES[i]} exchanged", r[:, order]
    factor = float((y * r).sum() / max((r * r).sum(), 1e-300))
    word = next((word for value, word in KNOWN.items() if abs(factor / value - 1) < TOLERANCE), f"{factor:.4g}")
    yield f"is scaled by {word}", factor * r
    moved = (y - r).mean(axis=0)
    yield f"has a constant offset: {', '.join(f'{number:.4g}' for number in moved)}", r + moved
    yield "has the right direction, but not the length 1", r * np.linalg.norm(y, axis=1, keepdims=True)
    yield "is 1 minus the right number", 1 - r
    for i in axes:
        yield f"is right but for its {AXES[i]}", np.where(np.arange(k) == i, y, r)


def near(a: np.ndarray, b: np.ndarray) -> bool:
    """Whether all numbers agree up to rounding."""
    return np.allclose(a, b, rtol=TOLERANCE, atol=TOLERANCE)


# ── known mistakes ──


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
    for mistake in (one for one in assignment.mistakes if one.part == part.name):
        if time.monotonic() - start > seconds:
            break
        wrong = answers_of(assignment, part, mistake, seed)
        is_wrong = wrong is not None and not judge.agrees(inputs, wrong, expected).all()
        # Each is judged by the other: what is much noisier fits everything.
        if is_wrong and judge.agrees(inputs, answers, wrong).all() and judge.agrees(inputs, wrong, answers).all():
            text = f"all {len(is_right)} {judge.called} agree with: {mistake.name}"
            return [{"names": [mistake.name], "text": text, "hint": mistake.hint}]
    texts = describe(judge.means_of(answers), judge.means_of(expected), is_right)
    return [{"names": [], "text": text, "hint": ""} for text in texts]


# ── the solution with a mistake in it ──


@cache
def answers_of(assignment: Assignment, part: Part, mistake: Mistake, seed: int) -> Arrays | None:
    """What the solution with a mistake answers, computed once in a process; None if it does not run."""
    if assignment.is_sealed:
        return catalogue.answers_in(assignment.folder)[1].get(f"mistake {assignment.mistakes.index(mistake)}")
    file = assignment.classes[part.replaces]
    with tempfile.TemporaryDirectory() as folder, np.errstate(all="ignore"):  # a mistake may divide by 0
        (Path(folder) / file).write_text(changed_source(assignment, part, mistake), encoding="utf-8")
        changed = load_classes(folder, [file], solution_of(assignment))
        found = answer(assignment, part, changed, assignment.inputs(part, seed))
    return found.arrays if found.status == OK else None


def changed_source(assignment: Assignment, part: Part, mistake: Mistake) -> str:
    """The file of the solution with a mistake in the method of a part."""
    path = assignment.folder / "solution" / assignment.classes[part.replaces]
    return written(path.read_text(encoding="utf-8"), str(path), "solved", mistake)


# ── checking ──


SECONDS_OF_A_PART = 10.0  # of the clock, with the search for mistakes: half of what ``check`` allows


def check_folder(
    folder: str | Path,
    names: Sequence[str] = (),
    seed: int | None = None,
    name: str | None = None,
    send: Callable[[Any], Any] = lambda found: None,
) -> Report:
    """Check a student's folder.

    Args:
        folder: a folder that ``taichi-tracer assignment new`` wrote; or files of the course, with ``name``.
        names: only parts whose name, or class, is one of these; all parts if there is none.
        seed: decides the inputs; None takes the seed of the folder.
        name: of the assignment, where the folder does not say it.
        send: a function that is called with (title, names of the parts), and with each part's result twice: when it
            begins, and when it is judged.

    Raises:
        InputError: the folder belongs to no assignment, or a name is unknown.
    """
    folder = Path(folder).expanduser()
    assignment, own_seed = assignment_of(folder, name)
    runtime.ensure()
    student = load_submission(folder, assignment)
    parts = [
        part
        for part in chosen(assignment, names)
        if is_asked(part, student, assignment) or (names and part.is_optional)
    ]
    send((assignment.title, [part.name for part in parts]))
    report = Report(assignment.title)
    for part in parts:
        method = unwrap(getattr(student.classes.get(part.replaces), part.method, None))
        code = getattr(method, "__code__", None)
        place = {} if code is None else {"line": code.co_firstlineno, "file": Path(code.co_filename).name}
        send(PartResult(BEGUN, name=part.name, topic=part.topic, points=part.points, **place))
        report.results.append(check_part(assignment, student, part, own_seed if seed is None else seed))
        send(report.results[-1])
    return report


def assignment_of(folder: Path, name: str | None = None) -> tuple[Assignment, int]:
    """The assignment and the seed of a student's folder; the name is that of files of the course."""
    path = folder / RECORD
    if name is not None:
        return catalogue.load(name), 0
    if not path.is_file():
        raise InputError(
            f"{folder}: {RECORD} is missing: give a folder that 'taichi-tracer assignment new' wrote; "
            f"for files of the course, add --assignment with one of {', '.join(catalogue.names())}"
        )
    try:
        record = json.loads(path.read_text(encoding="utf-8"))
        name, seed = str(record["assignment"]), int(record.get("seed", 0))
    except (ValueError, KeyError, TypeError):
        raise InputError(
            f"{path}: the file is damaged: write the folder anew, and copy your own files into it"
        ) from None
    return catalogue.load(folder / name if (folder / name).is_dir() else name), seed


def chosen(assignment: Assignment, names: Sequence[str]) -> list[Part]:
    """The parts that are named, by their whole name, their method or their class."""
    if not names:
        return list(assignment.parts)
    found = []
    for name in names:
        fitting = [p for p in assignment.parts if name in (p.name, p.method, p.replaces, p.name.rpartition(": ")[2])]
        if not fitting:
            raise one_of("part", name, [part.name for part in assignment.parts])
        found += [part for part in fitting if part not in found]
    return found


def check_classes(name: str | Path, classes: Sequence[type], seed: int = 0, parts: Sequence[str] = ()) -> Report:
    """Check classes of a notebook; see ``teaching.check``."""
    assignment = catalogue.load(name)
    runtime.ensure()
    solution = solution_of(assignment)
    student = Loaded({role_of(cls, assignment, solution): cls for cls in classes})
    tested = {part.replaces for part in assignment.parts if part.replaces}
    found = [part for part in chosen(assignment, parts) if part.replaces in student.classes]
    if tested <= set(student.classes):
        found += [part for part in chosen(assignment, parts) if part.replaces == ""]
    with warnings.catch_warnings(record=True) as caught:  # what stands on stderr costs all points of a cell of nbgrader
        results = [check_part(assignment, student, part, seed) for part in found]
    return Report(assignment.title, results, list(dict.fromkeys(str(one.message) for one in caught)))


def role_of(cls: type, assignment: Assignment, solution: Loaded) -> str:
    """Which class of the assignment a student's class is: by its name, or by the package's class it derives from."""
    if not isinstance(cls, type):
        raise InputError(f"check takes classes, such as Camera, not {cls!r}")
    if cls.__name__ in assignment.classes:
        return cls.__name__
    for name, of_solution in solution.classes.items():
        of_package = [base for base in of_solution.__mro__[1:] if base.__module__.startswith("taichi_tracer")]
        if of_package and issubclass(cls, of_package[0]):
            return name
    raise one_of("class", cls.__name__, assignment.classes)


def check_part(assignment: Assignment, student: Loaded, part: Part, seed: int) -> PartResult:
    """Run one part in this process, and judge it; then look for what is wrong."""
    start = time.monotonic()
    inputs = assignment.inputs(part, seed)
    found = answer(assignment, part, student, inputs)
    facts = {"name": part.name, "topic": part.topic, "points": part.points, "seconds": time.monotonic() - start}
    if found.status != OK:
        where = f" (line {found.line} is still that of the handout)" if found.line else ""
        return replace(found, message=found.message + (where if found.status == NOT_WRITTEN else ""), **facts)
    right = expected(assignment, part, seed)
    if has_own_distribution(part, student):
        part = replace(part, judge=replace(part.judge, only_means=True))
    result = replace(part.judge(inputs, found.arrays, right), **facts)
    if result.status == RIGHT or not part.replaces:
        return result
    left = SECONDS_OF_A_PART - (time.monotonic() - start)
    return replace(result, findings=tuple(find(assignment, part, seed, found.arrays, right, left)))
