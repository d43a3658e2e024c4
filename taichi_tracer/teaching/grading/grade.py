"""Grades a class: every submission in a process of its own, part by part, each part beside the solution's other parts.

The grader never loads a submission's code. It sends inputs to the submission's process, compares the numbers that come
back with those of the solution, and starts the process anew if a part ends it.

The solution runs in a process of its own, too, without limits, so that Taichi never runs in the grader's. Its answers
depend on the assignment, the package and the seed alone. They are computed once and kept in the user's cache, beside
the compiled kernels, of which every submission gets a copy.
"""

import contextlib
import hashlib
import math
import os
import signal
import tempfile
import threading
import time
from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import BrokenExecutor, ProcessPoolExecutor, ThreadPoolExecutor, as_completed
from dataclasses import dataclass, replace
from functools import cached_property
from multiprocessing import get_context
from pathlib import Path
from typing import Any

import numpy as np

import taichi_tracer
from taichi_tracer.system import runtime
from taichi_tracer.system.errors import InputError
from taichi_tracer.teaching import catalogue, checking, running
from taichi_tracer.teaching.base import (
    CRASHED,
    DIGITS,
    MISSING,
    NOT_WRITTEN,
    OUT_OF_TIME,
    RIGHT,
    WRONG,
    Arrays,
    Assignment,
    Part,
    PartResult,
    Samples,
    arrays_in,
    cache_folder,
    joined,
    keep_arrays,
    parted,
)
from taichi_tracer.teaching.grading import submissions
from taichi_tracer.teaching.grading.isolate import (
    SECONDS_TO_LOAD,
    Limits,
    SubmissionProcess,
    WorkerEnded,
)
from taichi_tracer.teaching.grading.submissions import RefusedError, Submission
from taichi_tracer.teaching.running import LONGEST_MESSAGE, NOT_ASKED, NOT_ASKED_TEXT, OK, OPTIONAL_TEXT

# ── marks ──


# What a mark says of each part.
OF_A_PART = ("name", "topic", "points", "share", "status", "message", "first_wrong", "findings", "seconds")


@dataclass(frozen=True)
class Mark:
    """The mark of one submission.

    Attributes:
        key, student: see ``submissions.Submission``. refused: why it was not unpacked; "" if it was.
        notes: what the report says about the files.
        printed: what it printed, cut.
    """

    key: str
    student: str
    parts: tuple[PartResult, ...]
    refused: str = ""
    notes: tuple[str, ...] = ()
    printed: str = ""

    @property
    def points(self) -> float:
        """The points that can be had."""
        return round(sum(part.points for part in self.parts), DIGITS)

    @property
    def score(self) -> float:
        """The points of all parts."""
        return round(sum(part.earned for part in self.parts), DIGITS)

    @property
    def seconds(self) -> float:
        """How long all parts took."""
        return sum(part.seconds for part in self.parts)

    @property
    def right(self) -> int:
        """How many parts are right."""
        return sum(part.status == RIGHT for part in self.parts)

    def facts(self) -> dict:
        """The mark for JSON, with its sums."""
        parts = [{name: getattr(part, name) for name in (*OF_A_PART, "earned")} for part in self.parts]
        return to_json({**vars(self), "parts": parts, "score": self.score, "earned": self.score, "points": self.points})


def most_points(marks: Sequence[Mark]) -> float:
    """The points that can be had in a class, with the optional parts that somebody handed in."""
    return max(mark.points for mark in marks)


def to_json(value: Any) -> Any:
    """A value for JSON: numbers that JSON does not have, such as NaN, become words."""
    if isinstance(value, Mapping):
        return {str(name): to_json(entry) for name, entry in value.items()}
    if isinstance(value, (list, tuple)):
        return [to_json(entry) for entry in value]
    if isinstance(value, float) and not math.isfinite(value):
        return str(value)
    return value


# ── the solution's answers ──


