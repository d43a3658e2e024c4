"""One registry for everything that can be chosen by name, such as cameras, samplers, BRDFs, integrators, tone curves.

A part is registered in the file that defines it. After that, the command line, the window, the studies and the contract
tests know the part:

    @tt.register
    class Fisheye(tt.Camera):
        name = "fisheye"
        ...

Each kind of part has a home: the modules that define the parts of this kind in the package. They are imported when a
part of the kind is looked up for the first time.
"""

import os
import pkgutil
import runpy
import sys
import traceback
import warnings
from pathlib import Path
from typing import TypeVar

from taichi_tracer.system.errors import InputError, OwnCodeError, one_of
from taichi_tracer.system.importing import import_quickly
from taichi_tracer.system.parts.overrides import assigned, check_part, replaced, unfinished
from taichi_tracer.system.threads import one_at_a_time

# Kind → (the modules or packages that define its parts, whether the registry holds objects instead of classes).
HOMES: dict[str, tuple[tuple[str, ...], bool]] = {
    "camera": (("camera", "cameras"), False),
    "triangle test": (("formulas.triangles",), True),
    "intersector": (("intersectors", "ray_intersector"), False),
    "sampler": (("samplers",), True),
    "BRDF": (("brdfs",), True),
    "light": (("lights",), True),
    "environment": (("environment",), False),
    "lamp choice": (("lights",), True),
    "integrator": (("integrators",), True),
    "renderer": (("renderer", "explain.maps", "rt3.renderer"), False),
    "tone curve": (("tones",), True),
}


Part = TypeVar("Part")
PACKAGE = f"{Path(__file__).resolve().parents[2]}{os.sep}"  # how the names of the package's own files begin


class Registry:
    """The registered parts, by kind and name."""

    def __init__(self) -> None:
        self._parts: dict[str, dict[str, object]] = {kind: {} for kind in HOMES}
        self._files: dict[tuple[str, str], str] = {}  # (kind, name) → the file that registered the part
        self._loaded: set[str] = set()

    def add(self, part: Part, file: str | None = None) -> Part:
        """Register a part. Returns the part, so that this method can be used as a decorator of classes.

        If a file or a cell of a notebook runs again, it replaces the parts that it registered before.

        Args:
            part: a class or an object that derives from the base class of a kind and has a ``name``. For samplers,
                BRDFs, lights, integrators and tone curves, the registry keeps objects: a class is called without
                arguments.
            file: the file that registers the part; None takes the file of the caller.

        Raises:
            InputError: the part has no kind or no name, another part of its kind has the same name, or a method is
                missing.
        """
        kind, name = getattr(part, "kind", None), getattr(part, "name", None)
        what = class_name(part)
        if kind not in HOMES:
            bases = "Camera, RayIntersector, Sampler, Brdf, Light, Environment, LampChoice, Integrator, View, Tone"
            raise InputError(f"register: {what} derives from none of the parts that can be registered ({bases})")
        if not isinstance(name, str) or name == "":
            raise InputError(f"register: {what} needs a name: name = {what.lower()!r} in the class")
        file = file_of_caller(1) if file is None else file
        if not file.startswith(PACKAGE):
            self._load(kind)  # now, so that the parts of the package come first and keep their names
        former, by = self._parts[kind].get(name), self._files.get((kind, name), file)
        if former is not None and (by, class_name(former)) != (file, class_name(part)):
            where = "in the package" if by.startswith(PACKAGE) else f"registered by {by}"
            raise InputError(f"register: there is another {kind} called {name!r}, {where}: give yours another name")
        made = part() if HOMES[kind][1] and isinstance(part, type) else part
        if not file.startswith(PACKAGE):
            check_part(made, file)
            for error in unfinished(made).values():
                warnings.warn(f"{error}. A picture that uses it cannot be made", stacklevel=2)
        self._parts[kind][name] = made
        self._files[kind, name] = file
        return part

    def remove(self, part) -> None:
        """Remove a part from the registry."""
        self._parts[part.kind].pop(part.name, None)
        self._files.pop((part.kind, part.name), None)

    def registered_by(self, path: str | Path) -> list:
        """The parts that a file has registered."""
        file = str(Path(path).expanduser().resolve())
        return [self._parts[kind][name] for (kind, name), by in self._files.items() if by == file]

    def comes_with_package(self, part) -> bool:
        """Whether a registered part belongs to the package."""
        return self._files.get((part.kind, part.name), "").startswith(PACKAGE)

    def all(self, kind: str) -> list:
        """Every part of a kind; the parts of the package come first."""
        self._load(kind)
        return list(self._parts[kind].values())

    def last_of(self, kind: str, base: type):
        """The class that was registered last, of those of a kind that derive from another class."""
        return [part for part in self.all(kind) if issubclass(part, base)][-1]

    def everything(self) -> list:
        """All parts of all kinds that are registered at present."""
        return [part for parts in self._parts.values() for part in parts.values()]

    def names(self, kind: str) -> list[str]:
        """The names of the parts of a kind."""
        return [part.name for part in self.all(kind)]

    def find(self, kind: str, chosen):
        """The part that is meant by a name, a class or an object.

        Raises:
            InputError: the name is unknown, the class or object is not a part of this kind, or a method is missing.
        """
        if isinstance(chosen, str):
            parts = self.all(kind)
            known = {alias: part for part in parts for alias in getattr(part, "aliases", ())}
            known |= {part.name: part for part in parts}
            if chosen not in known:
                raise one_of(kind, chosen, self.names(kind))
            found = known[chosen]
            replaced(found)  # what somebody wrote is looked at before a kernel is made of it
            return found
        if getattr(chosen, "kind", None) != kind:
            raise InputError(f"{kind}: {chosen!r} is neither a name nor a part of this kind")
        made = chosen() if HOMES[kind][1] and isinstance(chosen, type) else chosen
        check_part(made)
        replaced(made)
        return made

    @one_at_a_time
    def _load(self, kind: str) -> None:
        """Import the modules of a kind's home, and put their parts in the order of the files, not of their imports."""
        if kind in self._loaded:
            return
        self._loaded.add(kind)
        modules = []
        for name in HOMES[kind][0]:
            module = import_quickly(f"taichi_tracer.{name}")
            found = sorted(m.name for m in pkgutil.iter_modules(getattr(module, "__path__", [])))
            modules += [module, *(import_quickly(f"taichi_tracer.{name}.{part}") for part in found)]
        place = {str(Path(str(module.__file__)).resolve()): i for i, module in enumerate(modules)}
        by_file = sorted(self._parts[kind], key=lambda name: place.get(self._files[kind, name], len(place)))
        self._parts[kind] = {name: self._parts[kind][name] for name in by_file}


