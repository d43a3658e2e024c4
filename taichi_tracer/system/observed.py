"""The one way to watch a sample: copies of a picture's parts that do what the parts do, and call an observer.

An observer is a function ``observer(part, call, *arguments)``. It runs in place of a method, while a kernel is being
compiled. ``call(*arguments)`` is the method itself: that of the package, or the one that a student wrote in its place.
What the observer returns is what the caller gets. Therefore an observer may act before the method and after it, change
its arguments, or answer in its place. ``after`` makes observers that only look.

The parts themselves stay as they are: a picture that nobody watches uses them, and pays nothing.
"""

import functools
import inspect
from collections.abc import Callable, Mapping
from typing import Any

from taichi.lang import impl

from taichi_tracer.system.compile_time import compile_time

Observer = Callable[..., Any]  # (part, call, *arguments) → what the method returns


def observed(part: Any, observers: Mapping[str, Observer]) -> Any:
    """A copy of a part, of a class derived from its own, whose named methods go through observers.

    A method may be replaced in every way that ``overridable`` allows: in a subclass, by an assignment to the class or
    to the object, with ``self`` or without it, as a static method. A copy may be observed again: the last observer runs
    first.

    Args:
        observers: the name of a method → its observer. Names that the part does not have are left out.
    """
    found, own = object.__new__(type(part)), vars(part)
    vars(found).update(own)  # what kernels read is shared, even if ``copy`` would make it anew
    methods = {}
    for name, observer in observers.items():
        if hasattr(part, name):
            is_own = name in own  # it was assigned to the object; the new class calls it
            vars(found).pop(name, None)
            original = own[name] if is_own else inspect.getattr_static(type(part), name)
            methods[name] = _method(original, is_own, observer)
    found.__class__ = type(f"Observed{type(part).__name__}", (type(part),), methods)
    return found


def _method(original: Any, is_own: bool, observer: Observer) -> Callable:
    """The method of an observed class; ``is_own`` says whether the original was the object's own."""
    plain = getattr(original, "__func__", original)

    @functools.wraps(plain)
    def method(self, *arguments, **named):
        """The method of the part, observed."""
        call = original if is_own else original.__get__(self, type(self))
        try:
            given = inspect.signature(call).bind(*arguments, **named)
        except TypeError:  # a function without ``self``, see ``parts.call_with_known_args``
            call = plain
            given = inspect.signature(call).bind(*arguments, **named)
        return observer(self, call, *given.args, **given.kwargs)

    signature = inspect.signature(plain)
    names = list(signature.parameters)
    if names[:1] != ["self"]:  # this one has it, and says so to ``parts.call_with_known_args``
        first = inspect.Parameter("self", inspect.Parameter.POSITIONAL_OR_KEYWORD)
        signature = signature.replace(parameters=[first, *signature.parameters.values()])
    method.__signature__ = signature  # type: ignore[attr-defined]
    return compile_time(method)


def after(act: Callable[..., object]) -> Observer:
    """The observer that lets the method run, and then calls ``act(part, result, *arguments)``."""

    def observer(part: Any, call: Callable, *arguments: Any) -> Any:
        result = impl.expr_init(call(*arguments))  # computed once, however often it is used
        act(part, result, *arguments)
        return result

    return observer


def observed_scene(scene: Any, observers: Mapping[str, Mapping[str, Observer]]) -> Any:
    """A copy of a ``SceneInKernels`` that is observed together with its lights, its intersector and its surfaces.

    Args:
        observers: what ``observed`` takes for each of "scene", "lights", "ray_intersector" and "surface", which stands
            for every surface that the scene makes. Parts that are not named stay as they are.
    """

    def surface_at(scene: Any, call: Callable, *of: Any) -> Any:
        return observed(call(*of), observers["surface"])

    found = observed(scene, {"surface_at": surface_at} if "surface" in observers else {})
    found = observed(found, observers.get("scene", {}))
    for name in ("lights", "ray_intersector"):
        if name in observers:
            setattr(found, name, observed(getattr(scene, name), observers[name]))
    return found