class Reference(contextlib.AbstractContextManager):
    """The right answers for one class. Several threads may ask it.

    Args:
        assignment: what is graded. seed: decides the inputs.

    Attributes:
        kernels: the folder with the compiled kernels of the solution.
        stopped: is set when the processes of hand-ins are to end, and no marks are kept.
    """

    def __init__(self, assignment: Assignment, seed: int) -> None:
        self.assignment, self.seed = assignment, seed
        self.folder = cache_folder() / "classes" / f"{assignment.name}-{fingerprint(assignment)[:16]}"
        self.kernels = self.folder / "cache"
        self.inputs = {part.name: assignment.inputs(part, seed) for part in assignment.parts}
        self.solution = process_of_solution(self.kernels)
        self.stopped = threading.Event()

    def __exit__(self, *_error) -> None:
        self.solution.shutdown()

    @cached_property
    def expected(self) -> dict[str, Arrays]:
        """Part → the solution's answers.

        Raises:
            InputError: the solution does not run.
        """
        path = self.folder / f"expected-{self.seed}.npz"
        found = parted(arrays_in(path) or {})
        if found.keys() != self.inputs.keys():
            self.kernels.mkdir(parents=True, exist_ok=True)
            try:
                with process_of_solution(self.kernels) as solution:  # whose kernels are written when it ends
                    found = solution.submit(answers_of_solution, self.assignment.folder, self.seed).result()
            except BrokenExecutor:
                raise InputError(f"assignment {self.assignment.name}: the solution ends its process") from None
            keep_arrays(path, joined(found))
        return found

    def find(self, part: Part, answers: Arrays) -> tuple[dict, ...]:
        """What is probably wrong with the answers to a part; see ``PartResult.findings``."""
        asked = self.assignment.folder, part.name, self.seed, answers, self.expected[part.name]
        try:
            return tuple(self.solution.submit(findings_on, *asked).result())
        except BrokenExecutor:  # the marks do not depend on it
            return ()


def process_of_solution(kernels: Path) -> ProcessPoolExecutor:
    """The process of the solution, which starts when it is first asked."""
    return ProcessPoolExecutor(1, get_context("spawn"), start_solution, (str(kernels),))


def start_solution(kernels: str) -> None:
    """Start Taichi in the solution's process, which keeps its compiled kernels in a folder."""
    from taichi_tracer.teaching.grading import worker  # here, because Windows has no ``resource``

    worker.take_limits({})
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # Ctrl-C is for the grader
    os.environ["TI_OFFLINE_CACHE_FILE_PATH"] = kernels
    runtime.init(arch="cpu", threads=1)


def answers_of_solution(folder: Path, seed: int) -> dict[str, Arrays]:
    """Part → what the solution answers, in its process."""
    assignment = catalogue.load(folder)
    return {part.name: running.expected(assignment, part, assignment.inputs(part, seed)) for part in assignment.parts}


def findings_on(folder: Path, name: str, seed: int, answers: Arrays, expected: Arrays) -> list[dict]:
    """What is probably wrong with the answers to the part of this name; see ``checking.find``."""
    assignment = catalogue.load(folder)
    return checking.find(assignment, assignment.part(name), seed, answers, expected)


def fingerprint(assignment: Assignment) -> str:
    """A hash of everything that marks and hints depend on."""
    digest = hashlib.sha256(taichi_tracer.__version__.encode())
    for root in (assignment.folder, *Path(__file__).parents[:2]):
        for path in sorted(root.glob("*.py")) + sorted((root / "solution").glob("*.py")):
            digest.update(path.name.encode() + path.read_bytes())
    return digest.hexdigest()


# ── grading ──


LONGEST_PRINT = 2000  # characters of what it prints that a report shows


@dataclass(frozen=True)
class GradingSettings:
    """How a class is graded.

    Attributes:
        level: the isolation of each submission. limits: what each may use.
        seed: decides the inputs. jobs: how many submissions are graded at the same time.
        finds: whether wrong answers are explained.
    """

    level: str
    limits: Limits = Limits()
    seed: int = 1
    jobs: int = 1
    finds: bool = True


