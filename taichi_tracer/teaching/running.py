"""Runs a part: loads a student's classes, puts together the class under test, and says what happened.

Each part is tested by itself. The class under test has the student's method, and the student's own helpers; the
methods of the handout that it may call come from the solution. So a wrong camera matrix does not cost
the points of the ray.
"""

import re
import sys
import traceback
import types
from collections.abc import Mapping, Sequence
from contextlib import ExitStack
from dataclasses import dataclass, field
from functools import cache
from pathlib import Path
from typing import Any
from unittest.mock import patch

import numpy as np
import taichi as ti

from taichi_tracer.course import files as course_files
from taichi_tracer.formulas.random_numbers import RandomNumbers
from taichi_tracer.system.compile_time import compile_time
from taichi_tracer.system.errors import InputError, OwnCodeError
from taichi_tracer.system.importing import import_quickly
from taichi_tracer.system.own_code import checks
from taichi_tracer.system.own_code.checks import is_empty, is_own_file, unwrap
from taichi_tracer.teaching import catalogue
from taichi_tracer.teaching.base import CRASHED, MISSING, NOT_WRITTEN, Arrays, Assignment, Part, PartResult
from taichi_tracer.teaching.handout.stubs import is_placeholder, is_stub, line_of_mark

# ── loading classes ──


OK = "ok"
LONGEST_MESSAGE = 300  # characters of an error, or of what a submission's process says, that a report shows


@dataclass
class Loaded:
    """The classes of a folder.

    Attributes:
        classes: name → class. together: the same, if they had to be run again for this; see ``load_submission``.
        errors: name of a file that could not be run → why.
        folder: where they come from; None for classes of a notebook.
        is_of_course: whether they were written for the course, whose handouts do not ask for all parts.
        failed: class that only optional parts need → why its file could not be run.
        package: the name of the package whose modules the files are.
    """

    classes: dict[str, type]
    errors: dict[str, PartResult] = field(default_factory=dict)
    folder: Path | None = None
    together: dict[str, type] = field(default_factory=dict)
    is_of_course: bool = False
    failed: dict[str, PartResult] = field(default_factory=dict)
    package: str = ""


def load_submission(folder: str | Path, assignment: Assignment) -> Loaded:
    """The classes of a student's folder. Each file is run with the solution's version of the other files.

    So a renderer that imports a wrong sampler is tested with the right one. For pictures, ``together`` has the classes
    of files that import each other as they are.
    """
    of_course = course_files.folder_of_course(folder, assignment.files)
    if of_course is not None:
        return load_of_course(of_course, assignment)
    solution = solution_of(assignment)
    together = load_classes(folder, assignment.files)
    alone = Loaded({}, dict(together.errors), together.folder, together.classes)
    for file in assignment.files:
        if file in together.errors and together.errors[file].status == MISSING:
            continue
        loaded = load_classes(folder, [file], solution)
        if loaded.errors:  # it imports something from another file that only the student's own version has
            loaded = together
        else:
            alone.errors.pop(file, None)  # it failed only because of another file
        alone.classes |= {name: cls for name, cls in loaded.classes.items() if assignment.classes.get(name) == file}
    return alone


def load_of_course(folder: Path, assignment: Assignment) -> Loaded:
    """The classes of files that were written for the course, behind their adapters."""
    adapters = import_quickly("taichi_tracer.course.adapters")
    found, asked = course_files.load(folder), course_files.ASKED.get(assignment.name, {})
    graduate, files = course_files.GRADUATE.get(assignment.name, {}), dict.fromkeys(asked.values())
    crashed = {file: crash(error, found.folder) for file, error in found.errors.items()}
    missing = {file: missing_file(file) for file in files if not (found.folder / file).is_file()}
    failed = {name: crashed[file] for name, file in graduate.items() if file in crashed and file not in files}
    classes = adapters.adapters_of(found.classes)
    own = {name: cls for name, cls in classes.items() if name in asked or name in graduate}
    reasons = crashed | missing  # for each of the assignment's own files, some of which have other names
    errors = {assignment.classes.get(name, file): reasons[file] for name, file in asked.items() if file in reasons}
    return Loaded(own, errors, found.folder, is_of_course=True, failed=failed)


