"""What a student runs: each part of an assignment, with the first wrong number beside the right one."""

import json
import time
import warnings
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

from taichi_tracer.files import page
from taichi_tracer.system import runtime
from taichi_tracer.system.errors import InputError, one_of
from taichi_tracer.system.own_code.source import unwrap
from taichi_tracer.teaching import catalogue, html_boxes
from taichi_tracer.teaching.base import NOT_WRITTEN, RIGHT, Assignment, Part, PartResult
from taichi_tracer.teaching.handout.export import RECORD
from taichi_tracer.teaching.mistakes import find
from taichi_tracer.teaching.running import answer, expected, has_own_distribution, is_asked
from taichi_tracer.teaching.student_import import OK, Loaded, load_submission, solution_of
from taichi_tracer.teaching.telling import ResultLine, Teller, summary

SECONDS_OF_A_PART = 10.0  # of the clock, with the search for mistakes: half of what ``check`` allows
DIGITS = 4  # of points that are handed on
LEAST_FOR_MISTAKES = 0.5  # seconds for mistakes, however long the part took
Watch = Callable[[list[str]], Any]


@dataclass
class Report:
    """The results of a check. ``print`` shows it as text, and a notebook as a page.

    Attributes:
        notes: warnings that came while the parts ran.
    """

    assignment: Assignment
    results: list[PartResult] = field(default_factory=list)
    notes: list[str] = field(default_factory=list)

    @property
    def points(self) -> float:
        """The points of all parts that were checked."""
        return sum(result.points * result.share for result in self.results)

    @property
    def is_right(self) -> bool:
        """Whether every part that was checked is right."""
        return all(result.status == RIGHT for result in self.results)

    def score(self) -> float:
        """The points, for nbgrader.

        Raises:
            AssertionError: none were earned. nbgrader would take the number 0 for all points.
        """
        if not self.points > 0:
            raise AssertionError(self.results[0].message if self.results else self.summary())
        return float(round(self.points, DIGITS))

    def summary(self) -> str:
        """One line."""
        return summary(self.result_lines())

    def result_lines(self) -> list[ResultLine]:
        """What the process of a check sends of each part."""
        return [html_boxes.result_line(result) for result in self.results]

    def __str__(self) -> str:
        lines = [line for result in self.results for line in html_boxes.lines_of(result)]
        notes = [f"note: {text}" for text in self.notes]
        return "\n".join([self.assignment.title, *lines, *notes, self.summary()])

    __repr__ = __str__

    def body(self) -> list[str]:
        """The page without its frame."""
        notes = [page.paragraph(f"note: {text}", "note") for text in self.notes]
        return [page.paragraph(self.summary()), *notes, *(html_boxes.box(result) for result in self.results)]

    def page(self) -> str:
        """A whole document of HTML."""
        return html_boxes.whole(self.assignment.title, self.body())

    def _repr_html_(self) -> str:
        return html_boxes.in_notebook(self.body())


def check_folder(
    folder: str | Path,
    names: Sequence[str] = (),
    seed: int | None = None,
    watch: Watch | None = None,
    name: str | None = None,
    teller: Teller | None = None,
) -> Report:
    """Check a student's folder.

    Args:
        folder: a folder that ``taichi-tracer assignment new`` wrote; or files of the course, with ``name``.
        names: only parts whose name, or class, is one of these; all parts if there is none.
        seed: decides the inputs; None takes the seed of the folder.
        watch: a function that is called with the lines of each result, as soon as they are known.
        name: of the assignment, where the folder does not say it.
        teller: sends each part to another process.

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
    teller = Teller() if teller is None else teller
    teller.tell(points={part.name: part.points for part in parts})
    report = Report(assignment)
    for part in parts:
        cls = student.classes.get(part.replaces)
        teller.begins(part.name, None if cls is None else unwrap(getattr(cls, part.method, None)))
        seed_of_part = own_seed if seed is None else seed
        report.results.append(check_part(assignment, student, part, seed_of_part, watch or (lambda lines: None)))
        teller.found(html_boxes.result_line(report.results[-1]))
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
    return Report(assignment, results, list(dict.fromkeys(str(one.message) for one in caught)))


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
    left = max(LEAST_FOR_MISTAKES, SECONDS_OF_A_PART - (time.monotonic() - start))
    result = replace(result, findings=tuple(find(assignment, part, seed, found.arrays, right, left)))
    watch(html_boxes.lines_of_findings(result))
    return result