# ── a class ──


def grade_class(
    assignment: Assignment,
    found: Sequence[Submission],
    settings: GradingSettings,
    watch: Callable[[Mark], Any] | None = None,
) -> list[Mark]:
    """The marks of some submissions, in their order, whatever the order in which they are ready.

    Args:
        watch: a function that is called with each mark as soon as it is known, in this thread.
    """
    with Reference(assignment, settings.seed) as reference, ThreadPoolExecutor(settings.jobs) as pool:
        reference.expected  # noqa: B018 (computed before the threads ask for it)
        marks = [pool.submit(grade, reference, one, settings) for one in found]
        try:
            for mark in as_completed(marks):
                if watch is not None:
                    watch(mark.result())
        except BaseException:
            reference.stopped.set()
            pool.shutdown(wait=False, cancel_futures=True)
            raise
    return [mark.result() for mark in marks]


# ── one submission ──


def grade(reference: Reference, submitted: Submission, settings: GradingSettings) -> Mark:
    """The mark of one submission."""
    assignment = reference.assignment
    with tempfile.TemporaryDirectory(prefix="taichi_tracer_submission_", ignore_cleanup_errors=True) as work:
        try:
            folder, notes = submissions.unpack(submitted, Path(work) / "files", assignment.files)
        except RefusedError as error:
            facts = [(p.name, p.topic, 0.0 if p.is_optional else p.points) for p in assignment.parts]
            parts = [PartResult(MISSING, 0.0, "nothing was unpacked", name=n, topic=t, points=p) for n, t, p in facts]
            return Mark(submitted.key, submitted.student, tuple(parts), clean(error))
        with Runner(reference, folder, settings) as runner:
            marks = {p.name: runner.mark(p) for p in sorted(assignment.parts, key=lambda p: p.replaces != "")}
            parts = [runner.regrade_picture(part, marks) for part in assignment.parts]
        return Mark(submitted.key, submitted.student, tuple(parts), "", tuple(notes), runner.printed)


