"""The process that runs a submission: it computes numbers, which the grader judges in another process.

The grader starts this file's ``main`` (``sandbox.Child``), sends requests as frames, and reads frames with the answers:

    {"do": "load", "assignment", "folder", "seed"}      → {"loaded": {class: "ok" | "missing" | what went wrong}}
    {"do": "run", "part": name} and arrays of inputs    → {"status": "ok"} and arrays, or
                                                          {"status": "missing" | "not written" | "crashed", "message", "line"}

The same computation is the plain function ``answer``, which ``check`` calls in the process of a notebook. Each part runs
with one method of the student; the other methods that the handout asks for are those of the solution. So a wrong camera
does not cost the marks of the intersector.
"""

import ast
import importlib
import importlib.util
import inspect
import itertools
import linecache
import os
import re
import sys
import textwrap
import traceback
import types
from collections.abc import Iterable
from dataclasses import dataclass, field
from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    import numpy as np

    from taichi_tracer.teaching.base import Assignment, Part

LONGEST_MESSAGE = 300  # characters
_numbers = itertools.count()


@dataclass
class Loaded:
    """The classes of a folder of files.

    Attributes:
        folder: where the files are.
        classes: name → class.
        problems: name of a file → (what went wrong in one line, line number or None).
    """

    folder: Path
    classes: dict[str, type] = field(default_factory=dict)
    problems: dict[str, tuple[str, int | None]] = field(default_factory=dict)


# ── the answer of one part ──


def answer(
    assignment: "Assignment", source: "Path | Loaded", part: "Part | str", inputs: "dict[str, np.ndarray]"
) -> "tuple[dict, dict[str, np.ndarray]]":
    """What a student's code gives for one part, beside the solution's other methods.

    Args:
        assignment: the assignment. source: the student's folder, or what ``load`` or ``loaded_class`` made of it.
        part: the part or its name. inputs: what its ``inputs`` gave.

    Returns:
        ({"status": "ok"}, arrays), or ({"status": "missing" | "not written" | "crashed", "message", "line"}, {}).
    """
    loaded = source if isinstance(source, Loaded) else load(assignment, Path(source))
    if isinstance(part, str):
        part = next(p for p in assignment.parts if p.name == part)
    try:
        cls = class_under_test(assignment, loaded, part)
        if isinstance(cls, dict):
            return cls, {}
        found = part.run(cls, inputs)
        return {"status": "ok"}, {str(name): as_array(values) for name, values in found.items()}
    except NotImplementedError as error:
        message = first_line(error) or "this function raises NotImplementedError"
        return {"status": "not written", "message": message, "line": line_of(error, loaded.folder)}, {}
    except KeyboardInterrupt:
        raise
    except BaseException as error:  # SystemExit, too: a submission must not end this process
        return {"status": "crashed", "message": told(error), "line": line_of(error, loaded.folder)}, {}


def class_under_test(assignment: "Assignment", loaded: Loaded, part: "Part") -> "type | dict":
    """The student's class, in which the methods that other parts test are those of the solution.

    A part whose name has a point, as "Camera.generate_ray", tests one method. Another part, as "picture: normal", tests
    the class as a whole. If there is nothing to test, the result is the message for the grader.
    """
    cls = loaded.classes.get(part.replaces)
    if cls is None:
        for file, (problem, line) in loaded.problems.items():
            return {"status": "crashed", "message": f"{file} cannot be loaded: {problem}", "line": line}
        return {"status": "missing", "message": f"no file has a class {part.replaces}", "line": None}
    _, _, method = part.name.partition(".")
    if ":" in part.name or not method:
        return cls
    written = next((vars(c)[method] for c in cls.__mro__ if is_students(c, loaded) and method in vars(c)), None)
    if written is None:
        return {"status": "missing", "message": f"the class {part.replaces} has no method {method}", "line": None}
    solution = load(assignment, Path(assignment.solution_folder)).classes[part.replaces]
    if is_same_text(written, stub_of(assignment, part.replaces, method)):
        return {"status": "not written", "message": f"{part.name} is as it was handed out", "line": None}
    asked = {name for p in assignment.parts if p.replaces == part.replaces for name in (p.name.partition(".")[2],)}
    others = {name: vars(solution)[name] for name in asked - {method} if name in vars(solution)}
    return type(cls.__name__, (cls,), {**others, "__module__": cls.__module__})


