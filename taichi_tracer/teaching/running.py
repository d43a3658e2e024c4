"""Runs a part: puts together the class under test, and says what happened.

Each part is tested by itself. The class under test has the student's method, and the student's own helpers; the
methods of the handout that it may call come from the solution. So a wrong camera matrix does not cost
the points of the ray.
"""

import contextlib
import sys
from collections.abc import Iterator
from typing import Any

import numpy as np
import taichi as ti

from taichi_tracer.course import files as course_files
from taichi_tracer.formulas.random_numbers import RandomNumbers
from taichi_tracer.system.compile_time import compile_time
from taichi_tracer.system.errors import InputError
from taichi_tracer.system.own_code import rules
from taichi_tracer.system.own_code.source import is_empty
from taichi_tracer.teaching.base import MISSING, NOT_WRITTEN, Arrays, Assignment, Part, PartResult
from taichi_tracer.teaching.handout import sealed
from taichi_tracer.teaching.handout.stubs import is_placeholder, is_stub, line_of_mark
from taichi_tracer.teaching.student_import import OK, Loaded, crash, solution_of

NOT_ASKED = "not asked"  # by the course's own handout: see ``is_asked``
NOT_ASKED_TEXT = "the course's own handout does not ask for it: it is not judged"
OPTIONAL_TEXT = "it is optional, for graduate students, and was not handed in: nothing is lost"


def class_under_test(student: type, part: Part, solution: Loaded) -> type:
    """A class with the method of a part as the student wrote it, and the solution's methods beside it."""
    if hasattr(student, "alone"):  # of the course: the other methods are the package's
        return student.alone(part.method)
    others = solution.beside(part)
    return type(student.__name__, (student,), {**others, "__module__": student.__module__}) if others else student


def own_method(cls: type, name: str) -> object | None:
    """A method that the student's class or a base of the student's own defines; None if only the package has it."""
    for base in cls.__mro__:
        if base.__module__.split(".")[0] == "taichi_tracer" and "teaching" not in base.__module__:
            return None
        if name in vars(base):
            return getattr(vars(base)[name], "written", vars(base)[name])
    return None


def is_asked(part: Part, student: Loaded, assignment: Assignment) -> bool:
    """Whether a part is judged: the handouts of the course do not ask for all of them, and some are optional."""
    if student.is_of_course and not course_files.asks_for(assignment.name, part.name):
        return False
    return not part.is_optional or is_handed_in(part, student)


def is_handed_in(part: Part, student: Loaded) -> bool:
    """Whether a student has written the method of a part, or a file for it that cannot be run."""
    if part.replaces in student.failed:
        return True
    cls = student.classes.get(part.replaces)
    method = None if cls is None else own_method(cls, part.method)
    if method is None or is_stub(method):
        return False
    return not student.is_of_course or not is_placeholder(cls, part.method)


def has_own_distribution(part: Part, student: Loaded) -> bool:
    """Whether the samples of a part may be distributed in another way than the solution's, with the same mean."""
    return student.is_of_course and part.method == "shade_ray"


