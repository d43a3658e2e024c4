"""Parts that can be chosen by name, such as cameras, samplers, BRDFs, integrators, tone curves; and what was replaced.

A part is registered in the file that defines it. After that, the command line, the window, the studies and the contract
tests know the part:

    @tt.register
    class Fisheye(tt.Camera):
        name = "fisheye"
        ...

Each kind of part has a home: the modules that define the parts of this kind in the package. They are imported when a
part of the kind is looked up for the first time. Add a kind to ``HOMES``.

If a student replaces a method of the handouts, in a subclass or by an assignment to the class, the student's code must
run. ``replaced`` says for every part which methods these are.

A value that nobody reads is refused: ``renderer.max_bounce = 3`` would change nothing, and say nothing. And a class may
be the annotation of an argument of a kernel, as handouts write it: ``material: Material``. Taichi accepts only types of
its own there, so that an argument with such a class as its annotation is passed as if it had none.
"""

import difflib
import inspect
import pkgutil
import runpy
import sys
import traceback
import warnings
from abc import ABCMeta
from collections.abc import Callable
from pathlib import Path
from types import FrameType, MethodType
from typing import TYPE_CHECKING, Any, TypeVar

import taichi as ti

from taichi_tracer.system.compile_time import compile_time, inside_kernel, one_at_a_time
from taichi_tracer.system.errors import InputError, OwnCodeError, check_names, one_of
from taichi_tracer.system.importing import import_quickly
from taichi_tracer.system.own_code.checks import PACKAGE, check_class, check_method, note_misspelt, parameters

# ── which attributes they have ──


OWN = ("taichi_tracer", "taichi")  # packages that may add attributes


class KnownAttributes:
    """A class whose objects get only attributes that they know, from outside.

    Known are those that its methods have set, and those of its class, with a value or with an annotation alone; and
    all that begin with ``_``. A subclass adds attributes of its own in its class, in ``__init__`` or in any other of
    its methods.
    """

    def __setattr__(self, name: str, value: Any) -> None:
        is_known = name in vars(self) or name.startswith("_") or hasattr(type(self), name)
        is_known = is_known or any(name in vars(base).get("__annotations__", {}) for base in type(self).__mro__)
        if not (is_known or may_add(self, sys._getframe(1))):
            raise unknown(self, name)
        super().__setattr__(name, value)


def may_add(part: object, frame: FrameType) -> bool:
    """Whether the code of a frame may add an attribute: a method of the object, and the packages ``OWN``."""
    module = str(frame.f_globals.get("__name__")).split(".")[0]
    return frame.f_code.co_filename.startswith(PACKAGE) or module in OWN or frame.f_locals.get("self") is part


def unknown(part: object, name: str) -> InputError:
    """The error for an attribute that an object does not know, with the most similar one."""
    known = {n for n in (*dir(type(part)), *vars(part)) if not n.startswith("_")}
    data = {n for n in known if not callable(getattr(type(part), n, None))}
    near = difflib.get_close_matches(name, sorted(data), n=1)
    guess = f": did you mean {near[0]!r}?" if near else "."
    where = "Attributes of your own belong into your class, or into its __init__"
    return InputError(f"{type(part).__name__} has no attribute {name!r}{guess} {where}")


class Annotation(type):
    """The class of a class that is an annotation: to ``isinstance``, which Taichi asks, it is a ``ti.template``."""

    if not TYPE_CHECKING:

        @property
        def __class__(cls) -> Any:
            return ti.template


class Spelled(Annotation):
    """The same for a dataclass, which names the most similar argument to one that it does not have."""

    @property
    def __signature__(cls) -> inspect.Signature:
        of_init = inspect.signature(vars(cls)["__init__"])
        shown = [p.replace(annotation=p.empty) for name, p in of_init.parameters.items() if name != "self"]
        return of_init.replace(parameters=shown, return_annotation=of_init.empty)

    def __call__(cls, *values: Any, **named: Any) -> Any:
        known = list(inspect.signature(vars(cls)["__init__"]).parameters)[1:]
        check_names(f"argument of {cls.__name__}", named, known)
        return super().__call__(*values, **named)


