"""Values of objects that are also read and written as in the course, where each is a Taichi field without index.

``camera.eye`` is three numbers; ``camera.eye[None]`` is the same as a vector of Taichi, and an assignment to it is an
assignment to ``camera.eye``. In a kernel, both are the vector. Numbers, and modes of a renderer, work in the same way.
"""

from collections.abc import Callable
from typing import Any

import numpy as np
import taichi as ti
from taichi.lang import impl
from taichi.lang.expr import Expr
from taichi.lang.simt.block import SharedArray


class _Held:
    """What ``[None]`` means for a value of an object."""

    _assign: Callable[[Any], None]

    def __setitem__(self, index: Any, value: Any) -> None:
        if index is not None:
            raise TypeError("assign all numbers at once: this is a copy")
        self._assign(value.to_list() if isinstance(value, ti.Matrix) else value)


class _HeldNumber(_Held):
    """A number; ``+self`` is the same, which belongs to no object."""

    def __getitem__(self, index: None) -> Any:
        return +self  # type: ignore[operator]

    def __reduce__(self) -> Any:
        return type(+self), (+self,)  # type: ignore[operator]


class HeldInt(_HeldNumber, int):
    """A whole number."""


class HeldFloat(_HeldNumber, float):
    """A real number."""


class HeldArray(_Held, np.ndarray):
    """A vector, as an array."""

    def __getitem__(self, index: Any) -> Any:
        return ti.Vector(self.tolist()) if index is None else np.ndarray.__getitem__(self, index)

    def __setitem__(self, index: Any, value: Any) -> None:
        if index is None:
            _Held.__setitem__(self, index, value)
        else:
            np.ndarray.__setitem__(self, index, value)
            if self._assign is not None:  # ``camera.eye[0] += 3``
                self._assign(np.array(self))

    def __array_finalize__(self, obj: Any) -> None:
        self._assign = None  # type: ignore[assignment]  # a copy, or a part of it, belongs to no object


class HeldExpr(Expr, SharedArray):
    """The value in a kernel. Taichi asks what is a ``SharedArray``, too, for its elements."""

    def __init__(self, value: Expr) -> None:
        self.ptr, self.dbg_info, self.ptr_type_checked = value.ptr, value.dbg_info, value.ptr_type_checked

    def subscript(self, *indices: Any) -> Expr:
        """The value itself for ``[None]``, otherwise one of its numbers."""
        return impl.subscript(None, Expr(self.ptr), *indices) if indices else self


def held(value: Any, assign: Callable[[Any], None]) -> Any:
    """A number or a vector of an object that can be read and assigned to with ``[None]``; any other value as it is.

    Args:
        value: in a kernel, an expression. assign: takes the new value.
    """
    if isinstance(value, Expr):
        return HeldExpr(value)
    if not isinstance(value, int | float | np.ndarray):
        return value
    if isinstance(value, np.ndarray):
        made: Any = np.array(value).view(HeldArray)
    else:
        made = HeldInt(value) if isinstance(value, int) else HeldFloat(value)
    made._assign = assign
    return made
