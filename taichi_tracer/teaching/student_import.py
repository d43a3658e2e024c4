"""Loads the classes of a folder: a student's, beside the solution's versions of the other files, or a solution's."""

import re
import traceback
import types
from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from taichi_tracer.course import files
from taichi_tracer.system.errors import InputError, OwnCodeError
from taichi_tracer.system.importing import import_quickly
from taichi_tracer.system.own_code.source import unwrap
from taichi_tracer.teaching.base import CRASHED, MISSING, Assignment, Part, PartResult
from taichi_tracer.teaching.handout.stubs import is_stub

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
        optional: of a solution, the names of the optional parts; see ``base.Part``.
        failed: class that only optional parts need → why its file could not be run.
        package: the name of the package whose modules the files are.
        reported: messages of parts that gave no answer, which a check has shown.
    """

    classes: dict[str, type]
    errors: dict[str, PartResult] = field(default_factory=dict)
    folder: Path | None = None
    together: dict[str, type] = field(default_factory=dict)
    is_of_course: bool = False
    optional: frozenset[str] = frozenset()
    failed: dict[str, PartResult] = field(default_factory=dict)
    package: str = ""
    reported: set[str] = field(default_factory=set)

    def namespace(self, reference: "Loaded") -> types.SimpleNamespace:
        """All classes, for a picture; those that are missing come from ``reference``."""
        return types.SimpleNamespace(**{**reference.classes, **(self.together or self.classes)})

    def stubs(self) -> list[str]:
        """The methods that are not written yet, such as "Camera.generate_ray"."""
        of_all = [(name, method, value) for name, cls in self.classes.items() for method, value in vars(cls).items()]
        return [f"{name}.{method}" for name, method, value in of_all if is_stub(value)]

    def beside(self, part: Part) -> dict[str, object]:
        """The methods of a solution that stand beside that of a part."""
        of_class = vars(self.classes.get(part.replaces, object)).items()
        written = {name: value for name, value in of_class if is_method(name, value) and not is_stub(value)}
        return {name: value for name, value in written.items() if name != part.method}


def load_submission(folder: str | Path, assignment: Assignment) -> Loaded:
    """The classes of a student's folder. Each file is run with the solution's version of the other files.

    So a renderer that imports a wrong sampler is tested with the right one. For pictures, ``together`` has the classes
    of files that import each other as they are.
    """
    of_course = files.folder_of_course(folder, assignment.files)
    if of_course is not None:
        return load_of_course(of_course, assignment)
    solution = solution_of(assignment)
    together = load_classes(folder, assignment.files)
    alone = Loaded({}, dict(together.errors), together.folder, together.classes)
    for file in assignment.files:
        if file in together.errors and together.errors[file].status == MISSING:
            continue
        loaded = load_classes(folder, [file], solution)
        names = [name for name, home in assignment.classes.items() if home == file]
        if not loaded.errors:
            alone.errors.pop(file, None)  # it failed only because of another file
            alone.classes |= {name: loaded.classes[name] for name in names if name in loaded.classes}
        else:  # it imports something from another file that only the student's own version has
            alone.classes |= {name: together.classes[name] for name in names if name in together.classes}
    return alone


def load_of_course(folder: Path, assignment: Assignment) -> Loaded:
    """The classes of files that were written for the course, behind their adapters."""
    adapters = import_quickly("taichi_tracer.course.adapters")
    found, asked = files.load(folder), files.ASKED.get(assignment.name, {})
    graduate = files.GRADUATE.get(assignment.name, {})
    folder = found.folder
    loaded = Loaded({}, {}, folder, is_of_course=True)
    for file in dict.fromkeys(asked.values()):
        if file in found.errors:
            loaded.errors[file] = crash(found.errors[file], folder)
        elif not (folder / file).is_file():
            loaded.errors[file] = missing_file(file)
    classes = adapters.adapters_of(found.classes)
    loaded.classes = {name: cls for name, cls in classes.items() if name in asked or name in graduate}
    for name, file in graduate.items():
        if file in found.errors and file not in asked.values():
            loaded.failed[name] = crash(found.errors[file], folder)
    return loaded


def load_classes(folder: str | Path, names: Sequence[str], others: Loaded | None = None) -> Loaded:
    """The classes that some files of a folder define. A file that is missing or fails becomes an entry of ``errors``.

    Args:
        others: the classes of a folder in which imports of files that are not among ``names`` are found first.
    """
    folder = Path(folder).resolve()

    def module_of(own: Any, name: str, level: int) -> str:
        """The module of a file that another file imports."""
        if level == 0 and f"{name}.py" not in names and others and others.folder:
            if (others.folder / f"{name}.py").is_file():
                return f"{others.package}.{name}"
        is_own = level > 0 or (own.folder / f"{name}.py").is_file()
        return f"{own.package}.{name}" if is_own else name

    missing = [name for name in names if not (folder / name).is_file()]
    own = files.StudentFiles(folder, module_of)
    found = files.run_files(own, [name for name in names if name not in missing])
    errors = {name: crash(error, folder) for name, error in found.errors.items()}
    errors |= {name: missing_file(name) for name in missing}
    return Loaded(found.classes, errors, folder, package=found.package)


def missing_file(name: str) -> PartResult:
    """What is known about the parts of a file that was not handed in."""
    return PartResult(MISSING, message=f"the file {name} is missing", file=name)


def is_method(name: str, value: object) -> bool:
    """Whether an attribute of a class is a method that the handout names, and not one that Python or Taichi adds."""
    return hasattr(unwrap(value), "__code__") and not name.startswith("__")


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
    if folder is not None:
        return file.resolve().parent == folder
    package = Path(__file__).parents[1]
    return "ipykernel" in str(file) or (package not in file.parents and "site-packages" not in str(file))


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
