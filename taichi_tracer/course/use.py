"""``tt.course(folder)`` and ``--course``: a student's files of the course run in all pictures of this process.

Their methods are assigned to the package's classes, as by any student of this package, and receipts name what is
replaced.
"""

import contextlib
from collections.abc import Iterator
from contextlib import AbstractContextManager
from pathlib import Path
from typing import Any
from unittest.mock import patch

import taichi_tracer as tt
from taichi_tracer.course import adapters, files
from taichi_tracer.progressive import ProgressiveRenderer
from taichi_tracer.system import runtime
from taichi_tracer.system.errors import InputError
from taichi_tracer.system.parts import unfinished, where_in

KIT_RECORD = "assignment.json"  # of a folder that ``assignment new`` has written: its ids count from 0
# What an adapter has of Python and of Taichi: it is not assigned to the package's class.
LEFT = {
    *("__module__", "__doc__", "__dict__", "__weakref__", "__abstractmethods__", "_abc_impl"),
    *("_data_oriented", "__getattribute__", "name"),
}


class Course:
    """The files of a student, in use until ``undo``; scenes and renderers that exist already stay as they are.

    Attributes:
        folder: where the files are. files: those that are in use, such as "camera.py".
        errors: name of a file that cannot be used → why, with the line.
        uses: lines such as "camera.py: Camera.generate_ray, Camera.compute_matrix".
        unfinished: the handout's methods that are not written yet, or that cannot run: name → why. Only a picture that
            uses one of them ends with this error.
        other_arguments: those that cannot be called as the handout calls them: name → why. The package's run in their
            place; the student's own code may call the student's.
    """

    def __init__(self, folder: str | Path) -> None:
        runtime.ensure()
        if (files.find_folder(folder) / KIT_RECORD).is_file():
            text = "its files are not those of the course: run its own program, or taichi-tracer check"
            raise InputError(f"{folder}: this is a folder of assignment new, and {text}")
        found = files.load(folder)
        self.folder = found.folder
        self.errors = {name: text_of_error(error, found.folder / name) for name, error in found.errors.items()}
        made = adapters.adapters_of(found.classes)
        self._members = {name: {k: v for k, v in vars(cls).items() if k not in LEFT} for name, cls in made.items()}
        self.other_arguments = {
            f"{name}.{k}": why for name, cls in made.items() for k, why in cls.other_arguments.items()
        }
        self._assigned = contextlib.ExitStack()
        self._home = {name: f"{found.classes[name].__module__.rpartition('.')[2]}.py" for name in made}
        self.files = list(dict.fromkeys(self._home.values()))
        if not made:
            reasons = "; ".join(self.errors.values()) or f"it has none of {', '.join(adapters.CLASSES)}"
            raise InputError(f"{folder}: nothing there can be used: {reasons}")
        self.apply()
        self.unfinished = {
            f"{name}.{method}": why for name in made for method, why in unfinished(adapters.CLASSES[name]).items()
        }
        self.uses = []
        for name, members in self._members.items():
            written = [f"{name}.{member}" for member in members if member in adapters.WRITTEN]
            if methods := [method for method in written if method not in self.unfinished]:
                self.uses.append(f"{self._home[name]}: {', '.join(methods)}")

    def notes(self) -> list[str]:
        """What the user should know: which methods run, which are unfinished, and which have other arguments."""
        lines = list(self.uses)
        if self.unfinished:
            lines.append(f"unfinished, and an error only in pictures that use them: {', '.join(self.unfinished)}")
        if self.other_arguments:
            names = ", ".join(self.other_arguments)
            lines.append(f"the package's run, because these cannot be called as the handout calls them: {names}")
        return [*lines, *(f"not used: {text}" for text in self.errors.values())]

    def apply(self, file: str | None = None) -> None:
        """Use the files, or only one of them."""
        for name, members in self._members.items():
            for member, value in members.items() if file in (None, self._home[name]) else ():
                self._assigned.enter_context(patch.object(adapters.CLASSES[name], member, value, create=True))
        if "A3Renderer" not in self._members:  # it derives from A2Renderer, and its modes have other numbers
            packages = vars(ProgressiveRenderer)["shade_ray"]
            self._assigned.enter_context(patch.object(tt.A3Renderer, "shade_ray", packages, create=True))

    def undo(self) -> None:
        """Use the package's own methods again, for scenes and renderers that are made from now on."""
        self._assigned.close()

    def reference(self) -> AbstractContextManager[None]:
        """The package's own methods within a ``with``, for a comparison."""
        return self.only("")

    @contextlib.contextmanager
    def only(self, file: str) -> Iterator[None]:
        """Only this one of the files within a ``with``, to see what it changes; "" is none of them."""
        self.undo()
        try:
            self.apply(file)
            yield
        finally:
            self.undo()
            self.apply()

    def __enter__(self) -> "Course":
        return self

    def __exit__(self, *_error: Any) -> None:
        self.undo()

    def __repr__(self) -> str:
        return "\n".join([f"files of the course in {self.folder}", *self.notes()])


def text_of_error(error: BaseException, file: Path) -> str:
    """What is wrong with a file, in one line that begins with the file and the line."""
    return f"{where_in(error, file, file.name)}: {type(error).__name__}: {str(error).partition(chr(10))[0]}"


_IN_USE: list[Course] = []


def use(folder: str | Path) -> Course:
    """Use a student's files in this process; those of an earlier call are no longer used."""
    while _IN_USE:
        _IN_USE.pop().undo()
    _IN_USE.append(Course(folder))
    return _IN_USE[-1]


def in_use() -> Course | None:
    """The files that are in use."""
    return _IN_USE[-1] if _IN_USE else None
