"""Classes of Python that Taichi takes as the annotation of an argument, as handouts write it: ``material: Material``.

Taichi takes only types of its own there. An argument with such a class as its annotation is passed as if it had none.
"""

import inspect
from abc import ABCMeta
from typing import TYPE_CHECKING, Any

import taichi as ti

from taichi_tracer.system.attributes import OfObjects
from taichi_tracer.system.errors import no_argument


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


class AbstractAnnotation(Annotation, OfObjects, ABCMeta):
    """The same for an abstract class."""
