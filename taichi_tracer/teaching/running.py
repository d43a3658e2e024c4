"""Runs a part: loads the classes of a folder, puts together the class under test, and says what happened.

Each part is tested by itself. The class under test has the student's method, and the student's own helpers; the other
methods of the handout come from the solution. So a wrong camera matrix does not cost the points of the ray.
"""

import contextlib
import re
import sys
import time
import traceback
import types
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
import taichi as ti

from taichi_tracer.random_numbers import RandomNumbers
from taichi_tracer.system.errors import InputError, OwnCodeError
from taichi_tracer.system.own_code.bounds import WATCH
from taichi_tracer.system.seams import in_kernels
from taichi_tracer.system.wings import is_there, wing
from taichi_tracer.teaching import sealed
from taichi_tracer.teaching.base import CRASHED, MISSING, NOT_WRITTEN, Arrays, Assignment, Part
from taichi_tracer.teaching.reading import module_of, taken_name
from taichi_tracer.teaching.stubs import is_empty, is_placeholder, is_stub, line_of_mark, plain

OK = "ok"
NOT_ASKED = "not asked"  # by the course's own handout: see ``is_asked``
NOT_ASKED_TEXT = "the course's own handout does not ask for it: it is not judged"
OPTIONAL_TEXT = "it is optional, for graduate students, and was not handed in: nothing is lost"
MOST_NAMES = 3  # methods that are named where a picture needs some that are not written
LONGEST_MESSAGE = 300  # characters of an error, or of what a submission's process says, that a report shows


@dataclass
class Answer:
    """What running a part gave: arrays, or the reason why there are none.

    Attributes:
        status: "ok", "not written", "crashed" or "missing".
        arrays: the answers.
        message: one sentence about a crash. line: where it was, in the student's file; 0 if unknown. file: its name.
        seconds: how long it took, with compilation.
    """

    status: str
    arrays: Arrays = field(default_factory=dict)
    message: str = ""
    line: int = 0
    file: str = ""
    seconds: float = 0.0


@dataclass
class Loaded:
    """The classes of a folder.

    Attributes:
        classes: name → class. together: the same, if they had to be run again for this; see ``load_submission``.
        errors: name of a file that could not be run → why.
        folder: where they come from; None for classes of a notebook.
        is_of_course: whether they were written for the course, whose handouts do not ask for all parts.
        optional: of a solution, the names of the optional parts; see ``base.Part``.
        failed: class that only optional parts need → why its file could not be run.
    """

    classes: dict[str, type]
    errors: dict[str, Answer] = field(default_factory=dict)
    folder: Path | None = None
    together: dict[str, type] = field(default_factory=dict)
    is_of_course: bool = False
    optional: frozenset[str] = frozenset()
    failed: dict[str, Answer] = field(default_factory=dict)

    def namespace(self, reference: "Loaded") -> types.SimpleNamespace:
        """All classes, for a picture; those that are missing come from ``reference``."""
        return types.SimpleNamespace(**{**reference.classes, **(self.together or self.classes)})

    def stubs(self) -> list[str]:
        """The methods that are not written yet, such as "Camera.generate_ray"."""
        of_all = [(name, method, value) for name, cls in self.classes.items() for method, value in vars(cls).items()]
        return [f"{name}.{method}" for name, method, value in of_all if is_stub(value)]


def load_submission(folder: str | Path, assignment: Assignment) -> Loaded:
    """The classes of a student's folder. Each file is run with the solution's version of the other files.

    So a renderer that imports a wrong sampler is tested with the right one. For pictures, ``together`` has the classes
    of files that import each other as they are.
    """
    course = wing("course.files") if is_there("course") else None
    of_course = None if course is None else course.folder_of_course(folder, assignment.files)
    if of_course is not None:
        return load_of_course(of_course, assignment)
    together = load_classes(folder, assignment.files)
    alone = Loaded({}, dict(together.errors), together.folder, together.classes)
    for file in assignment.files:
        if file in together.errors and together.errors[file].status == MISSING:
            continue
        loaded = load_classes(folder, [file], None if assignment.is_sealed else assignment.solution_folder)
        names = [name for name, home in assignment.classes.items() if home == file]
        if not loaded.errors:
            alone.errors.pop(file, None)  # it failed only because of another file
            alone.classes |= {name: loaded.classes[name] for name in names if name in loaded.classes}
        else:  # it imports something from another file that only the student's own version has
            alone.classes |= {name: together.classes[name] for name in names if name in together.classes}
    return alone


