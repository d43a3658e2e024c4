"""Kernel scope: functions of Python that run while a kernel is compiled, and the one thread that uses Taichi.

Taichi has one state for all threads, and ends the process where two change it: one thread at a time uses it.
"""

import functools
import os
import threading
from collections.abc import Callable
from types import SimpleNamespace
from typing import Any, TypeVar

from taichi.lang import impl
from taichi.lang.exception import TaichiSyntaxError

Function = TypeVar("Function", bound=Callable)
LOCK = threading.RLock()
starter = threading.main_thread().ident  # the thread that has started Taichi: Taichi's own trees of fields are its
_user: int | None = None  # the thread that has the lock


def one_at_a_time(function: Function) -> Function:
    """The function, which waits until no other thread is in one that is decorated like this."""

    @functools.wraps(function)
    def called(*arguments: Any, **named: Any) -> Any:
        global _user
        with LOCK:
            former, _user = _user, threading.get_ident()
            try:
                return function(*arguments, **named)
            finally:
                _user = former

    return called  # type: ignore[return-value]


def inside_kernel() -> bool:
    """Whether this thread reads a kernel; another one may read one meanwhile."""
    return impl.inside_kernel() and _user in (None, threading.get_ident())


def note_start() -> None:
    """Note that this thread starts Taichi."""
    global starter
    starter = threading.get_ident()


def is_starter() -> bool:
    """Whether this thread has started Taichi."""
    return starter == threading.get_ident()


def usable_processors() -> int:
    """How many processors this process may use."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


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
