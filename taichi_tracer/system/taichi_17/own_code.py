"""Where Taichi reads a student's function: its results are checked, and its mistakes give a message of one line."""

import functools
import re
import warnings
from collections.abc import Callable
from typing import Any

from taichi.lang import impl
from taichi.lang.exception import TaichiTypeError
from taichi.lang.expr import Expr

from taichi_tracer.system.own_code import checks, faults
from taichi_tracer.system.own_code.checks import is_own_file, shown_place


def looking(call: Callable) -> Callable:
    """``Func.__call__``, after which the kind of what a student's method returns is looked at."""

    @functools.wraps(call)
    def looked(self: Any, *arguments: Any, **options: Any) -> Any:
        value = call(self, *arguments, **options)
        if impl.inside_kernel():
            checks.look(self.func, value)
        return value

    return looked


def assigning(assign: Callable) -> Callable:
    """``TaichiOperations._assign``, or ``_augassign``: a vector that is given to a number would end the process.

    A number with a fraction that is given to a whole number loses it: that is noted for a student's own code.
    """

    @functools.wraps(assign)
    def assigned(of: Any, value: Any, *operation: Any) -> Any:
        if (
            isinstance(of, Expr)
            and checks.types_of(of) != ["unknown"]
            and not of.is_tensor()
            and checks.shape_of(value)
        ):
            what = checks.kind_of(value)
            raise TaichiTypeError(f"a variable that holds a number cannot get {what}: begin with tm.vec3(0)")
        is_whole = all(re.fullmatch(r"[iu]\d+", one) for one in checks.types_of(of))
        has_fraction = any(one.startswith("f") for one in checks.types_of(value)) or isinstance(value, float)
        if is_whole and has_fraction and (place := own_place()):
            text = "a whole number gets a number with a fraction, which is cut off: begin with 0.0 instead of 0"
            warnings.warn(f"{place}: {text}", stacklevel=2)
        return assign(of, value, *operation)

    return assigned


def multiplying(multiply: Callable) -> Callable:
    """``TaichiOperations.__mul__``, which multiplies the rows of a matrix by the elements of a vector."""

    @functools.wraps(multiply)
    def multiplied(of: Any, other: Any) -> Any:
        shapes = sorted(len(checks.shape_of(one) or ()) for one in (of, other))
        if impl.inside_kernel() and shapes == [1, 2] and own_place():
            raise TaichiTypeError("* does not multiply a matrix and a vector: use M @ v")
        return multiply(of, other)

    return multiplied


def deciding(_usual: object) -> Callable:
    """``Expr.__bool__``, by which Python would decide that every number of a kernel is true."""

    def decides(_of: Any) -> bool:
        if impl.inside_kernel():
            raise TaichiTypeError("Python cannot decide by a number of a kernel")
        return True

    return decides


def own_place() -> str:
    """The file and the line that Taichi reads now, if somebody else than the package has written it; otherwise ""."""
    found = faults.PLACE.match(impl.get_runtime().get_current_src_info())
    return shown_place(found[1], int(found[2])) if found is not None and is_own_file(found[1]) else ""