def load_of_course(folder: Path, assignment: Assignment) -> Loaded:
    """The classes of files that were written for the course, behind their borders."""
    files, borders = wing("course.files"), wing("course.borders")
    found, asked = files.load(folder), files.ASKED.get(assignment.name, {})
    graduate = files.GRADUATE.get(assignment.name, {})
    folder = found.folder
    loaded = Loaded({}, {}, folder, is_of_course=True)
    for file in dict.fromkeys(asked.values()):
        if file in found.errors:
            loaded.errors[file] = crash(found.errors[file], folder)
        elif not (folder / file).is_file():
            loaded.errors[file] = Answer(MISSING, message=f"the file {file} is missing", file=file)
    classes = borders.borders_of(found.classes)
    loaded.classes = {name: cls for name, cls in classes.items() if name in asked or name in graduate}
    for name, file in graduate.items():
        if file in found.errors and file not in asked.values():
            loaded.failed[name] = crash(found.errors[file], folder)
    return loaded


def load_classes(folder: str | Path, files: Sequence[str], others: Path | None = None) -> Loaded:
    """The classes that some files of a folder define. A file that is missing or fails becomes an entry of ``errors``.

    The files may import each other. Their modules are forgotten afterwards, so that another folder with files of the
    same names can be loaded, too.

    Args:
        others: the folder from which imports of files that are not among ``files`` are taken, if it has them.
    """
    folder = Path(folder).resolve()
    loaded = Loaded({}, {}, folder)
    before = set(sys.modules)
    names = {path.stem for place in (folder, others) if place is not None for path in place.glob("*.py")}
    hidden = {name: sys.modules.pop(name) for name in names if name in sys.modules}
    paths = [str(path) for path in (others, folder) if path is not None]
    sys.path[:0] = paths
    try:
        for file in files:
            if not (folder / file).is_file():
                loaded.errors[file] = Answer(MISSING, message=f"the file {file} is missing", file=file)
                continue
            try:
                module = module_of(folder / file)
            except BaseException as error:  # noqa: BLE001 (a student's file may raise anything, SystemExit too)
                if isinstance(error, KeyboardInterrupt):
                    raise
                loaded.errors[file] = crash(error, folder)
                continue
            loaded.classes |= {
                name: value
                for name, value in vars(module).items()
                if isinstance(value, type) and value.__module__ == module.__name__
            }
    finally:
        for path in paths:
            with contextlib.suppress(ValueError):
                sys.path.remove(path)
        for name in set(sys.modules) - before:
            if name in names:
                del sys.modules[name]
        sys.modules.update(hidden)
    return loaded


def class_under_test(student: type, solution: type | None, method: str) -> type:
    """A class with one method of the student, and the solution's other methods, if there is a solution."""
    if hasattr(student, "alone"):  # of the course: the other methods are the package's
        return student.alone(method)
    if solution is None:
        return student
    others = {name: value for name, value in vars(solution).items() if is_method(name, value) and name != method}
    return type(student.__name__, (student,), {**others, "__module__": student.__module__})


def is_method(name: str, value: object) -> bool:
    """Whether an attribute of a class is a method that the handout names, and not one that Python or Taichi adds."""
    return hasattr(plain(value), "__code__") and not name.startswith("__")


def own_method(cls: type, name: str) -> object | None:
    """A method that the student's class or a base of the student's own defines; None if only the package has it."""
    for base in cls.__mro__:
        if base.__module__.split(".")[0] == "taichi_tracer" and "teaching" not in base.__module__:
            return None
        if name in vars(base):
            return vars(base)[name]
    return None