class Runner(contextlib.AbstractContextManager):
    """Asks a submission's process for one part after the other, and starts it anew where a part has ended it."""

    def __init__(self, reference: Reference, folder: Path, settings: GradingSettings) -> None:
        self.reference, self.folder, self.settings = reference, folder, settings
        self.printed = ""
        self._child: SubmissionProcess | None = None
        self._bad: WorkerEnded | None = None  # why the files cannot be loaded

    def __exit__(self, *_error) -> None:
        self._end()

    def mark(self, part: Part) -> PartResult:
        """The mark of one part."""
        start = time.perf_counter()
        expected = self.reference.expected[part.name]
        blank = PartResult(CRASHED, name=part.name, topic=part.topic, points=part.points)
        try:
            reply, answers = self._ask(part)
        except WorkerEnded as error:
            status = OUT_OF_TIME if error.is_late else CRASHED
            return replace(blank, status=status, message=clean(error.reason), seconds=time.perf_counter() - start)
        seconds = time.perf_counter() - start
        status = reply.get("status")
        if status == NOT_ASKED:
            message = OPTIONAL_TEXT if part.is_optional else NOT_ASKED_TEXT
            return replace(blank, points=0.0, status=MISSING, message=message)
        if status != OK:
            status = status if status in (NOT_WRITTEN, MISSING) else CRASHED
            message = clean(reply.get("message") or "the process did not say what went wrong")
            return replace(blank, status=status, message=message, seconds=seconds)
        if reply.get("only_means") and isinstance(part.judge, Samples):
            part = replace(part, judge=replace(part.judge, only_means=True))
        verdict = judged(part, self.reference.inputs[part.name], answers, expected)
        pictures = {name: np.nan_to_num(picture).astype(np.float32) for name, picture in verdict.pictures.items()}
        is_wanted = self.settings.finds and not self.reference.stopped.is_set()
        is_explained = is_wanted and verdict.status != RIGHT and part.replaces
        findings = self.reference.find(part, answers) if is_explained else ()
        facts = {"first_wrong": to_json(verdict.first_wrong), "findings": tuple(to_json(findings))}
        facts |= {"pictures": pictures, "seconds": seconds}
        share = float(np.clip(np.nan_to_num(verdict.share), 0, 1))
        return replace(blank, status=verdict.status, share=share, message=clean(verdict.message), **facts)

    def regrade_picture(self, part: Part, marks: Mapping[str, PartResult]) -> PartResult:
        """The mark of a part, among those of all. A method that is wrong must not cost its points in every picture.

        The picture is made once more with the solution's methods in place of the wrong ones. What is right then counts,
        multiplied by the share of points that the methods have: nobody gets a picture for the solution's methods alone.
        """
        mark = marks[part.name]
        tested = [one for one in self.reference.assignment.parts if one.replaces and not one.is_optional]
        methods = [marks[one.name] for one in tested]
        wrong = [other.name for other in methods if other.status == WRONG]
        if part.replaces or mark.status != WRONG or not wrong:
            return mark
        try:
            _, answers = self._ask(part, wrong)
        except WorkerEnded:
            return mark
        verdict = judged(part, self.reference.inputs[part.name], answers, self.reference.expected[part.name])
        points = sum(other.points for other in methods)
        share = verdict.share * sum(other.points * other.share for other in methods) / points if points else 0.0
        if not share > mark.share:
            return mark
        message = f"{mark.message}; with the solution's {', '.join(wrong)}, {verdict.message}, and this counts"
        return replace(mark, share=share, message=clean(message))

    def _ask(self, part: Part, mended: Sequence[str] = ()) -> tuple[dict, Arrays]:
        """The answer of the submission's process to one part.

        If the process ends although it has answered other parts, one of these may be to blame. Then the part is asked
        for once more, in a new process; but not if it was only slow.
        """
        request = {"do": "run", "part": part.name, "mended": list(mended)}
        while True:
            is_first = self._child is None
            child = self._child or self._start()
            try:
                return child.ask(request, self.reference.inputs[part.name])
            except WorkerEnded as error:
                self._end()
                if is_first or error.is_late or self.reference.stopped.is_set():
                    raise

    def _start(self) -> SubmissionProcess:
        """Start a process, and let it load the files of the submission."""
        if self._bad is not None:
            raise self._bad
        given, reference = self.reference.assignment.folder, self.reference
        self._child = SubmissionProcess(
            self.settings.level, self.settings.limits, self.folder, reference.kernels, given, reference.stopped
        )
        request = {"do": "load", "assignment": f"assignment/{given.name}", "folder": "submission"}
        try:
            self._child.ask(request, wall=SECONDS_TO_LOAD)
        except WorkerEnded as error:
            self._bad = WorkerEnded(f"loading the files: {error.reason}", error.is_late)
            self._end()
            raise self._bad from None
        return self._child

    def _end(self) -> None:
        if self._child is not None:
            self._child.end()
            self.printed += clean(self._child.output, LONGEST_PRINT - len(self.printed), lines=True)
            self._child = None


def judged(part: Part, inputs: Arrays, answers: Arrays, expected: Arrays) -> PartResult:
    """The verdict on numbers that a submission's process sent; whatever they are, it is a verdict."""
    answers = {name: values for name, values in answers.items() if name in expected}
    try:
        with np.errstate(all="ignore"):
            return part.judge(inputs, answers, expected)
    except Exception as error:  # of numbers that no honest method gives
        return PartResult(CRASHED, 0.0, f"the answers cannot be compared ({type(error).__name__})")


def clean(text: object, longest: int = LONGEST_MESSAGE, lines: bool = False) -> str:
    """Text from a stranger, cut, without characters that would change a terminal."""
    kept = "\n" if lines else ""
    return "".join(c if c.isprintable() or c in kept else "\N{REPLACEMENT CHARACTER}" for c in str(text)[:longest])
