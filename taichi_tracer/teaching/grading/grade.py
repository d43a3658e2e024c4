"""Grades a class: every submission in a process of its own, part by part, each part beside the solution's other parts.

The grader never loads a submission's code. It sends inputs to the submission's process, compares the numbers that come
back with those of the solution, and starts the process anew if a part ends it.

The solution runs in a process of its own, too, without limits, so that Taichi never runs in the grader's. Its answers
depend on the assignment, the package and the seed alone, and are computed once for a class. The compiled kernels are
kept in the user's cache; every submission gets a copy.
"""

import math
import tempfile
import threading
from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor, as_completed
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np

from taichi_tracer.system.errors import InputError
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
    cache_folder,
    joined,
)
from taichi_tracer.teaching.grading import submissions
from taichi_tracer.teaching.grading.isolate import Limits, run
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

    @property
    def remarks(self) -> list[str]:
        """What is unusual about the files, and what was printed, for the student."""
        refused = [f"This submission was not unpacked: {self.refused}"] * bool(self.refused)
        return [*refused, *self.notes, *[f"What it printed:\n{self.printed}"] * bool(self.printed.strip())]

    def facts(self) -> dict:
        """The mark for JSON, with its sums."""
        parts = [{name: getattr(part, name) for name in (*OF_A_PART, "earned")} for part in self.parts]
        return {**vars(self), "parts": parts, "score": self.score, "earned": self.score, "points": self.points}


def most_points(marks: Sequence[Mark]) -> float:
    """The points that can be had in a class, with the optional parts that somebody handed in."""
    return max(mark.points for mark in marks)


# ── answers ──


OF_THE_SOLUTION = Limits(600.0, 600.0, address_space=1 << 46, resident=1 << 46, file=1 << 40, files=4096)


class Reference:
    """What is asked of one class, and the right answers.

    Args:
        assignment: what is graded. seed: decides the inputs.

    Attributes:
        kernels: the folder with the compiled kernels of the solution.
        stopped: is set when the processes of hand-ins are to end, and no marks are kept.
    """

    def __init__(self, assignment: Assignment, seed: int) -> None:
        self.assignment, self.seed = assignment, seed
        self.kernels = cache_folder() / assignment.name
        self.kernels.mkdir(parents=True, exist_ok=True)
        self.inputs = {part.name: assignment.inputs(part, seed) for part in assignment.parts}
        self.stopped = threading.Event()

    @cached_property
    def expected(self) -> dict[str, Arrays]:
        """Part → the solution's answers.

        Raises:
            InputError: the solution does not run.
        """
        answers, printed = self.ask([({"part": name}, inputs) for name, inputs in self.inputs.items()])
        for name, (reply, _) in zip(self.inputs, answers, strict=True):
            if reply["status"] != OK:
                message = f"the solution of {name} fails: {reply['message']} {printed[-300:]}"
                raise InputError(f"assignment {self.assignment.name}: {' '.join(message.split())}")
        return {name: arrays for name, (_, arrays) in zip(self.inputs, answers, strict=True)}

    def ask(
        self,
        requests: Sequence[tuple[dict, Arrays]],
        level: str = "limits",
        limits: Limits = OF_THE_SOLUTION,
        submission: Path | None = None,
    ) -> tuple[list[tuple[dict, Arrays]], str]:
        """(answers, prints) of processes with a submission, or with the solution; see ``worker``.

        If a process ends although it has answered other requests, one of these may be to blame. Then it is asked once
        more, in a new process; but not if it was only slow.
        """
        folder = self.assignment.folder
        load = {"part": "", "assignment": str(folder), "submission": ""}
        folders, kernels = {}, self.kernels
        if submission is not None:
            load |= {"assignment": f"assignment/{folder.name}", "submission": "submission"}
            folders, kernels = {"submission": submission, "cache": self.kernels, load["assignment"]: folder}, None
        found, printed = [], ""
        while len(found) < len(requests):
            asked = [(load, {}), *requests[len(found) :]]
            answers, prints, reason, is_late = run(level, limits, asked, folders, self.stopped, kernels)
            found += answers[1:]
            printed += clean(prints, LONGEST_PRINT - len(printed), lines=True)
            failed = {"status": OUT_OF_TIME if is_late else CRASHED, "message": reason}
            if not answers:
                failed["message"] = f"loading the files: {reason}"
                found += [(failed, {})] * (len(requests) - len(found))
            elif len(found) < len(requests) and (is_late or len(answers) == 1):
                found.append((failed, {}))
        return found, printed

    def explained(self, marks: Sequence[Mark]) -> list[Mark]:
        """Marks with what is probably wrong in place of answers that are wrong."""
        wrong = [part for mark in marks for part in mark.parts if part.arrays]
        arrays = [joined({"answers": part.arrays, "expected": self.expected[part.name]}) for part in wrong]
        facts = [{"part": part.name, "seed": self.seed} for part in wrong]
        answers, _ = self.ask(list(zip(facts, arrays, strict=True)))
        findings = iter(reply.get("findings", ()) for reply, _ in answers)
        explained = []
        for mark in marks:
            parts = (replace(p, arrays={}, findings=tuple(next(findings))) if p.arrays else p for p in mark.parts)
            explained.append(replace(mark, parts=tuple(parts)))
        return explained