def is_students(cls: type, loaded: Loaded) -> bool:
    """Whether a class is the student's own, and not one of a library that it derives from."""
    return cls in loaded.classes.values() or cls.__module__.startswith("submission")


def stub_of(assignment: "Assignment", cls: str, method: str) -> str | None:
    """The text of a method as it was handed out; None if that is unknown."""
    stub = getattr(assignment, "stub_of", None)
    return None if stub is None else stub(cls, method)


def is_same_text(function: object, text: str | None) -> bool:
    """Whether a function has the same syntax tree as a text; comments and blank lines do not count."""
    if text is None:
        return False
    try:
        mine = textwrap.dedent(inspect.getsource(inspect.unwrap(getattr(function, "__func__", function))))
        return ast.dump(ast.parse(mine)) == ast.dump(ast.parse(textwrap.dedent(text)))
    except (OSError, TypeError, SyntaxError):
        return False


def as_array(values: object) -> "np.ndarray":
    """Numbers as an array that can be sent."""
    import numpy as np

    return np.ascontiguousarray(values)


# ── the files of a folder ──


@cache
def _cached_solution(files: tuple[str, ...], folder: Path) -> Loaded:
    return read_files(files, folder)


def load(assignment: "Assignment", folder: Path) -> Loaded:
    """Import the assignment's files of a folder. What goes wrong is kept, not raised."""
    if Path(folder) == Path(assignment.solution_folder):
        return _cached_solution(tuple(assignment.files), Path(folder))
    return read_files(assignment.files, folder)


def loaded_class(cls: type) -> Loaded:
    """A class that exists already, as in a notebook, under the names of its own and of its bases."""
    try:
        folder = Path(inspect.getfile(cls)).parent
    except (OSError, TypeError):
        folder = Path()
    return Loaded(folder, {base.__name__: cls for base in reversed(cls.__mro__)} | {cls.__name__: cls})


def read_files(files: Iterable[str], folder: Path) -> Loaded:
    """Import files as modules of a package of their own.

    ``from camera import Camera`` and ``from .camera import Camera`` find the folder's files. A file that is missing is
    found in ``taichi_tracer``, as a handout expects that has its files in that package.
    """
    folder = Path(folder).resolve()
    loaded = Loaded(folder)
    package = types.ModuleType(f"submission{next(_numbers)}")
    package.__path__ = [str(folder)]
    sys.modules[package.__name__] = package
    siblings = {Path(file).stem for file in files}
    finder = Siblings(package.__name__, folder, siblings)
    sys.meta_path.append(finder)
    linecache.checkcache()
    importlib.invalidate_caches()
    for name in siblings:  # modules of another folder
        if getattr(sys.modules.get(name), "__name__", "").startswith("submission"):
            del sys.modules[name]
    try:
        for file in files:
            read_file(loaded, package.__name__, folder / file)
    finally:
        sys.meta_path.remove(finder)
    return loaded


def read_file(loaded: Loaded, package: str, path: Path) -> None:
    """Import one file; its classes, or what went wrong, are added."""
    if not path.is_file():
        return
    name = f"{package}.{path.stem}"
    try:
        module = importlib.import_module(name)
    except KeyboardInterrupt:
        raise
    except BaseException as error:
        loaded.problems[path.name] = (told(error), line_of(error, loaded.folder))
        return
    own = {key: value for key, value in vars(module).items() if isinstance(value, type) and value.__module__ == name}
    loaded.classes.update(own)


class Siblings:
    """Finds the files of a folder for ``import camera``, and those of ``taichi_tracer`` for ``from .ray import Ray``."""

    def __init__(self, package: str, folder: Path, names: set[str]) -> None:
        self.package, self.folder, self.names = package, folder, names

    def find_spec(self, name: str, _path=None, _target=None):
        """How to load a module; None if it is not one of these."""
        package, _, stem = name.rpartition(".")
        has_file = (self.folder / f"{stem}.py").is_file()
        if package == "" and stem in self.names and has_file:
            return importlib.util.spec_from_loader(name, Alias(f"{self.package}.{stem}"))
        if package == self.package and not has_file:
            home = f"taichi_tracer.{stem}"
            return importlib.util.spec_from_loader(name, Alias(home)) if importlib.util.find_spec(home) else None
        return None