def answer(
    part: Part, student: Loaded, solution: Loaded, inputs: Arrays, files: dict[str, str] | None = None
) -> PartResult:
    """Run a part on the student's classes.

    Args:
        files: class → file, see ``Assignment.classes``. A class that is missing because its file failed has the message
            of that failure.
    """
    files = files or {}
    try:
        if part.replaces == "":
            if student.errors:
                return next(iter(student.errors.values()))
            stubs = [name for name in student.stubs() if name not in solution.optional]
            if stubs:
                return PartResult(NOT_WRITTEN, message=f"it needs what is not written yet, such as {stubs[0]}")
            subject: Any = student.namespace(solution)
        else:
            cls = student.classes.get(part.replaces)
            if cls is None:
                reason = student.failed.get(part.replaces) or student.errors.get(files.get(part.replaces, ""))
                return reason or PartResult(MISSING, message=f"there is no class {part.replaces}")
            if part.method in getattr(cls, "other_arguments", {}):
                return crash(cls.other_arguments[part.method], student.folder)  # type: ignore[attr-defined]
            method = own_method(cls, part.method)
            if method is None:
                return PartResult(MISSING, message=f"{part.replaces} has no method {part.method}")
            if is_stub(method):
                return PartResult(NOT_WRITTEN, message="it is not written yet", line=line_of_mark(method))
            if is_empty(method):
                return PartResult(NOT_WRITTEN, message="it does nothing, and returns nothing")
            subject = class_under_test(cls, part, solution)
            right = vars(solution.classes.get(part.replaces, object)).get(part.method)
            rules.check_whole(part.name, method, subject, right)
        with (
            with_values(ti, {"random": next_number}),  # the same submission has the same numbers on every run
            without_the_packages(subject, part),
            beside_the_solution(part, student, solution, files),
        ):
            arrays = part.run(subject, inputs)
        return PartResult(OK, arrays={name: np.ascontiguousarray(array) for name, array in arrays.items()})
    except KeyboardInterrupt:
        raise
    except BaseException as error:  # noqa: BLE001 (a student's code may raise anything)
        return crash(error, student.folder)


@contextlib.contextmanager
def with_values(place: Any, values: dict[str, Any]) -> Iterator[None]:
    """Let attributes of a class or a module have other values meanwhile."""
    former = {name: vars(place)[name] for name in values if name in vars(place)}
    for name, value in values.items():
        setattr(place, name, value)
    try:
        yield
    finally:
        for name in values:
            delattr(place, name)
        for name, value in former.items():
            setattr(place, name, value)


def without_the_packages(subject: Any, part: Part) -> contextlib.ExitStack:
    """While a part runs, the package's own method of this name is an error: a student's must not call it instead.

    This is a rule of the course and no wall, as everything that runs in the process of the submission.
    """
    name = f"{part.replaces}.{part.method}"

    @compile_time
    def refuse(*_arguments, **_named):
        raise InputError(f"{name} calls the package's own {part.method}, which it should replace")

    stack = contextlib.ExitStack()
    for cls in subject.__mro__ if part.replaces else ():
        if cls.__module__.startswith("taichi_tracer.") and part.method in vars(cls):
            stack.enter_context(with_values(cls, {part.method: staticmethod(refuse)}))
    return stack


def beside_the_solution(
    part: Part, student: Loaded, solution: Loaded, files: dict[str, str]
) -> contextlib.AbstractContextManager:
    """While a part runs, the solution's classes stand in a notebook in place of those that other cells define.

    So a wrong sampler does not cost the points of a renderer. In folders, ``load_submission`` sees to this.

    Args:
        files: class → file; a class of the same file as the class under test stays.
    """
    cls = student.classes.get(part.replaces)
    if cls is None or student.folder is not None:
        return contextlib.nullcontext()
    roles = {role: role for role in files} | {own.__name__: role for role, own in student.classes.items()}
    others = {name: role for name, role in roles.items() if files.get(role) != files.get(part.replaces)}
    replaced = {name: solution.classes[role] for name, role in others.items() if role in solution.classes}
    return with_values(sys.modules[cls.__module__], replaced)


# ── random numbers ──


@compile_time
def next_number(*_type):
    """One number of the sample that the kernel began; used in place of ``ti.random``, which differs from run to run."""
    rng = RandomNumbers.of_this_kernel()
    if rng is None:
        return _ORIGINAL_RANDOM(*_type)
    return rng.next_1d()


_ORIGINAL_RANDOM = ti.random


def expected(assignment: Assignment, part: Part, inputs: Arrays) -> Arrays:
    """What the solution answers; an InputError if it does not run."""
    if assignment.is_sealed:
        return sealed.answers_to_part(assignment, part, inputs)
    solution = solution_of(assignment)
    found = answer(part, solution, solution, inputs, dict(assignment.classes))
    if found.status != OK:
        raise InputError(f"assignment {assignment.name}: the solution of {part.name} fails: {found.message}")
    return found.arrays