class AbstractAnnotation(Annotation, ABCMeta):
    """The same for an abstract class."""


# ── what a student has replaced ──


Class = TypeVar("Class", bound=type)

# Class → {name of a method: the function that the package defines for it}.
_SHIPPED: dict[type, dict[str, object]] = {}
# Class → {name of a method: the kind of what it returns}, see ``own_code.checks``.
_GIVES: dict[type, dict[str, str]] = {}


def overridable(*names: str, **gives: str) -> Callable[[Class], Class]:
    """A class decorator that remembers the original methods of the class that a student may replace.

    Args:
        names: of methods. gives: further ones, each with the kind of what it returns in kernels: ``eval="vec3"``.
    """
    names = (*gives, *names)

    def remember(cls: Class) -> Class:
        inherited: dict[str, object] = {}
        for base in reversed(cls.__mro__[1:]):
            inherited |= _SHIPPED.get(base, {})
            if base not in _SHIPPED:
                inherited |= {name: written(base, name) for name in inherited if name in vars(base)}
        own = {name: written(cls, name) for name in [*inherited, *names] if name in vars(cls) or name not in inherited}
        _GIVES[cls] = gives
        _SHIPPED[cls] = inherited | own  # what a base had when it was defined: somebody may have replaced it since
        return cls

    return remember


def shipped_of(cls: type) -> dict[str, object]:
    """Name → the package's function, of each method of a class that a student may replace."""
    return next((_SHIPPED[base] for base in cls.__mro__ if base in _SHIPPED), {})


def gives_of(cls: type) -> dict[str, str]:
    """Name of a method → the kind of what it returns in kernels, of a class and of those from which it derives."""
    return {name: kind for base in reversed(cls.__mro__) for name, kind in _GIVES.get(base, {}).items()}


def replaced(part) -> tuple[str, ...]:
    """The names of the methods of a class or an object that were replaced.

    A method counts as replaced in three cases: a subclass outside the package defines it; another function was assigned
    to the class; or the object itself has an attribute with this name.

    A method that cannot run in the place of the package's is marked as ``Unfinished``: a picture that uses it ends with
    what is wrong.
    """
    cls = part if isinstance(part, type) else type(part)
    own = {} if isinstance(part, type) else getattr(part, "__dict__", {})
    shipped = shipped_of(cls)
    names = tuple(name for name in shipped if name in own or written(cls, name) is not shipped[name])
    for name in names if not inside_kernel() else ():  # there, Taichi would wrap the error
        if callable(shipped[name]) and not isinstance(own.get(name, inspect.getattr_static(cls, name)), Unfinished):
            function: Any = own[name] if name in own else written(cls, name)
            try:
                check_method(cls, name, function, shipped[name], gives_of(cls).get(name, ""))
            except OwnCodeError as error:
                setattr(part if name in own else cls, name, Unfinished(function, error))
    return names


class Unfinished:
    """A method that somebody has written, and that cannot run in the place of the package's: any use raises the error.

    Args:
        function: what was written. error: what is wrong with it.
    """

    def __init__(self, function: Callable, error: OwnCodeError) -> None:
        self.written, self.error = function, error
        compile_time(self)

    def __call__(self, *_arguments: Any, **_named: Any) -> None:
        """Raise the error."""
        raise OwnCodeError(self.error.args[0], self.error.text, self.error.file, self.error.line)


def unfinished(part) -> dict[str, OwnCodeError]:
    """Name → what is wrong, of each replaced method of a class or an object that cannot run."""
    found = {name: vars(part).get(name, inspect.getattr_static(part, name)) for name in replaced(part)}
    return {name: method.error for name, method in found.items() if isinstance(method, Unfinished)}