def is_asked(part: Part, student: Loaded, assignment: Assignment) -> bool:
    """Whether a part is judged: the handouts of the course do not ask for all of them, and some are optional."""
    if student.is_of_course and not wing("course.files").asks_for(assignment.name, part.name):
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
) -> Answer:
    """Run a part on the student's classes.

    Args:
        files: class → file, see ``Assignment.classes``; then a class that is missing because its file failed is told as
            that failure.
    """
    start = time.perf_counter()
    found = _answer(part, student, solution, inputs, files or {})
    found.seconds = time.perf_counter() - start
    return found


def _answer(part: Part, student: Loaded, solution: Loaded, inputs: Arrays, files: dict[str, str]) -> Answer:
    try:
        if part.replaces == "":
            if student.errors:
                return next(iter(student.errors.values()))
            stubs = [name for name in student.stubs() if name not in solution.optional]
            if stubs:
                names = ", ".join(stubs) if len(stubs) <= MOST_NAMES else f"{len(stubs)} of the methods above"
                return Answer(NOT_WRITTEN, message=f"it needs what is not written yet: {names}")
            subject: Any = student.namespace(solution)
        else:
            cls = student.classes.get(part.replaces)
            if cls is None:
                reason = student.failed.get(part.replaces) or student.errors.get(files.get(part.replaces, ""))
                return reason or Answer(MISSING, message=f"there is no class {part.replaces}")
            method = own_method(cls, part.method)
            if method is None:
                return Answer(MISSING, message=f"{part.replaces} has no method {part.method}")
            if is_stub(method):
                return Answer(NOT_WRITTEN, message="it is not written yet", line=line_of_mark(method))
            if is_empty(method):
                return Answer(NOT_WRITTEN, message="it does nothing, and returns nothing")
            own = {name for name, value in vars(cls).items() if is_method(name, value)}
            if taken := taken_name(cls, own):
                name, base = taken
                told = f"the package's {base.__name__} has a value of the name {name}: give your method another one"
                return Answer(CRASHED, message=told)
            subject = class_under_test(cls, solution.classes.get(part.replaces), part.method)
        with (
            reproducible_random(),
            without_the_packages(subject, part),
            beside_the_solution(part, student, solution, files),
        ):
            WATCH.is_wanted = True
            arrays = part.run(subject, inputs)
        return Answer(OK, {name: np.ascontiguousarray(array) for name, array in arrays.items()})
    except KeyboardInterrupt:
        raise
    except BaseException as error:  # noqa: BLE001 (a student's code may raise anything)
        return crash(error, student.folder)


def crash(error: BaseException, folder: Path | None) -> Answer:
    """What is known about an exception of the student's code."""
    if isinstance(error, OwnCodeError):
        file, line, told = Path(error.file).name, error.line, error.text
    else:
        file, line = place_of(error, folder)
        told = f"{type(error).__name__}: {one_line(error)}"
    where = f"line {line} of {file}: " if line else ""
    return Answer(CRASHED, message=f"{where}{told}"[:LONGEST_MESSAGE], line=line, file=file)


def one_line(error: BaseException) -> str:
    """The last line of a message: Taichi puts what is wrong there, after the lines of the source."""
    if isinstance(error, SyntaxError) and "\n" not in error.msg:
        return error.msg
    lines = [line.strip() for line in str(error).splitlines() if line.strip(" ^~")]
    last = lines[-1] if lines else ""
    return last.removeprefix("[").strip() if last.count("[") > last.count("]") else last


def place_of(error: BaseException, folder: Path | None) -> tuple[str, int]:
    """(name of the file, line) of the innermost line of the student's code; ("", 0) if the error is elsewhere."""
    if isinstance(error, SyntaxError) and error.filename:
        return Path(error.filename).name, error.lineno or 0
    pattern = re.compile(r'File "([^"]+)", line (\d+)')
    told = [(Path(file), int(line)) for file, line in pattern.findall(str(error))]
    frames = [(Path(f.filename), f.lineno or 0) for f in traceback.extract_tb(error.__traceback__)]
    for places in (told, frames):
        own = [(file.name, line) for file, line in places if is_students(file, folder)]
        if own:
            return own[-1]
    return "", 0