def load_classes(folder: str | Path, names: Sequence[str], others: Loaded | None = None) -> Loaded:
    """The classes that some files of a folder define. A file that is missing or fails becomes an entry of ``errors``.

    Args:
        others: the classes of a folder in which imports of files that are not among ``names`` are found first.
    """
    folder = Path(folder).resolve()

    def module_of(own: Any, name: str, level: int) -> str:
        """The module of a file that another file imports."""
        file = f"{name}.py"
        if level == 0 and file not in names and others and others.folder and (others.folder / file).is_file():
            return f"{others.package}.{name}"
        is_own = level > 0 or (own.folder / f"{name}.py").is_file()
        return f"{own.package}.{name}" if is_own else name

    missing = [name for name in names if not (folder / name).is_file()]
    own = course_files.StudentFiles(folder, module_of)
    found = course_files.run_files(own, [name for name in names if name not in missing])
    errors = {name: crash(error, folder) for name, error in found.errors.items()}
    errors |= {name: missing_file(name) for name in missing}
    return Loaded(found.classes, errors, folder, package=found.package)


def missing_file(name: str) -> PartResult:
    """What is known about the parts of a file that was not handed in."""
    return PartResult(MISSING, message=f"the file {name} is missing", file=name)


def crash(error: BaseException, folder: Path | None) -> PartResult:
    """What is known about an exception of the student's code."""
    if isinstance(error, OwnCodeError):
        file, line, message = Path(error.file).name, error.line, error.text
    else:
        file, line = place_of(error, folder)
        message = f"{type(error).__name__}: {one_line(error)}"
    where = f"{file}:{line}: " if line else ""
    return PartResult(CRASHED, message=f"{where}{message}"[:LONGEST_MESSAGE], line=line, file=file)


def one_line(error: BaseException) -> str:
    """The last line of a message: Taichi puts what is wrong there, after the lines of the source."""
    if isinstance(error, SyntaxError) and "\n" not in error.msg:
        return f"{error.msg}: {error.text.strip()}" if error.text else error.msg
    lines = [line.strip() for line in str(error).splitlines() if line.strip(" ^~")]
    last = lines[-1] if lines else ""
    return last.removeprefix("[").strip() if last.count("[") > last.count("]") else last


def place_of(error: BaseException, folder: Path | None) -> tuple[str, int]:
    """(name of the file, line) of the innermost line of the student's code; ("", 0) if the error is elsewhere."""
    if isinstance(error, SyntaxError) and error.filename:
        return Path(error.filename).name, error.lineno or 0
    pattern = re.compile(r'File "([^"]+)", line (\d+)')
    named = [(Path(file), int(line)) for file, line in pattern.findall(str(error))]
    frames = [(Path(f.filename), f.lineno or 0) for f in traceback.extract_tb(error.__traceback__)]
    for places in (named, frames):
        own = [(file.name, line) for file, line in places if is_students(file, folder)]
        if own:
            return own[-1]
    return "", 0


def is_students(file: Path, folder: Path | None) -> bool:
    """Whether a file of a traceback belongs to the student: it lies in the folder, or is a cell of a notebook."""
    return is_own_file(str(file)) if folder is None else file.resolve().parent == folder


@cache
def solution_of(assignment: Assignment) -> Loaded:
    """The classes of the solution; none if the assignment has only its answers."""
    if assignment.is_sealed:
        return Loaded({})
    loaded = load_classes(assignment.folder / "solution", assignment.files)
    for file, reason in loaded.errors.items():
        raise InputError(f"assignment {assignment.name}: the solution cannot be run: {file}: {reason.message}")
    return loaded


# ── running a part ──


NOT_ASKED = "not asked"  # by the course's own handout: see ``is_asked``
NOT_ASKED_TEXT = "the course's own handout does not ask for it: it is not judged"
OPTIONAL_TEXT = "it is optional, for graduate students, and was not handed in: nothing is lost"


def class_under_test(student: Loaded, part: Part, solution: Loaded) -> type:
    """A class with the method of a part as the student wrote it, and the solution's methods beside it."""
    cls = student.classes[part.replaces]
    if student.is_of_course:  # the other methods are the package's
        return import_quickly("taichi_tracer.course.adapters").alone(cls, part.method)
    others = {
        name: value
        for name, value in vars(solution.classes.get(part.replaces, object)).items()
        if hasattr(unwrap(value), "__code__") and not is_stub(value)
        if name != part.method and not name.startswith("__")
    }
    return type(cls.__name__, (cls,), {**others, "__module__": cls.__module__}) if others else cls


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


