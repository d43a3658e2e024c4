"""Sums, dot and cross products and lengths of vectors, in kernels, without reading how Taichi has written them.

Taichi 1.7 has them as functions in its own language. Wherever a kernel has a dot product, Python reads the source of
three functions, in a millisecond and more: together a sixth of the time in which kernels are read. Here, the same
operations are put down directly, in the same order, so that the results have the same bits.
"""

import functools
from collections.abc import Callable
from typing import Any

from taichi.lang import impl, matrix, ops
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


def is_vector(value: object) -> bool:
    """Whether a value is a vector of a kernel."""
    return isinstance(value, Expr) and value.is_tensor() and len(value.get_shape()) == 1


def directly(usual: Callable) -> Callable:
    """The function of ``DIRECT`` for vectors in kernels; ``usual`` for everything else, and for what is wrong."""
    direct = DIRECT[usual.__name__]
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
