"""Classes of Python that Taichi takes as the annotation of an argument, as handouts write it: ``material: Material``.

Taichi takes only types of its own there. An argument with such a class as its annotation is passed as if it had none.
"""

from abc import ABCMeta
from typing import TYPE_CHECKING, Any

import taichi as ti


class Annotation(type):
    """The class of a class that is an annotation: to ``isinstance``, which Taichi asks, it is a ``ti.template``."""

    if not TYPE_CHECKING:

        @property
        def __class__(cls) -> Any:
            return ti.template


class AbstractAnnotation(Annotation, ABCMeta):
    """The same for an abstract class."""
