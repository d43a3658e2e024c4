"""The one way to watch a sample: copies of a picture's parts that do what the parts do, and tell an observer of it.

An observer is a function ``observer(part, call, *arguments)``. It runs in place of a method, while a kernel is being
compiled. ``call(*arguments)`` is the method itself: that of the package, or the one that a student wrote in its place.
What the observer returns is what the caller gets. Therefore an observer may act before the method and after it, change
its arguments, or answer in its place. ``before`` and ``after`` make observers that only look.

The parts themselves stay as they are: a picture that nobody watches uses them, and pays nothing.
"""

import copy
import functools
import inspect
from collections.abc import Callable, Mapping
from typing import Any

from taichi.lang import impl

from taichi_tracer.system.seams import in_kernels

Observer = Callable[..., Any]  # (part, call, *arguments) → what the method returns


def observed(part: Any, observers: Mapping[str, Observer]) -> Any:
    """A copy of a part, of a class derived from its own, whose named methods go through observers.

    A method may be replaced in every way that ``seams`` allows: in a subclass, by an assignment to the class or to the
    object, with ``self`` or without it, as a static method. A copy may be observed again: the last observer is the
    first one that runs.

    Args:
        observers: the name of a method → its observer. Names that the part does not have are left out.
    """
    cls, found = type(part), copy.copy(part)
    members = {name: _method(part, name, one) for name, one in observers.items() if hasattr(part, name)}
    for name in members:
        vars(found).pop(name, None)  # a method that was assigned to the object; the new class calls it
    found.__class__ = type(f"Observed{cls.__name__}", (cls,), members)
    return found


def _method(part: Any, name: str, observer: Observer) -> Callable:
    """The method of an observed class."""
    own = vars(part)
    original = own[name] if name in own else inspect.getattr_static(type(part), name)
    plain = getattr(original, "__func__", original)

    @functools.wraps(plain)
    def method(self, *arguments, **named):
        """The method of the part, observed."""
        call = original if name in own else original.__get__(self, type(self))
        try:
            given = inspect.signature(call).bind(*arguments, **named)
        except TypeError:  # a function without ``self``, see ``seams.called``
            call = plain
            given = inspect.signature(call).bind(*arguments, **named)
        return observer(self, call, *given.args, **given.kwargs)

    signature = inspect.signature(plain)
    names = list(signature.parameters)
    if names[:1] != ["self"]:  # this one has it, and says so to ``seams.called``
        first = inspect.Parameter("self", inspect.Parameter.POSITIONAL_OR_KEYWORD)
        signature = signature.replace(parameters=[first, *signature.parameters.values()])
    method.__signature__ = signature  # type: ignore[attr-defined]
    return in_kernels(method)


def before(act: Callable[..., object]) -> Observer:
    """The observer that calls ``act(part, *arguments)``, and then lets the method run."""

    def observer(part: Any, call: Callable, *arguments: Any) -> Any:
        act(part, *arguments)
        return call(*arguments)

    return observer


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
    found = scene
    if of_surfaces := observers.get("surface"):

        def surface_at(part: Any, call: Callable, ray: Any, hit: Any) -> Any:
            return observed(call(ray, hit), of_surfaces)

        found = observed(found, {"surface_at": surface_at})
    found = observed(found, observers.get("scene", {}))
    for name in ("lights", "ray_intersector"):
        if name in observers:
            setattr(found, name, observed(getattr(scene, name), observers[name]))
    return found
