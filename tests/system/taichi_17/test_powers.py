"""A power of a power does not end the process, and every power is that of Taichi alone."""

import numpy as np
import pytest
import taichi as ti
import taichi.math as tm
from support import as_taichi_is, needs_patch, start
from taichi.lang import ops

ARRAY = ti.types.ndarray(ndim=1)


@ti.kernel
def of_powers(x: ARRAY, found: ARRAY):
    a, n = x[0], ti.cast(x[1], int)
    found[0] = (a**2) ** 2
    found[1] = (a**2) ** -2
    found[2] = ((tm.vec3(a, 1, 2) ** 2) ** 2).sum()
    found[3] = (a**n) ** n
    found[4] = (n**2) ** 3


def test_a_power_of_a_power(precision):
    needs_patch("powers")
    dtype = np.float64 if precision == "f64" else np.float32
    x, found = np.array([0.3, 3], dtype), np.zeros(5, dtype)
    of_powers(x, found)
    np.testing.assert_allclose(found, [0.3**4, 0.3**-4, 0.3**4 + 17, 0.3**9, 729], rtol=8 * np.finfo(dtype).eps)


@ti.func
def fifth(x):
    """As a student writes it."""
    return x**5


def of_a_student(x: ARRAY, found: ti.types.ndarray(ndim=2)):
    for i in range(x.shape[0]):
        for n in ti.static(range(2, 9)):
            found[i, n] = x[i] ** n
        found[i, 9] = fifth(x[i]) + x[i] ** -3
        found[i, 10] = ti.cast(i, ti.u8) ** 2 + (i - 20) ** 3
        found[i, 11] = abs(x[i]) ** 0.4
        found[i, 12] = (tm.vec2(x[i], 2.0) ** 3).sum()


@pytest.mark.parametrize("kind", ["f32", "f64"])
def test_the_powers_of_a_student_are_taichis_own(kind, monkeypatch):
    """The same operation, and the same bits of the result."""
    start(kind)
    dtype, asked, power = {"f32": np.float32, "f64": np.float64}[kind], [], ops.pow
    x = np.random.default_rng(3).normal(size=500).astype(dtype)
    monkeypatch.setattr(ops, "pow", lambda base, exponent: asked.append(exponent) or power(base, exponent))
    here, alone = np.zeros((500, 13), dtype), np.zeros((500, 13), dtype)
    ti.kernel(of_a_student)(x, here)
    assert asked == [2, 3, 4, 5, 6, 7, 8, 5, -3, 2, 3, 0.4, 3]
    with as_taichi_is():
        ti.kernel(of_a_student)(x, alone)
    np.testing.assert_array_equal(here, alone)
