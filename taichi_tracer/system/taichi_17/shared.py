"""Kernels that are read once for all objects of the same kind: a second scene, or another renderer, reads nothing.

Taichi lets Python read a kernel for each object that it is called with. Here, all that the reading asks is noted: each
attribute of its objects, each name of a module or of a function around it, each attribute of a class or of a module,
and what was found there. If the kernel is called with other objects, the same questions are asked again. If all answers
are the same, the kernel that was made is used, with the arrays and the varying numbers of the new objects as its
arguments: see ``arguments``.
"""

import functools
import weakref
from collections.abc import Callable
from typing import Any

from taichi_tracer.system import arrays
from taichi_tracer.system.taichi_17 import names
from taichi_tracer.system.taichi_17.questions import Notes, noting

MOST_KERNELS = 8  # kernels that are remembered for each function


class Known:
    """A kernel that was read, and for which objects.

    Attributes:
        notes: what the reading asked. kernel: Taichi's object of the kernel. launch: sets its arguments.
        features: what Taichi notes of arguments that are no objects.
    """

    def __init__(self, notes: Notes, kernel: Any, launch: Any, features: Any) -> None:
        self.notes, self.kernel, self.launch, self.features = notes, kernel, launch, features


def objects_in(kernel: Any, arguments: tuple[Any, ...]) -> tuple[Any, ...]:
    """The template arguments of a call."""
    return tuple(arguments[k] for k in kernel.template_slot_locations)


def features_in(kernel: Any, features: Any) -> Any:
    """What Taichi notes of the other arguments of a call."""
    return tuple(one for k, one in enumerate(features) if k not in kernel.template_slot_locations)


def sharing(usual: Callable) -> Callable:
    """``Kernel.materialize``, which reads a kernel only if it was not read for objects that are alike."""

    @functools.wraps(usual)
    def materialize(self: Any, key: Any = None, args: Any = None, arg_features: Any = None) -> None:
        if key is None or key in self.compiled_kernels or not arrays.are_possible():
            usual(self, key=key, args=args, arg_features=arg_features)
            return
        self.runtime.materialize()  # it may forget all kernels
        known = self.__dict__.setdefault("known", [])
        if not self.compiled_kernels:
            known.clear()
            launches(self).clear()
        objects, features = objects_in(self, args), features_in(self, arg_features)
        for one in known:
            if one.features == features and one.kernel in self.compiled_kernels.values():
                found = one.notes.objects_of(objects)
                launch = one.launch if found is None or one.launch is None else one.launch.of(found)
                if found is not None and (launch is None) == (one.launch is None):
                    self.compiled_kernels[key] = one.kernel
                    launches(self)[key] = launch
                    return
        notes = Notes(objects)
        noting.append(notes)
        try:
            usual(self, key=key, args=args, arg_features=arg_features)
            names.note(notes)
        finally:
            noting.pop()
            notes.end()
        kernel = self.compiled_kernels[key]
        launch = arguments_of(kernel)
        if launch is None or launch.know(notes.numbers):
            notes.forget_objects()
            remember(self, Known(notes, kernel, launch, features))

    return materialize


def remember(kernel: Any, known: Known) -> None:
    """Remember a kernel that was read, and forget the one that was read first."""
    kernel.known.insert(0, known)
    del kernel.known[MOST_KERNELS:]


def forget(kernel: Any, key: Any, made: Any) -> None:
    """Let Taichi read a kernel again when it is launched for the same objects."""
    kernel.compiled_kernels.pop(key, None)
    launches(kernel).pop(key, None)
    known = kernel.__dict__.get("known", [])
    known[:] = [one for one in known if one.kernel is not made]


def choosing(usual: Callable) -> Callable:
    """``Kernel.ensure_compiled``, which Taichi calls before a launch: it chooses the arguments of the objects."""

    @functools.wraps(usual)
    def ensure_compiled(self: Any, *args: Any) -> Any:
        global _chosen
        key = usual(self, *args)
        _chosen = launches(self).get(key) or arguments_of(self.compiled_kernels[key])
        if _chosen is not None and not _chosen.is_alive():  # an object of the kernel has other arrays by now
            del self.compiled_kernels[key]
            launches(self).pop(key, None)
            key = usual(self, *args)
            _chosen = launches(self).get(key) or arguments_of(self.compiled_kernels[key])
        return key

    return ensure_compiled


def launches(kernel: Any) -> dict[Any, Any]:
    """key → what sets the arguments, for the calls of a kernel that was read for other objects."""
    return kernel.__dict__.setdefault("launches", {})


def arguments_of(kernel: Any) -> Any:
    """What sets the arguments of a kernel for the objects for which it was read; None if it has none."""
    return LAUNCHES.get(kernel)


def chosen() -> Any:
    """What sets the arguments of the launch that comes next."""
    global _chosen
    now, _chosen = _chosen, None
    return now


LAUNCHES: "weakref.WeakKeyDictionary[Any, Any]" = (
    weakref.WeakKeyDictionary()
)  # Taichi's object of a kernel → ``Launch``
_chosen: Any = None