# ── grading ──


LONGEST_PRINT = 2000  # characters of what it prints that a report shows


@dataclass(frozen=True)
class GradingSettings:
    """How a class is graded.

    Attributes:
        level: the isolation of each submission. limits: what each may use.
        seed: decides the inputs. jobs: how many submissions are graded at the same time.
    """

    level: str
    limits: Limits = Limits()
    seed: int = 1
    jobs: int = 1


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
    reference = Reference(assignment, settings.seed)
    reference.expected  # noqa: B018 (computed before the threads ask for it)
    with ThreadPoolExecutor(settings.jobs) as pool:
        marks = [pool.submit(grade, reference, one, settings) for one in found]
        try:
            for mark in as_completed(marks):
                if watch is not None:
                    watch(mark.result())
        except BaseException:
            reference.stopped.set()
            pool.shutdown(wait=False, cancel_futures=True)
            raise
    return reference.explained([mark.result() for mark in marks])


# ── one submission ──


def grade(reference: Reference, submitted: Submission, settings: GradingSettings) -> Mark:
    """The mark of one submission; the results of wrong methods have their answers, see ``Reference.explained``."""
    assignment = reference.assignment
    with tempfile.TemporaryDirectory(prefix="taichi_tracer_submission_", ignore_cleanup_errors=True) as work:
        try:
            folder, notes = submissions.unpack(submitted, Path(work) / "files", assignment.files)
        except RefusedError as error:
            facts = [(p.name, p.topic, 0.0 if p.is_optional else p.points) for p in assignment.parts]
            parts = [PartResult(MISSING, 0.0, "nothing was unpacked", name=n, topic=t, points=p) for n, t, p in facts]
            return Mark(submitted.key, submitted.student, tuple(parts), clean(error))
        process = {"level": settings.level, "limits": settings.limits, "submission": folder}
        asked = sorted(assignment.parts, key=lambda part: part.replaces != "")  # pictures first
        answers, printed = reference.ask([({"part": p.name}, reference.inputs[p.name]) for p in asked], **process)
        marks = {part.name: mark_of(reference, part, *answer) for part, answer in zip(asked, answers, strict=True)}
        methods = [marks[part.name] for part in asked if part.replaces and not part.is_optional]
        mended = [one.name for one in methods if one.status == WRONG]
        again = [part for part in asked if not part.replaces and marks[part.name].status == WRONG and mended]
        requests = [({"part": p.name, "mended": mended}, reference.inputs[p.name]) for p in again]
        for part, (reply, arrays) in zip(again, reference.ask(requests, **process)[0], strict=True):
            if reply.get("status") == OK:
                marks[part.name] = regraded(reference, part, marks[part.name], arrays, methods)
    parts = tuple(marks[part.name] for part in assignment.parts)
    return Mark(submitted.key, submitted.student, parts, "", tuple(notes), printed)


def mark_of(reference: Reference, part: Part, reply: dict, answers: Arrays) -> PartResult:
    """The mark of one part."""
    status, seconds = reply.get("status"), reply.get("seconds")
    seconds = seconds if isinstance(seconds, float) and math.isfinite(seconds) else 0.0
    blank = PartResult(CRASHED, name=part.name, topic=part.topic, points=part.points, seconds=seconds)
    if status == NOT_ASKED:
        message = OPTIONAL_TEXT if part.is_optional else NOT_ASKED_TEXT
        return replace(blank, points=0.0, status=MISSING, message=message)
    if status != OK:
        status = status if status in (NOT_WRITTEN, MISSING, OUT_OF_TIME) else CRASHED
        message = clean(reply.get("message") or "the process did not say what went wrong")
        return replace(blank, status=status, message=message)
    if reply.get("only_means") and isinstance(part.judge, Samples):
        part = replace(part, judge=replace(part.judge, only_means=True))
    verdict = judged(part, reference.inputs[part.name], answers, reference.expected[part.name])
    pictures = {name: np.nan_to_num(picture).astype(np.float32) for name, picture in verdict.pictures.items()}
    share = float(np.clip(np.nan_to_num(verdict.share), 0, 1))
    facts = {"message": clean(verdict.message), "first_wrong": verdict.first_wrong, "pictures": pictures}
    kept = answers if part.replaces and verdict.status != RIGHT else {}
    return replace(blank, status=verdict.status, share=share, arrays=kept, **facts)


def regraded(
    reference: Reference, part: Part, mark: PartResult, answers: Arrays, methods: Sequence[PartResult]
) -> PartResult:
    """The mark of a wrong picture. A method that is wrong must not cost its points in every picture.

    The picture was made once more with the solution's methods in place of the wrong ones. What is right then counts,
    multiplied by the share of points that the methods have: nobody gets a picture for the solution's methods alone.
    """
    verdict = judged(part, reference.inputs[part.name], answers, reference.expected[part.name])
    points, wrong = sum(one.points for one in methods), [one.name for one in methods if one.status == WRONG]
    share = verdict.share * sum(one.points * one.share for one in methods) / points if points else 0.0
    if not share > mark.share:
        return mark
    message = f"{mark.message}; with the solution's {', '.join(wrong)}, {verdict.message}, and this counts"
    return replace(mark, share=share, message=clean(message))


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
