"""Sums, dot and cross products and lengths of vectors, in kernels, without reading how Taichi has written them.

Taichi 1.7 has them as functions in its own language. Wherever a kernel has a dot product, Python reads the source of
three functions, in a millisecond and more: together a sixth of the time in which kernels are read. Here, the same
operations are put down directly, in the same order, so that the results have the same bits.
"""

import functools
from collections.abc import Callable
from typing import Any

from taichi import math
from taichi.lang import impl, matrix, matrix_ops, ops
from taichi.lang.expr import Expr


def components(vector: Expr) -> list:
    """The components of a vector, which is computed once."""
    builder = impl.get_runtime().compiling_callable.ast_builder()
    kept = impl.expr_init(vector)
    return [impl.subscript(builder, kept, k) for k in range(kept.get_shape()[0])]


def total(vector: Expr) -> Expr:
    """The sum of the components, from the first to the last."""
    return impl.expr_init(functools.reduce(ops.add, components(vector)))


def norm_sqr(vector: Expr) -> Expr:
    """|v|²."""
    kept = impl.expr_init(vector)
    return total(kept * kept)


def norm(vector: Expr, eps: Any = 0.0) -> Expr:
    """√(|v|² + ε)."""
    return impl.expr_init(ops.sqrt(norm_sqr(vector) + eps))


def normalized(vector: Expr, eps: Any = 0.0) -> Expr:
    """v / (|v| + ε), as the product with the inverse."""
    kept = impl.expr_init(vector)
    inverse = impl.expr_init(1 / (norm(kept) + eps))
    return impl.expr_init(inverse * kept)


def dot(x: Expr, y: Expr) -> Expr:
    """x · y."""
    return total(x * y)


def cross(x: Expr, y: Expr) -> Expr:
    """x × y of vectors in space."""
    (a, b, c), (d, e, f) = components(x), components(y)
    return impl.expr_init(matrix.make_matrix([b * f - c * e, c * d - a * f, a * e - b * d]))


DIRECT: dict[str, Callable] = {
    "sum": total,
    "norm_sqr": norm_sqr,
    "norm": norm,
    "normalized": normalized,
    "dot": dot,
    "cross": cross,
}
OF_MATH = ("dot", "cross")  # functions that ``taichi.math`` has under the same name


def is_vector(value: object) -> bool:
    """Whether a value is a vector of a kernel."""
    return isinstance(value, Expr) and value.is_tensor() and len(value.get_shape()) == 1


def directly(direct: Callable, usual: Callable) -> Callable:
    """``direct`` for vectors in kernels; ``usual`` for everything else, and for everything that is wrong."""
    number = 2 if direct in (dot, cross) else 1

    @functools.wraps(usual)
    def chosen(*words, **options):
        vectors = words[:number]
        is_direct = impl.inside_kernel() and len(vectors) == number and all(map(is_vector, vectors))
        if is_direct and number == 2:
            sizes = {vector.get_shape()[0] for vector in vectors}
            is_direct = sizes == {3} if direct is cross else len(sizes) == 1
        return direct(*words, **options) if is_direct else usual(*words, **options)

    return chosen


@functools.lru_cache(maxsize=1)
def write_directly() -> None:
    """Let kernels have these functions directly, from now on."""
    for name, direct in DIRECT.items():
        setattr(matrix_ops, name, directly(direct, getattr(matrix_ops, name)))
    for name in OF_MATH:
        setattr(math, name, directly(DIRECT[name], getattr(math, name)))
