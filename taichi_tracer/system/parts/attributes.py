"""What classes of this package refuse and what they are to Taichi.

A value that nobody reads is refused: ``renderer.max_bounce = 3`` would change nothing, and say nothing. And a class may
be the annotation of an argument of a kernel, as handouts write it: ``material: Material``. Taichi accepts only types of
its own there, so that an argument with such a class as its annotation is passed as if it had none.
"""

import difflib
import inspect
import os
import sys
from abc import ABCMeta
from pathlib import Path
from types import FrameType
from typing import TYPE_CHECKING, Any

import taichi as ti

from taichi_tracer.system.errors import InputError, no_argument

OWN = ("taichi_tracer", "taichi")  # packages that may add attributes
PACKAGE = f"{Path(__file__).resolve().parents[2]}{os.sep}"  # files of it that run under another name, too


class KnownAttributes:
    """A class whose objects get only attributes that they know, from outside.

    Known are those that its methods have set, and those of its class, with a value or with an annotation alone; and
    all that begin with ``_``. A subclass adds attributes of its own in its class, in ``__init__`` or in any other of
    its methods.
    """

    def __setattr__(self, name: str, value: Any) -> None:
        if name not in vars(self) and not is_of_class(type(self), name) and not may_add(self, sys._getframe(1)):
            raise unknown(self, name)
        super().__setattr__(name, value)


def is_of_class(cls: type, name: str) -> bool:
    """Whether a class has an attribute or an annotation of one, or whether the name is a private one."""
    is_declared = any(name in vars(base).get("__annotations__", {}) for base in cls.__mro__)
    return is_declared or name.startswith("_") or hasattr(cls, name)


def may_add(part: object, frame: FrameType) -> bool:
    """Whether the code of a frame may add an attribute: a method of the object, and the packages ``OWN``."""
    code = frame.f_code
    if str(frame.f_globals.get("__name__")).split(".")[0] in OWN or code.co_filename.startswith(PACKAGE):
        return True
    return code.co_argcount > 0 and frame.f_locals.get(code.co_varnames[0]) is part


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
        known = list(inspect.signature(vars(cls)["__init__"]).parameters)
        for name in named:
            if name not in known:
                raise no_argument(cls.__name__, name, known)
        return super().__call__(*values, **named)


class AbstractAnnotation(Annotation, ABCMeta):
    """The same for an abstract class."""