def check_part(part, file: str = "") -> None:
    """Raise an InputError if a class or an object lacks a method that its kind must define; note misspelt ones.

    Args:
        file: where it is written, if that is known.
    """
    cls = part if isinstance(part, type) else type(part)
    check_class(cls, getattr(part, "required", ()), file)
    note_misspelt(cls, tuple(shipped_of(cls)))


def written(cls: type, name: str) -> object:
    """A method as its class defines it, or as a student wrote it."""
    found = inspect.getattr_static(cls, name)
    return getattr(found, "written", found)


def assigned() -> list[str]:
    """The methods of the package's classes that were replaced by an assignment, as "Camera.generate_ray"."""
    return [f"{cls.__name__}.{name}" for cls in _SHIPPED for name in replaced(cls)]


def why_replaced(part) -> str:
    """The reason for receipts: "MyCamera replaces generate_ray"; "" if nothing is replaced."""
    names = replaced(part)
    return f"{class_name(part)} replaces {', '.join(names)}" if names else ""


def adapt_signature(cls: type) -> None:
    """Let the package call methods of a class that a student has written with fewer parameters than the package's.

    For example, ``sample(self, scene, surface)`` draws its random numbers itself, and is called without ``xi``.
    """
    for name in replaced(cls):
        owner = next(base for base in cls.__mro__ if name in vars(base))
        function: Any = written(owner, name)
        has_fewer = len(parameters(function)) < len(parameters(shipped_of(cls)[name]))
        if has_fewer and not isinstance(vars(owner)[name], Unfinished):
            setattr(owner, name, Fitted(function))


class Fitted:
    """A method with few parameters: it is called with the first of the arguments.

    Args:
        function: what the student wrote.
    """

    def __init__(self, function: Callable) -> None:
        self.written = function
        self.call = compile_time(lambda of, *arguments: function(of, *arguments[: len(parameters(function))]))

    def __get__(self, owner: object, cls: type | None = None) -> object:
        return self.written if owner is None else MethodType(self.call, owner)


def takes(function, name: str) -> bool:
    """Whether a function has a parameter of this name."""
    return name in inspect.signature(function).parameters


def takes_whole_numbers(function) -> bool:
    """Whether the first argument of a function, after ``self``, is annotated as a whole number."""
    annotations = [p.annotation for p in parameters(function)]
    return bool(annotations) and annotations[0] in (int, ti.i8, ti.i16, ti.i32, ti.i64, ti.u8, ti.u16, ti.u32, ti.u64)


@compile_time
def call_with_known_args(method, *arguments, **offered):
    """``method(*arguments)``, and those of the ``offered`` arguments that the method has parameters for.

    The signatures of the handouts have fewer parameters than those of the package. For example,
    ``generate_ndc_coords(pixel_x, pixel_y)`` has no jitter, and ``sample_direction()`` draws its own random numbers. If
    a function without ``self`` was assigned to a class, it is called without ``self``.
    """
    function = getattr(method, "__func__", None)
    if function is not None:
        names = list(inspect.signature(function).parameters)
        if not names or names[0] != "self":
            method = function
    return method(*arguments, **{name: value for name, value in offered.items() if takes(method, name)})


# ── the registry ──


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
        elif getattr(chosen, "kind", None) != kind:
            raise InputError(f"{kind}: {chosen!r} is neither a name nor a part of this kind")
        else:
            found = chosen() if HOMES[kind][1] and isinstance(chosen, type) else chosen
            check_part(found)
        replaced(found)  # what somebody wrote is looked at before a kernel is made of it
        return found

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
        raise InputError(f"{path}: no such file")
    before = PARTS.registered_by(file)
    sys.path.insert(0, str(file.parent))
    try:
        runpy.run_path(str(file), run_name=file.stem)
    except OwnCodeError:
        raise
    except (Exception, SystemExit) as error:
        problem = (
            str(error) if isinstance(error, InputError) else f"{type(error).__name__}: {getattr(error, 'msg', error)}"
        )
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