def is_students(file: Path, folder: Path | None) -> bool:
    """Whether a file of a traceback belongs to the student: it lies in the folder, or is a cell of a notebook."""
    if folder is not None:
        return file.resolve().parent == folder
    package = Path(__file__).parents[1]
    return "ipykernel" in str(file) or (package not in file.parents and "site-packages" not in str(file))


@contextlib.contextmanager
def without_the_packages(subject: Any, part: Part) -> Iterator[None]:
    """While a part runs, the package's own method of this name is an error: a student's must not call it instead.

    This is a rule of the course and no wall, as everything that runs in the process of the submission.
    """
    name = f"{part.replaces}.{part.method}"

    @in_kernels
    def refuse(*_arguments, **_named):
        raise InputError(f"{name} calls the package's own {part.method}, which it should replace")

    bases = subject.__mro__ if part.replaces else ()
    homes = [cls for cls in bases if cls.__module__.startswith("taichi_tracer.") and part.method in vars(cls)]
    former = [vars(cls)[part.method] for cls in homes]
    try:
        for cls in homes:
            setattr(cls, part.method, staticmethod(refuse))
        yield
    finally:
        for cls, method in zip(homes, former, strict=True):
            setattr(cls, part.method, method)


@contextlib.contextmanager
def beside_the_solution(part: Part, student: Loaded, solution: Loaded, files: dict[str, str]) -> Iterator[None]:
    """While a part runs, the solution's classes stand in a notebook in place of those that other cells define.

    So a wrong sampler does not cost the points of a renderer. In folders, ``load_submission`` sees to this.

    Args:
        files: class → file; a class of the same file as the class under test stays.
    """
    cls = student.classes.get(part.replaces)
    if cls is None or student.folder is not None:
        yield
        return
    cells = vars(sys.modules[cls.__module__])
    roles = {role: role for role in files} | {own.__name__: role for role, own in student.classes.items()}
    others = {name: role for name, role in roles.items() if files.get(role) != files.get(part.replaces)}
    replaced = {name: solution.classes[role] for name, role in others.items() if role in solution.classes}
    former = {name: cells[name] for name in replaced if name in cells}
    cells.update(replaced)
    try:
        yield
    finally:
        for name in replaced:
            del cells[name]
        cells.update(former)


# ── random numbers ──


@in_kernels
def next_number(*_type):
    """One number of the sample that the kernel began; used in place of ``ti.random``, which differs from run to run."""
    rng = RandomNumbers.of_this_kernel()
    if rng is None:
        return _ORIGINAL_RANDOM(*_type)
    return rng.next_1d()


_ORIGINAL_RANDOM = ti.random


@contextlib.contextmanager
def reproducible_random() -> Iterator[None]:
    """Let ``ti.random`` give hashed numbers, so that the same submission has the same numbers on every run."""
    ti.random = next_number
    try:
        yield
    finally:
        ti.random = _ORIGINAL_RANDOM


# ── the solution ──


_SOLUTIONS: dict[Path, Loaded] = {}


def solution_of(assignment: Assignment) -> Loaded:
    """The classes of the solution; none if the assignment has only its answers."""
    if assignment.is_sealed:
        return Loaded({}, optional=assignment.optional)
    folder = assignment.solution_folder
    if folder not in _SOLUTIONS:
        loaded = load_classes(folder, assignment.files)
        loaded.optional = assignment.optional
        if loaded.errors:
            file, reason = next(iter(loaded.errors.items()))
            raise InputError(f"assignment {assignment.name}: the solution cannot be run: {file}: {reason.message}")
        _SOLUTIONS[folder] = loaded
    return _SOLUTIONS[folder]


def expected(assignment: Assignment, part: Part, inputs: Arrays) -> Arrays:
    """What the solution answers; an InputError if it does not run."""
    if assignment.is_sealed:
        return sealed.answers_to_part(assignment, part, inputs)
    solution = solution_of(assignment)
    found = answer(part, solution, solution, inputs, dict(assignment.classes))
    if found.status != OK:
        raise InputError(f"assignment {assignment.name}: the solution of {part.name} fails: {found.message}")
    return found.arrays
