"""Methods that a student may replace. Which of them were replaced, and how they are called by their signature.

If a student replaces a method of the handouts, in a subclass or by an assignment to the class, the student's code must
run. ``replaced`` says for every part which methods these are.
"""

import inspect
from collections.abc import Callable
from types import MethodType
from typing import Any, TypeVar

import taichi as ti

from taichi_tracer.system.compile_time import compile_time
from taichi_tracer.system.errors import OwnCodeError
from taichi_tracer.system.own_code.interface import check_class, check_method, note_misspelt
from taichi_tracer.system.threads import inside_kernel

Class = TypeVar("Class", bound=type)

# Class → {name of a method: the function that the package defines for it}.
_SHIPPED: dict[type, dict[str, object]] = {}
# Class → {name of a method: the kind of what it returns}, see ``own_code.kinds``.
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
    home = next((base for base in cls.__mro__ if base in _SHIPPED), None)
    if home is None:
        return ()
    own = {} if isinstance(part, type) else getattr(part, "__dict__", {})
    shipped = _SHIPPED[home]
    names = tuple(name for name in shipped if name in own or written(cls, name) is not shipped[name])
    for name in names if not inside_kernel() else ():  # there, Taichi would wrap the error
        if callable(shipped[name]) and not isinstance(own.get(name, inspect.getattr_static(cls, name)), Unfinished):
            function: Any = own[name] if name in own else written(cls, name)
            try:
                check_method(cls, name, function, shipped[name], gives_of(home).get(name, ""))
            except OwnCodeError as error:
                setattr(part if name in own else cls, name, Unfinished(function, error))
    return names


class Unfinished:
    """A method that somebody has written, and that cannot run in the place of the package's: any use raises the error.

    Args:
        function: what was written. error: what is wrong with it.
    """

    def __init__(self, function: Callable, error: OwnCodeError) -> None:
        self.written, self.error, self.use = function, error, compile_time(self._use)

    def _use(self, *_arguments: Any, **_named: Any) -> None:
        raise OwnCodeError(self.error.args[0], self.error.text, self.error.file, self.error.line)

    def __get__(self, owner: object, cls: type | None = None) -> object:
        return self.use

    def __call__(self, *_arguments: Any, **_named: Any) -> None:
        """Raise the error: an object may have the method as an attribute of its own."""
        self._use()


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
    home = next((base for base in cls.__mro__ if base in _SHIPPED), None)
    check_class(cls, getattr(part, "required", ()), file)
    note_misspelt(cls, tuple(_SHIPPED[home]) if home is not None else ())


def written(cls: type, name: str) -> object:
    """A method as its class defines it, or as a student wrote it."""
    found = inspect.getattr_static(cls, name)
    return getattr(found, "written", found)


def is_as_written(part, module: str) -> bool:
    """Whether the class of an object is one of this module or package, and none of its methods was replaced."""
    return type(part).__module__.startswith(module) and not replaced(part)


def assigned() -> list[str]:
    """The methods of the package's classes that were replaced by an assignment, as "Camera.generate_ray"."""
    return [f"{cls.__name__}.{name}" for cls in _SHIPPED for name in replaced(cls)]


def why_replaced(part) -> str:
    """The reason for receipts: "MyCamera replaces generate_ray"; "" if nothing is replaced."""
    names = replaced(part)
    cls = part if isinstance(part, type) else type(part)
    return f"{cls.__name__} replaces {', '.join(names)}" if names else ""


def adapt_signature(cls: type) -> None:
    """Let the package call methods of a class that a student has written with fewer parameters than the package's.

    For example, ``sample(self, scene, surface)`` draws its random numbers itself, and is called without ``xi``.
    """
    home = next((base for base in cls.__mro__ if base in _SHIPPED), cls)
    for name in replaced(cls):
        owner = next(base for base in cls.__mro__ if name in vars(base))
        function: Any = written(owner, name)
        has_fewer = len(parameters(function)) < len(parameters(_SHIPPED[home][name]))
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


def parameters(function) -> list[str]:
    """The names of the parameters of a function or method, without ``self``."""
    return [name for name in inspect.signature(function).parameters if name != "self"]


def takes(function, name: str) -> bool:
    """Whether a function has a parameter of this name."""
    return name in inspect.signature(function).parameters


def takes_whole_numbers(function) -> bool:
    """Whether the first argument of a function, after ``self``, is annotated as a whole number."""
    annotations = [p.annotation for p in inspect.signature(function).parameters.values() if p.name != "self"]
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
