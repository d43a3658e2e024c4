"""What to call instead, if Python calls a function that only kernels can call.

Taichi says no more than "Taichi functions cannot be called from Python-scope". Here the message names the function, and
what gives the same answer from Python: the attribute ``from_python`` of the object to which the function belongs. The
methods of a student's own class have the advice of the class from which it derives.
"""

import functools
from collections.abc import Callable

from taichi.lang import impl, kernel_impl

IN_GENERAL = "call it from a function with @ti.kernel"


def advice(function, arguments: tuple = ()) -> str:
    """The message for a function with ``@ti.func`` that was called with these arguments from Python."""
    name, owner = function.__qualname__.split("<locals>.")[-1], arguments[0] if arguments else None
    if hasattr(type(owner), function.__name__):
        name = f"{type(owner).__name__}.{function.__name__}"
    return f"{name} runs only in kernels: {getattr(owner, 'from_python', IN_GENERAL)}"


def explaining(call: Callable) -> Callable:
    """``Func.__call__``, which raises Taichi's own error with this message where Python calls it."""

    @functools.wraps(call)
    def explained(self, *arguments, **options):
        if not self.pyfunc and not impl.inside_kernel():
            raise kernel_impl.TaichiSyntaxError(advice(self.func, arguments))
        return call(self, *arguments, **options)

    return explained
