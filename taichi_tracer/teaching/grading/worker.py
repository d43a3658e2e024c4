"""The process of a hand-in: it computes numbers, which the grader judges in another process.

The grader starts it (``isolate.run``) with messages in the file "requests", and reads those that it writes to stdout:

    {"part": "", "assignment", "submission"}       → {"part": ""}: the files are loaded; without an assignment, Taichi
                                                     can be started here; without a submission, the solution is asked
    {"part", "mended"} and arrays of inputs        → {"part", "status", "message", "seconds"} and arrays; the solution's
                                                     methods of the "mended" parts stand in place of the student's
    {"part", "seed"} and "answers/…", "expected/…" → {"part", "findings"}: what is probably wrong with the answers
"""

import contextlib
import ctypes
import json
import os
import resource
import shutil
import signal
import sys
import time
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import taichi as ti

from taichi_tracer.system import runtime
from taichi_tracer.system.importing import import_quickly
from taichi_tracer.teaching import catalogue, checking, running
from taichi_tracer.teaching.base import Arrays, Assignment, parted
from taichi_tracer.teaching.grading.isolate import messages, pack

PR_SET_PDEATHSIG, PR_SET_CHILD_SUBREAPER = 1, 36  # Linux, from its headers


def main(given: str, folder: str, limits: str) -> None:
    """Take the limits, go into the folder, and answer all requests.

    Args:
        given: the folder with the files and the requests. folder: where they are copied, if it is another one.
        limits: the fields of ``isolate.Limits`` as JSON.
    """
    (load, _), *requests = messages(Path(given, "requests").read_bytes())
    answers, numbers = os.fdopen(os.dup(1), "wb"), json.loads(limits)
    os.dup2(2, 1)  # so that prints are no answers
    take_limits(numbers)
    if folder != given:
        shutil.copytree(given, folder, dirs_exist_ok=True)
    os.chdir(folder)
    runtime.init(arch="cpu", threads=1)
    allow_cpu(numbers["cpu"])
    if load["assignment"]:
        assignment = catalogue.load(load["assignment"])
        student = running.solution_of(assignment)
        if load["submission"]:
            student = running.load_submission(Path(load["submission"]).resolve(), assignment)
    answers.write(pack({"part": ""}, {}))
    answers.flush()
    for message, arrays in requests:
        allow_cpu(numbers["cpu"])
        facts, found = answer_to(message, arrays, assignment, student)
        with contextlib.suppress(Exception):  # the hand-in may have closed or replaced it
            sys.stdout.flush()
        answers.write(pack(facts | {"part": message["part"]}, found))
        answers.flush()
    if not load.get("submission"):
        ti.reset()  # which writes its compiled kernels
    os._exit(0)


def answer_to(message: dict, arrays: Arrays, assignment: Assignment, student: running.Loaded) -> tuple[dict, Arrays]:
    """The answer to one request, but for its part."""
    part, start = assignment.part(message["part"]), time.perf_counter()
    if "seed" in message:
        groups = parted(arrays)
        found = checking.find(assignment, part, message["seed"], groups["answers"], groups["expected"])
        return {"findings": found}, {}
    if not running.is_asked(part, student, assignment):
        return {"status": running.NOT_ASKED}, {}
    result = running.answer(assignment, part, mended(student, assignment, message.get("mended", ())), arrays)
    facts = {"status": result.status, "message": result.message, "seconds": time.perf_counter() - start}
    return facts | {"only_means": running.has_own_distribution(part, student)}, result.arrays


def mended(student: running.Loaded, assignment: Assignment, names: Sequence[str]) -> running.Loaded:
    """The student's classes with the solution's methods in place of those that some parts test."""
    classes = dict(student.together or student.classes)
    for part in (assignment.part(name) for name in names):
        cls, solution = classes.get(part.replaces), running.solution_of(assignment).classes[part.replaces]
        if cls is not None and student.is_of_course:
            classes[part.replaces] = import_quickly("taichi_tracer.course.adapters").without(cls, part.method)
        elif cls is not None:
            method = {part.method: vars(solution)[part.method], "__module__": cls.__module__}
            classes[part.replaces] = type(cls.__name__, (cls,), method)
    return replace(student, together=classes)


def take_limits(limits: dict) -> None:
    """The limits that hold for this process and for those that it starts; none of them can be raised again."""
    if sys.platform == "linux":
        ctypes.CDLL(None).prctl(PR_SET_PDEATHSIG, signal.SIGKILL)
        ctypes.CDLL(None).prctl(PR_SET_CHILD_SUBREAPER, 1)  # so that no process that it starts leaves it
    most = {"FSIZE": limits["file"], "NOFILE": limits["files"], "NPROC": limits["processes"], "CORE": 0}
    most |= {"AS": limits["address_space"]} if sys.platform == "linux" else {}  # macOS cannot limit it
    for name, value in most.items():
        with contextlib.suppress(ValueError):  # a lower limit holds already
            resource.setrlimit(getattr(resource, f"RLIMIT_{name}"), (value, value))


def allow_cpu(seconds: float) -> None:
    """The process is ended with SIGXCPU when it has used so many more seconds of CPU."""
    used = resource.getrusage(resource.RUSAGE_SELF)
    _, hard = resource.getrlimit(resource.RLIMIT_CPU)
    resource.setrlimit(resource.RLIMIT_CPU, (int(used.ru_utime + used.ru_stime + seconds) + 1, hard))


if __name__ == "__main__":
    main(*sys.argv[1:])
