"""Sums, products and extremes of vectors in kernels: as Taichi computes them, without functions that Python reads.

Taichi's ``dot`` is a function that calls another one, which calls a third one, and each of them is read again wherever
a kernel calls it. Here, Python writes the same products and additions, in the same order, without reading any function.
"""

import functools
import operator
from collections.abc import Callable
from typing import Any

from taichi.lang import impl, ops
from taichi.lang.expr import Expr
from taichi.lang.matrix import Vector
from taichi.types.utils import is_real


def is_vector(value: Any) -> bool:
    """Whether it is a vector of real numbers in a kernel."""
    if not isinstance(value, Expr) or not value.is_tensor():
        return False
    return len(value.get_shape()) == 1 and is_real(value.element_type())


def are_alike(x: Any, y: Any) -> bool:
    """Whether both are such vectors, and have the same length."""
    return is_vector(x) and is_vector(y) and x.get_shape() == y.get_shape()


def numbers_of(vector: Expr) -> list[Expr]:
    """The numbers of a vector, which is computed once."""
    builder, vector = impl.get_runtime().compiling_callable.ast_builder(), impl.expr_init(vector)
    return [impl.subscript(builder, vector, k) for k in range(vector.get_shape()[0])]


def total(vector: Expr) -> Any:
    """Its numbers, added one after the other."""
    return impl.expr_init(functools.reduce(operator.add, numbers_of(vector)))


def extreme(choose: Callable, vector: Expr) -> Any:
    """The largest or the smallest of its numbers: ``choose`` tells that of two."""
    return impl.expr_init(functools.reduce(lambda x, y: impl.expr_init(choose(x, y)), numbers_of(vector)))


def maximum(usual: Callable) -> Callable:
    """``matrix_ops.max``."""

    @functools.wraps(usual)
    def largest(mat: Any) -> Any:
        return extreme(ops.max_impl, mat) if impl.inside_kernel() and is_vector(mat) else usual(mat)

    return largest


def minimum(usual: Callable) -> Callable:
    """``matrix_ops.min``."""

    @functools.wraps(usual)
    def smallest(mat: Any) -> Any:
        return extreme(ops.min_impl, mat) if impl.inside_kernel() and is_vector(mat) else usual(mat)

    return smallest


def summing(usual: Callable) -> Callable:
    """``matrix_ops.sum``."""

    @functools.wraps(usual)
    def added(mat: Any) -> Any:
        return total(mat) if impl.inside_kernel() and is_vector(mat) else usual(mat)

    return added


def squaring(usual: Callable) -> Callable:
    """``matrix_ops.norm_sqr``."""

    @functools.wraps(usual)
    def squared(mat: Any) -> Any:
        return total(mat * mat) if impl.inside_kernel() and is_vector(mat) else usual(mat)

    return squared


def multiplying(usual: Callable) -> Callable:
    """``matrix_ops.dot`` and ``taichi.math.dot``."""

    @functools.wraps(usual)
    def multiplied(x: Any, y: Any) -> Any:
        return total(x * y) if impl.inside_kernel() and are_alike(x, y) else usual(x, y)

    return multiplied


def crossing(usual: Callable) -> Callable:
    """``matrix_ops.cross`` and ``taichi.math.cross``, of three numbers."""

    @functools.wraps(usual)
    def crossed(x: Any, y: Any) -> Any:
        if not (impl.inside_kernel() and are_alike(x, y) and x.get_shape()[0] == 3):
            return usual(x, y)
        (x0, x1, x2), (y0, y1, y2) = numbers_of(x), numbers_of(y)
        return impl.expr_init(Vector([x1 * y2 - x2 * y1, x2 * y0 - x0 * y2, x0 * y1 - x1 * y0]))

    return crossed