class Alias:
    """A loader for which two names are one module."""

    def __init__(self, home: str) -> None:
        self.home = home

    def create_module(self, _spec) -> types.ModuleType:
        """The module of the other name."""
        module = importlib.import_module(self.home)
        self.spec = module.__spec__
        return module

    def exec_module(self, module) -> None:
        """The module is complete already; it keeps its own name."""
        module.__spec__ = self.spec


# ── what went wrong ──


def first_line(error: BaseException) -> str:
    """The first line of an error's text that is not empty, cut."""
    lines = [line.strip() for line in str(error).splitlines() if line.strip()]
    return lines[0][:LONGEST_MESSAGE] if lines else ""


def told(error: BaseException) -> str:
    """An error in one line: its kind, and what it says."""
    if isinstance(error, SystemExit):
        return "the program ended itself with sys.exit"
    lines = [line.strip() for line in str(error).splitlines() if line.strip()]
    # Taichi quotes the student's line and its own files first; the reason stands last.
    text = lines[-1] if type(error).__module__.startswith("taichi") and lines else " ".join(lines[:1])
    return f"{type(error).__name__}: {text}"[:LONGEST_MESSAGE].removesuffix(": ")


def line_of(error: BaseException, folder: Path) -> int | None:
    """The last line of a folder's files on the way to an error; None if there is none."""
    if isinstance(error, SyntaxError) and error.lineno is not None:
        return error.lineno
    found = re.findall(rf'File "{re.escape(str(folder))}[^"]*", line (\d+)', str(error))
    if found:
        return int(found[-1])
    lines = [f.lineno for f in traceback.extract_tb(error.__traceback__) if f.filename.startswith(f"{folder}{os.sep}")]
    return lines[-1] if lines else None


# ── the loop of the process ──


def serve(requests: int, answers: int, seconds_of_cpu: float | None) -> None:
    """Answer requests until the grader closes the pipe.

    Args:
        requests, answers: descriptors of the pipes.
        seconds_of_cpu: what one request may cost before the process gets a SIGXCPU; None is no limit.
    """
    from taichi_tracer.teaching import frames, walls

    state: dict = {}
    while (request := frames.read(requests)) is not None:
        message, arrays = request
        if seconds_of_cpu is not None:
            walls.allow_cpu(seconds_of_cpu)
        reply, found = answered(state, message, arrays)
        try:
            data = frames.encode(reply | {"ticket": message.get("ticket")}, found)
        except ValueError as error:
            reply = {"status": "crashed", "message": first_line(error), "line": None, "ticket": message.get("ticket")}
            data = frames.encode(reply)
        frames.write_bytes(answers, data)


def answered(state: dict, message: dict, arrays: "dict[str, np.ndarray]") -> "tuple[dict, dict[str, np.ndarray]]":
    """The reply to one request; ``state`` keeps what was loaded."""
    if message["do"] == "hello":
        start_taichi(message.get("threads"), 0)
        return {"status": "ok"}, {}
    if message["do"] == "load":
        from taichi_tracer.teaching.base import Assignment

        start_taichi(message.get("threads"), message.get("seed", 0))
        state["assignment"] = Assignment.load(message["assignment"])
        load(state["assignment"], Path(state["assignment"].solution_folder))
        folder = message.get("folder") or state["assignment"].solution_folder
        state["loaded"] = load(state["assignment"], Path(folder))
        return {"loaded": summary(state["assignment"], state["loaded"])}, {}
    return answer(state["assignment"], state["loaded"], message["part"], arrays)


def start_taichi(threads: int | None, seed: int) -> None:
    """Start Taichi on the CPU, if it does not run, and seed the generators that a submission may use."""
    import random

    import numpy as np

    from taichi_tracer.system import runtime

    if runtime.current() is None:
        runtime.init(arch="cpu", threads=threads)
    random.seed(seed)
    np.random.seed(seed % 2**32)


def summary(assignment: "Assignment", loaded: Loaded) -> dict[str, str]:
    """Class → "ok", "missing", or what went wrong."""
    problems = "; ".join(f"{file}: {text}" for file, (text, _) in loaded.problems.items())
    names = dict.fromkeys(part.replaces for part in assignment.parts)
    return {name: "ok" if name in loaded.classes else problems or "missing" for name in names}
