"""Functions of Python that run while a kernel is compiled, and what they need: variables and elements of fields."""

import functools
from collections.abc import Callable
from types import SimpleNamespace
from typing import Any, TypeVar

from taichi.lang import impl
from taichi.lang.exception import TaichiSyntaxError

from taichi_tracer.system.threads import inside_kernel

Function = TypeVar("Function", bound=Callable)


def runs_in_kernels(function) -> bool:
    """Whether only kernels can call a function: it has ``@ti.func``, and is not made by ``compile_time``."""
    return hasattr(function, "_is_taichi_function") and not getattr(function, "is_for_python_too", False)


def compile_time(function: Function) -> Function:
    """Let kernels call a Python function at compile time. It may inspect its arguments and call Taichi functions.

    Python runs it, and Taichi need not read its source: a small function that kernels call in many places is read in a
    fifth of the time. What it assigns to a name is an expression, which is computed at each use, see ``variable``.
    """
    marks = {"_is_taichi_function": True, "is_for_python_too": True}
    function.__dict__.update(marks, func=SimpleNamespace(has_print=False))  # Taichi reads ``func`` of what kernels call
    return function


@compile_time
def variable(value):
    """A value that a function with ``compile_time`` uses several times: kernels compute it once, and keep it."""
    if not inside_kernel():  # as Taichi says it of its own functions
        raise TaichiSyntaxError("Taichi functions cannot be called from Python-scope.")
    return impl.expr_init(value)


@compile_time
def element(field, *indices):
    """``field[indices]`` in a function with ``compile_time``."""
    return impl.subscript(impl.get_runtime().compiling_callable.ast_builder(), field, *indices)


def compile_time_as(inside: Callable) -> Callable[[Function], Function]:
    """Let kernels call a method of Python; at compile time, ``inside(object)`` takes its place there."""

    def decorate(method: Any) -> Any:
        @functools.wraps(method)
        def either(owner: object) -> Any:
            return inside(owner) if inside_kernel() else method(owner)

        return compile_time(either)

    return decorate
