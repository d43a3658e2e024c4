"""Vectors in numpy's memory whose numbers are read and written one by one: elements of an ``arguments.Argument``.

Taichi reads a vector by one index only if each cell of its field is a multiple of its size.
"""

from typing import Any

import taichi as ti
from taichi.lang import impl, matrix
from taichi.lang.expr import Expr


class LooseComponents(Expr):
    """A vector or a matrix whose numbers are read one by one, because its cells are not multiples of its size."""

    def __init__(self, argument: Any, index: Any) -> None:
        own = argument.of.own
        self.argument, self.index = argument, index
        self.places = range(own[0]) if len(own) == 1 else range(own[0] * own[1])
        numbers = [self.component(k) for k in self.places]
        if len(own) == 2:
            made = Expr([numbers[r * own[1] : (r + 1) * own[1]] for r in range(own[0])])
        else:
            made = Expr(numbers)
        self.ptr, self.dbg_info, self.ptr_type_checked = made.ptr, made.dbg_info, made.ptr_type_checked

    def component(self, k: Any) -> Expr:
        """The k-th number, which can be assigned to."""
        return self.argument.at(self.index + k)

    def part(self, *indices: Any) -> Expr:
        """The number at an index of the vector or of the matrix."""
        if len(indices) == 1:
            return self.component(indices[0])
        return self.component(indices[0] * self.argument.of.own[1] + indices[1])

    def __getattr__(self, letters: str) -> Expr:
        """What letters name, such as ``xy`` or ``r``."""
        names = matrix.Matrix._swizzle_to_keygroup.get(letters)
        if names is None or len(self.argument.of.own) != 1:
            raise AttributeError(letters)
        places = [names.index(letter) for letter in letters]
        if max(places) >= len(self.places):
            known = tuple(names[: len(self.places)])
            raise ti.TaichiSyntaxError(f"vec{len(known)} only has attributes={known}, got=('{letters}',)")
        return self.component(places[0]) if len(places) == 1 else Some(self, places)

    def _assign(self, other: Any) -> "LooseComponents":
        values = Expr(other) if isinstance(other, (list, tuple)) else other
        own = self.argument.of.own
        if isinstance(values, Expr) and values.is_tensor() and tuple(values.get_shape()) != own:
            raise ti.TaichiTypeError(f"cannot assign a value of the shape {tuple(values.get_shape())} to one of {own}")
        for k in self.places:
            self.component(k)._assign(self.of_value(values, k))
        return self

    def of_value(self, values: Any, k: int) -> Any:
        """The k-th number of a value for this vector."""
        own = self.argument.of.own
        at = (k,) if len(own) == 1 else divmod(k, own[1])
        if isinstance(values, matrix.Matrix):
            return values.entries[k]
        if isinstance(values, Expr) and values.is_tensor():
            return impl.subscript(None, values, *at)
        return values

    def _augassign(self, other: Any, op: str) -> None:
        if isinstance(other, Expr) and not other.is_tensor():
            other = impl.expr_init(other)  # one of these numbers may be in it
        for k in self.places:
            self.component(k)._augassign(self.of_value(other, k), op)


class Some(Expr):
    """Some numbers of ``LooseComponents``, in any order."""

    def __init__(self, of: LooseComponents, places: list[int]) -> None:
        self.of, self.places = of, places
        made = Expr([of.component(k) for k in places])
        self.ptr, self.dbg_info, self.ptr_type_checked = made.ptr, made.dbg_info, made.ptr_type_checked

    def _assign(self, other: Any) -> "Some":
        for k, value in zip(self.places, self.values(other), strict=True):
            self.of.component(k)._assign(value)
        return self

    def _augassign(self, other: Any, op: str) -> None:
        for k, value in zip(self.places, self.values(other), strict=True):
            self.of.component(k)._augassign(value, op)

    def values(self, other: Any) -> list[Any]:
        """The numbers of a vector, read before one of these numbers is changed; or one number for each of them."""
        value = impl.expr_init(Expr(other))
        return [impl.subscript(None, value, k) if value.is_tensor() else value for k in range(len(self.places))]
