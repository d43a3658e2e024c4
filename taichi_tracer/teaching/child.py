"""The loop of a submission's process: it computes numbers, which the grader judges in another process.

The grader starts it (``sandbox.SubmissionProcess``), sends requests as frames, and reads frames with the answers:

    {"do": "hello"}                                     → {"status": "ok"}: Taichi can be started here
    {"do": "load", "assignment", "order", "folder", "files"}  → {"absent": names of parts}: it has no such class
    {"do": "run", "part": name} and arrays of inputs          → {"status", "message", "line", "file"} and arrays
    {"do": "run", "part", "mended": names} and arrays         → the same, with the solution's methods of these parts

The assignment of a submission's process is an outline without the solution. A request to run a part brings, as
"solution", the methods that stand beside it: file → text; see ``outline``.

A process without a folder runs the solution. It is the grader's own, and can be asked for the mistakes that explain a
wrong answer, too:

    {"do": "find", "part", "seed"} and arrays → {"findings": [{"names", "share", "text", "hint" …}]}

The arrays of this request are called "inputs/NAME", "answers/NAME" and "expected/NAME". Every answer has the "ticket"
of its request.
"""

import contextlib
import sys
import tempfile
from dataclasses import asdict, replace
from pathlib import Path
from typing import Any

import numpy as np

from taichi_tracer.teaching import frames, walls

Arrays = dict[str, np.ndarray]


class Work:
    """What a process keeps between requests: the assignment, and the classes under test."""

    def __init__(self) -> None:
        self.assignment: Any = None
        self.student: Any = None
        self.solution: Any = None

    def answer(self, message: dict, arrays: Arrays) -> tuple[dict, Arrays]:
        """The reply to one request."""
        return getattr(self, f"do_{message['do']}")(message, arrays)

    def do_hello(self, message: dict, _arrays: Arrays) -> tuple[dict, Arrays]:
        """Start Taichi, unless the request says that it is not needed."""
        if message.get("starts_taichi", True):
            from taichi_tracer.system import runtime

            runtime.init(arch="cpu", threads=message.get("threads", 1))
        return {"status": "ok"}, {}

    def do_load(self, message: dict, arrays: Arrays) -> tuple[dict, Arrays]:
        """Load the solution, or the outline of it, and then the submission."""
        from taichi_tracer.teaching import catalogue, loading

        self.do_hello(message, arrays)
        self.assignment = catalogue.load(message["assignment"])
        self.solution = self.student = loading.solution_of(self.assignment)
        if message.get("folder"):
            self.solution.order = tuple(message.get("order", ()))
            folder, files = Path(message["folder"]).resolve(), message.get("files")
            if files and not loading.load_submission(folder, self.assignment).is_of_course:
                self.student = loading.load_classes(folder, files, self.solution)
            else:
                self.student = loading.load_submission(folder, self.assignment)
        return {"absent": [part.name for part in self.assignment.parts if self.is_absent(part)]}, {}

    def is_absent(self, part: Any) -> bool:
        """Whether the submission has nothing that a part could test: the solution stands in its place elsewhere."""
        from taichi_tracer.teaching import running

        has_class = part.replaces == "" or part.replaces in self.student.classes
        return not has_class or not running.is_asked(part, self.student, self.assignment)

    def do_run(self, message: dict, arrays: Arrays) -> tuple[dict, Arrays]:
        """Run one part."""
        from taichi_tracer.teaching import running

        part, files = self.assignment.part(message["part"]), dict(self.assignment.classes)
        if not running.is_asked(part, self.student, self.assignment):
            return {"status": running.NOT_ASKED}, {}
        if message.get("solution"):
            self.solution.learn(message["solution"], Path(tempfile.mkdtemp()))
        student = self.mended(message["mended"]) if message.get("mended") else self.student
        found = running.answer(part, student, self.solution, arrays, files)
        facts = {"status": found.status, "message": found.message, "line": found.line, "file": found.file}
        facts["only_means"] = running.has_own_distribution(part, self.student)
        return facts, found.arrays

    def mended(self, names: list[str]) -> Any:
        """The student's classes with the solution's methods in place of those that some parts test."""
        classes = dict(self.student.together or self.student.classes)
        for part in (self.assignment.part(name) for name in names):
            cls, solution = classes.get(part.replaces), self.solution.classes[part.replaces]
            if cls is not None and self.student.is_of_course:
                classes[part.replaces] = cls.without(part.method)
            elif cls is not None:
                method = {part.method: vars(solution)[part.method], "__module__": cls.__module__}
                classes[part.replaces] = type(cls.__name__, (cls,), method)
        return replace(self.student, together=classes)

    def do_find(self, message: dict, arrays: Arrays) -> tuple[dict, Arrays]:
        """Which known mistakes give these answers."""
        from taichi_tracer.teaching import kept, mistakes

        groups: dict[str, Arrays] = {"inputs": {}, "answers": {}, "expected": {}} | kept.parted(arrays)
        part = self.assignment.part(message["part"])
        mistakes.prepare(self.assignment, message["seed"], [part])
        found = mistakes.find(self.assignment, part, *groups.values())
        return {"findings": [asdict(finding) for finding in found]}, {}


def serve(requests: int, answers: int, seconds_of_cpu: float | None) -> None:
    """Answer requests until the grader closes the pipe.

    Args:
        requests, answers: descriptors of the pipes.
        seconds_of_cpu: what one request may cost before the process gets a SIGXCPU; None is no limit.
    """
    work = Work()
    while (request := frames.read(requests)) is not None:
        message, arrays = request
        ticket = {"ticket": message.get("ticket")}
        if seconds_of_cpu is not None:
            walls.allow_cpu(seconds_of_cpu)
        reply, found = work.answer(message, arrays)
        try:
            data = frames.encode(reply | ticket, found)
        except frames.FrameError as error:
            data = frames.encode({"status": "crashed", "message": str(error), **ticket})
        with contextlib.suppress(Exception):  # the submission may have closed or replaced it
            sys.stdout.flush()
        frames.write_bytes(answers, data)
