"""The loop of a hand-in's process: it computes numbers, which the grader judges in another process.

The grader starts it (``isolate.SubmissionProcess``), sends requests, and reads the answers:

    {"do": "hello"}                                     → {}: Taichi can be started here
    {"do": "load", "assignment", "folder"}              → {}
    {"do": "run", "part": name} and arrays of inputs    → {"status", "message", "line", "file"} and arrays
    {"do": "run", "part", "mended": names} and arrays   → the same, with the solution's methods of these parts

Every answer has the "ticket" of its request.
"""

import contextlib
import ctypes
import json
import os
import resource
import shutil
import signal
import sys
from dataclasses import replace
from multiprocessing.connection import Connection
from pathlib import Path
from typing import Any

from taichi_tracer.system import runtime
from taichi_tracer.teaching import catalogue, running
from taichi_tracer.teaching.base import Arrays
from taichi_tracer.teaching.grading.isolate import pack, unpack

PR_SET_PDEATHSIG, PR_SET_CHILD_SUBREAPER = 1, 36  # Linux, from its headers


class Work:
    """What a process keeps between requests: the assignment, and the classes under test."""

    assignment: Any = None
    student: Any = None

    def hello(self, _message: dict, _arrays: Arrays) -> tuple[dict, Arrays]:
        """Taichi is running."""
        return {}, {}

    def load(self, message: dict, _arrays: Arrays) -> tuple[dict, Arrays]:
        """Load the solution, and then the hand-in."""
        self.assignment = catalogue.load(message["assignment"])
        running.solution_of(self.assignment)
        self.student = running.load_submission(Path(message["folder"]).resolve(), self.assignment)
        return {}, {}

    def run(self, message: dict, arrays: Arrays) -> tuple[dict, Arrays]:
        """Run one part."""
        part = self.assignment.part(message["part"])
        if not running.is_asked(part, self.student, self.assignment):
            return {"status": running.NOT_ASKED}, {}
        student = self.mended(message["mended"]) if message.get("mended") else self.student
        found = running.answer(self.assignment, part, student, arrays)
        facts = {"status": found.status, "message": found.message, "line": found.line, "file": found.file}
        return facts | {"only_means": running.has_own_distribution(part, self.student)}, found.arrays

    def mended(self, names: list[str]) -> Any:
        """The student's classes with the solution's methods in place of those that some parts test."""
        classes = dict(self.student.together or self.student.classes)
        for part in (self.assignment.part(name) for name in names):
            cls, solution = classes.get(part.replaces), running.solution_of(self.assignment).classes[part.replaces]
            if cls is not None and self.student.is_of_course:
                classes[part.replaces] = cls.without(part.method)
            elif cls is not None:
                method = {part.method: vars(solution)[part.method], "__module__": cls.__module__}
                classes[part.replaces] = type(cls.__name__, (cls,), method)
        return replace(self.student, together=classes)


def main(given: str, folder: str, limits: str) -> None:
    """Take the limits, go into the folder, and answer requests until the grader closes the pipe.

    Args:
        given: the folder with the files. folder: where they are copied, if it is another one.
        limits: the fields of ``isolate.Limits`` as JSON.
    """
    requests, answers = Connection(os.dup(0), writable=False), Connection(os.dup(1), readable=False)
    os.dup2(os.open(os.devnull, os.O_RDONLY), 0)
    os.dup2(2, 1)  # so that prints are no answers
    take_limits(json.loads(limits))
    if folder != given:
        shutil.copytree(given, folder, dirs_exist_ok=True)
    os.chdir(folder)
    runtime.init(arch="cpu", threads=1)
    work = Work()
    with contextlib.suppress(EOFError):  # the grader has closed the pipe
        while True:
            message, arrays = unpack(requests.recv_bytes())
            ticket = {"ticket": message["ticket"]}
            allow_cpu(json.loads(limits)["cpu"])
            facts, found = getattr(work, message["do"])(message, arrays)
            try:
                data = pack(facts | ticket, found)
            except ValueError as error:
                data = pack({"status": "crashed", "message": str(error), **ticket}, {})
            with contextlib.suppress(Exception):  # the hand-in may have closed or replaced it
                sys.stdout.flush()
            answers.send_bytes(data)
    os._exit(0)


def take_limits(limits: dict) -> None:
    """The limits that hold for this process and for those that it starts; none of them can be raised again.

    Args:
        limits: the fields of ``isolate.Limits``; empty for the solution's process, which only ends with the grader.
    """
    if sys.platform == "linux":
        ctypes.CDLL(None).prctl(PR_SET_PDEATHSIG, signal.SIGKILL)
        ctypes.CDLL(None).prctl(PR_SET_CHILD_SUBREAPER, 1)  # so that no process that it starts leaves it
    names = {"FSIZE": "file", "NOFILE": "files", "NPROC": "processes"}
    names |= {"AS": "address_space"} if sys.platform == "linux" else {}  # macOS cannot limit it
    for name, limit in names.items() if limits else ():
        number = getattr(resource, f"RLIMIT_{name}")
        _, hard = resource.getrlimit(number)
        value = limits[limit] if hard == resource.RLIM_INFINITY else min(limits[limit], hard)
        resource.setrlimit(number, (value, value))
    resource.setrlimit(resource.RLIMIT_CORE, (0, 0))


def allow_cpu(seconds: float) -> None:
    """The process is ended with SIGXCPU when it has used so many more seconds of CPU."""
    used = resource.getrusage(resource.RUSAGE_SELF)
    _, hard = resource.getrlimit(resource.RLIMIT_CPU)
    resource.setrlimit(resource.RLIMIT_CPU, (int(used.ru_utime + used.ru_stime + seconds) + 1, hard))


if __name__ == "__main__":
    main(*sys.argv[1:])
