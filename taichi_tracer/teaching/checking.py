"""What a student runs: each part of an assignment, with the first wrong number beside the right one."""

import json
import time
import warnings
from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

from taichi_tracer.system import runtime
from taichi_tracer.system.errors import InputError, one_of
from taichi_tracer.system.own_code.source import unwrap
from taichi_tracer.teaching import catalogue, html_boxes
from taichi_tracer.teaching.base import BEGUN, NOT_WRITTEN, RIGHT, Assignment, Part, PartResult
from taichi_tracer.teaching.handout.export import RECORD
from taichi_tracer.teaching.html_boxes import Report
from taichi_tracer.teaching.mistakes import find
from taichi_tracer.teaching.running import answer, expected, has_own_distribution, is_asked
from taichi_tracer.teaching.student_import import OK, Loaded, load_submission, solution_of

SECONDS_OF_A_PART = 10.0  # of the clock, with the search for mistakes: half of what ``check`` allows
Watch = Callable[[list[str]], Any]


def check_folder(
    folder: str | Path,
    names: Sequence[str] = (),
    seed: int | None = None,
    name: str | None = None,
    watch: Watch = lambda lines: None,
    send: Callable[[Any], Any] = lambda found: None,
) -> Report:
    """Check a student's folder.

    Args:
        folder: a folder that ``taichi-tracer assignment new`` wrote; or files of the course, with ``name``.
        names: only parts whose name, or class, is one of these; all parts if there is none.
        seed: decides the inputs; None takes the seed of the folder.
        name: of the assignment, where the folder does not say it.
        watch: a function that is called with the lines of each result, as soon as they are known.
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
        report.results.append(check_part(assignment, student, part, own_seed if seed is None else seed, watch))
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
        results = [check_part(assignment, student, part, seed, lambda lines: None) for part in found]
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


def check_part(assignment: Assignment, student: Loaded, part: Part, seed: int, watch: Watch) -> PartResult:
    """Run one part in this process, and judge it; then look for what is wrong."""
    start = time.monotonic()
    inputs = assignment.inputs(part, seed)
    found = answer(part, student, solution_of(assignment), inputs, dict(assignment.classes))
    facts = {"name": part.name, "topic": part.topic, "points": part.points}
    facts["seconds"] = time.monotonic() - start
    if found.status != OK:
        where = f" (line {found.line} is still that of the handout)" if found.line else ""
        result = replace(found, message=found.message + (where if found.status == NOT_WRITTEN else ""), **facts)
        if result.message in student.reported and found.line:
            result = replace(result, message="")  # what is wrong with a file is said once
        student.reported.add(result.message)
        watch(html_boxes.lines_of(result))
        return result
    right = expected(assignment, part, inputs)
    if has_own_distribution(part, student):
        part = replace(part, judge=replace(part.judge, only_means=True))
    result = replace(part.judge(inputs, found.arrays, right), **facts)
    watch(html_boxes.lines_of(result))
    if result.status == RIGHT or not part.replaces:
        return result
    left = SECONDS_OF_A_PART - (time.monotonic() - start)
    result = replace(result, findings=tuple(find(assignment, part, seed, found.arrays, right, left)))
    watch(html_boxes.lines_of_findings(result))
    return result
