"""Products are rounded before they are subtracted, so that a b − c d is exactly −(c d − a b)."""

import numpy as np
import taichi as ti

from taichi_tracer.formulas.roundings import _hidden as hidden
from taichi_tracer.formulas.roundings import rounded
from taichi_tracer.system import runtime


@ti.kernel
def _differences(rows: ti.types.ndarray(ndim=2), out: ti.types.ndarray(ndim=1)):
    for i in range(rows.shape[0]):
        out[i] = rounded(rows[i, 0] * rows[i, 1]) - rounded(rows[i, 2] * rows[i, 3])


@ti.kernel
def _hide(numbers: ti.types.ndarray(ndim=1), integer: ti.template()):
    for i in range(numbers.shape[0]):
        numbers[i] = hidden(numbers[i], integer)


def test_each_product_is_rounded(precision, rng):
    """On a GPU, too, where a b − c d alone is rounded once (TAICHI_TRACER_TESTS_ARCH=cuda)."""
    dtype = runtime.dtype()
    a, b, c = (rng.normal(size=10_000).astype(dtype) for _ in range(3))
    d = (a.astype(np.float64) * b / c).astype(dtype)  # almost nothing is left of the difference
    found = np.zeros(len(a), dtype)
    _differences(np.stack([a, b, c, d], axis=1), found)
    np.testing.assert_array_equal(found, a * b - c * d)
    assert (found != 0).mean() > 0.2


def test_the_way_through_the_bits_changes_nothing(precision, rng):
    """What a GPU does to each product: infinities, zeros with their sign, and NaN stay what they are."""
    numbers = np.concatenate(
        [rng.normal(size=10_000) * 10.0 ** rng.integers(-30, 30, 10_000), [0, -0.0, np.inf, -np.inf]]
    )
    numbers = np.append(numbers, np.nan).astype(runtime.dtype())
    found = numbers.copy()
    _hide(found, ti.i64 if precision == "f64" else ti.i32)
    np.testing.assert_array_equal(found, numbers)
    np.testing.assert_array_equal(np.signbit(found[:-1]), np.signbit(numbers[:-1]))