def answer(assignment: Assignment, part: Part, student: Loaded, inputs: Arrays) -> PartResult:
    """Run a part on the student's classes.

    A class that is missing because its file failed has the message of that failure.
    """
    solution, files = solution_of(assignment), assignment.classes
    try:
        if part.replaces == "":
            if student.errors:
                return next(iter(student.errors.values()))
            optional = [one.name for one in assignment.parts if one.is_optional]
            methods = [(f"{role}.{k}", v) for role, cls in student.classes.items() for k, v in vars(cls).items()]
            stubs = [name for name, value in methods if is_stub(value) and name not in optional]
            if stubs:
                return PartResult(NOT_WRITTEN, message=f"it needs what is not written yet, such as {stubs[0]}")
            subject: Any = types.SimpleNamespace(**(solution.classes | (student.together or student.classes)))
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
            subject = class_under_test(student, part, solution)
            right = vars(solution.classes.get(part.replaces, object)).get(part.method)
            checks.check_whole(part.name, method, subject, right)
        with substitutes(subject, part, student, solution, files):
            arrays = part.run(subject, inputs)
        return PartResult(OK, arrays={name: np.ascontiguousarray(array) for name, array in arrays.items()})
    except KeyboardInterrupt:
        raise
    except BaseException as error:  # noqa: BLE001 (a student's code may raise anything)
        return crash(error, student.folder)


def substitutes(subject: Any, part: Part, student: Loaded, solution: Loaded, files: Mapping[str, str]) -> ExitStack:
    """What stands in place of other functions and classes while a part runs.

    The same submission has the same random numbers on every run. The package's own method of this name is an error: a
    student's must not call it instead. This is a rule of the course and no wall, as everything that runs in the process
    of the submission. In a notebook, the solution's classes stand in place of those that other cells define, so that a
    wrong sampler does not cost the points of a renderer; in folders, ``load_submission`` sees to this.

    Args:
        files: class → file; a class of the same file as the class under test stays.
    """
    name, stack = f"{part.replaces}.{part.method}", ExitStack()
    stack.enter_context(patch.object(ti, "random", next_number))

    @compile_time
    def refuse(*_arguments, **_named):
        raise InputError(f"{name} calls the package's own {part.method}, which it should replace")

    for cls in subject.__mro__ if part.replaces else ():
        if cls.__module__.startswith("taichi_tracer.") and part.method in vars(cls):
            stack.enter_context(patch.object(cls, part.method, staticmethod(refuse)))
    roles = {role: role for role in files} | {own.__name__: role for role, own in student.classes.items()}
    for word, role in roles.items() if part.replaces and student.folder is None else ():
        if role in solution.classes and files.get(role) != files.get(part.replaces):
            module = sys.modules[student.classes[part.replaces].__module__]
            stack.enter_context(patch.object(module, word, solution.classes[role], create=True))
    return stack


# ── random numbers ──


@compile_time
def next_number(*_type):
    """One number of the sample that the kernel began; used in place of ``ti.random``, which differs from run to run."""
    rng = RandomNumbers.of_this_kernel()
    if rng is None:
        return _ORIGINAL_RANDOM(*_type)
    return rng.next_1d()


_ORIGINAL_RANDOM = ti.random


def expected(assignment: Assignment, part: Part, seed: int) -> Arrays:
    """What the solution answers; an InputError if it does not run, or if its answers are those to another seed."""
    if assignment.is_sealed:
        facts, answers = catalogue.answers_in(assignment.folder)
        if seed != facts["seed"]:
            raise InputError(f"{assignment.folder}: only the answers to the inputs of seed {facts['seed']} are there")
        return answers[f"part {assignment.parts.index(part)}"]
    found = answer(assignment, part, solution_of(assignment), assignment.inputs(part, seed))
    if found.status != OK:
        raise InputError(f"assignment {assignment.name}: the solution of {part.name} fails: {found.message}")
    return found.arrays
