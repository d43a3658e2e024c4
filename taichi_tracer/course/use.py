"""``tt.course(folder)`` and ``--course``: a student's files of the course run in all pictures of this process.

Their methods are assigned to the package's classes, as by any student of this package, and receipts name what is
replaced.
"""

import contextlib
from collections.abc import Iterator
from contextlib import AbstractContextManager
from pathlib import Path
from typing import Any

import taichi_tracer as tt
from taichi_tracer.course import adapters, files
from taichi_tracer.progressive import ProgressiveRenderer
from taichi_tracer.system import runtime
from taichi_tracer.system.errors import InputError
from taichi_tracer.system.parts import unfinished, where_in

ABSENT = object()
# The class of this package whose methods an adapter of the same name has.
CLASSES: dict[str, Any] = {
    "Camera": tt.Camera,
    "Environment": tt.Environment,
    "UniformSampler": tt.UniformSampler,
    "BRDF": tt.BRDF,
    "MicrofacetBRDF": tt.MicrofacetBRDF,
    "RayIntersector": tt.RayIntersector,
    "MeshLightSampler": tt.MeshLightSampler,
    "A2Renderer": tt.A2Renderer,
    "A3Renderer": tt.A3Renderer,
    "A4Renderer": tt.A4Renderer,
}
# What an adapter has of Python, of Taichi and for grading: it is not assigned to the package's class.
LEFT = ("__module__", "__doc__", "__dict__", "__weakref__", "__abstractmethods__", "_abc_impl", "_data_oriented")
LEFT += ("__getattribute__", "alone", "without", "name")


class Course:
    """The files of a student, in use until ``undo``; scenes and renderers that exist already stay as they are.

    Attributes:
        folder: where the files are. errors: name of a file that cannot be used → why, with the line.
        uses: lines such as "camera.py: Camera.generate_ray, Camera.compute_matrix".
        unfinished: the handout's methods that are not written yet, or that cannot run: name → why. Only a picture that
            uses one of them ends with this error.
        other_arguments: those that cannot be called as the handout calls them: name → why. The package's run in their
            place; the student's own code may call the student's.
    """

    def __init__(self, folder: str | Path) -> None:
        runtime.ensure()
        found = files.load(folder)
        self.folder = found.folder
        self.errors = {name: text_of_error(error, found.folder / name) for name, error in found.errors.items()}
        made = adapters.adapters_of(found.classes)
        self._members = {name: members_of(cls) for name, cls in made.items()}
        others = {f"{name}.{method}": why for name, cls in made.items() for method, why in cls.other_arguments.items()}
        self.other_arguments = others
        self._former: list[tuple[Any, str, Any]] = []
        files_of = {name: f"{cls.__module__.rpartition('.')[2]}.py" for name, cls in found.classes.items()}
        self._home = {name: files_of.get(name, "ray_intersector.py") for name in self._members}
        if not self._members:
            reasons = "; ".join(self.errors.values()) or f"it has none of {', '.join(CLASSES)}"
            raise InputError(f"{folder}: nothing there can be used: {reasons}")
        self.apply()
        not_done = [(name, unfinished(CLASSES[name])) for name in self._members]
        self.unfinished = {f"{name}.{method}": why for name, found in not_done for method, why in found.items()}
        self.uses = []
        for name, members in self._members.items():
            methods = [f"{name}.{member}" for member in members if member in adapters.WRITTEN]
            methods = [method for method in methods if method not in self.unfinished]
            if methods:
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
                self._assign(CLASSES[name], member, value)
        if "A3Renderer" not in self._members:  # it derives from A2Renderer, and its modes have other numbers
            self._assign(tt.A3Renderer, "shade_ray", vars(ProgressiveRenderer)["shade_ray"])

    def _assign(self, cls: Any, member: str, value: Any) -> None:
        self._former.append((cls, member, vars(cls).get(member, ABSENT)))
        setattr(cls, member, value)

    def undo(self) -> None:
        """Use the package's own methods again, for scenes and renderers that are made from now on."""
        for cls, member, value in reversed(self._former):
            if value is ABSENT:
                delattr(cls, member)
            else:
                setattr(cls, member, value)
        self._former.clear()

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

    @property
    def files(self) -> list[str]:
        """The files that are in use, such as "camera.py"."""
        return list(dict.fromkeys(self._home.values()))

    def __enter__(self) -> "Course":
        return self

    def __exit__(self, *_error: Any) -> None:
        self.undo()

    def __repr__(self) -> str:
        return "\n".join([f"files of the course in {self.folder}", *self.notes()])


def members_of(adapter: type) -> dict[str, Any]:
    """What an adapter defines."""
    return {name: value for name, value in vars(adapter).items() if name not in LEFT}


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