def class_name(part) -> str:
    """The name of a class, or of an object's class."""
    return part.__name__ if isinstance(part, type) else type(part).__name__


def file_of_caller(above: int) -> str:
    """The file of the code that called a function; in a notebook, the name of its module.

    Args:
        above: the number of functions between this code and the function that calls ``file_of_caller``.
    """
    names = sys._getframe(above + 1).f_globals
    return str(Path(names["__file__"]).resolve()) if "__file__" in names else names["__name__"]


PARTS = Registry()


def register(part: Part) -> Part:
    """Register a part under its name, see ``Registry.add``. It can be used as a decorator of classes."""
    return PARTS.add(part, file_of_caller(1))


def load_parts(path: str) -> list:
    """Run a Python file that registers parts or assigns methods to the package's classes. Returns the new parts.

    The file may import modules from its own folder. A folder has files of the course, see ``course.use``.

    Raises:
        InputError: the file is missing, or an error occurred in it; the message has the error and its line.
    """
    file = Path(path).expanduser().resolve()
    if file.is_dir():
        used = import_quickly("taichi_tracer.course.use").use(path)
        for text in used.errors.values():
            warnings.warn(f"{text}; the package's own is used", stacklevel=2)
        return []
    if not file.is_file():
        raise InputError(f"--parts {path}: no such file")
    before = PARTS.registered_by(file)
    sys.path.insert(0, str(file.parent))
    try:
        runpy.run_path(str(file), run_name=file.stem)
    except OwnCodeError:
        raise
    except (Exception, SystemExit) as error:
        problem = str(error) if isinstance(error, InputError) else f"{type(error).__name__}: {error}"
        raise InputError(f"{where_in(error, file, path)}: {problem}") from error
    finally:
        sys.path.remove(str(file.parent))
    added = [part for part in PARTS.registered_by(file) if not any(part is known for known in before)]
    if not added and not assigned():
        raise InputError(f"{path}: the file registers nothing: put @tt.register before each class")
    return added


def where_in(error: BaseException, file: Path, path: str) -> str:
    """The file, as the user named it, and the line of this file in which an error occurred."""
    if isinstance(error, SyntaxError) and error.filename is not None:
        return f"{path if Path(error.filename) == file else error.filename}:{error.lineno}"
    lines = [frame.lineno for frame in traceback.extract_tb(error.__traceback__) if frame.filename == str(file)]
    return f"{path}:{lines[-1]}" if lines else path
