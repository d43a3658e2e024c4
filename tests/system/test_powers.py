"""Powers of powers compile, and are what products are."""

import numpy as np
import taichi as ti
import taichi.math as tm


@ti.kernel
def powers(x: ti.types.ndarray(ndim=1), found: ti.types.ndarray(ndim=1)):
    for i in range(1):
        a = x[0]
        found[0] = (a**2) ** 2
        found[1] = a**5
        found[2] = (tm.vec3(a, 1, 2) ** 2).sum()
        found[3] = (a + 1) ** 3 * (a + 2) ** 2
        found[4] = (i + 3) ** 2
        found[5] = a**0.5
        found[6] = a**-2


def test_powers_are_products(precision):
    dtype = np.float64 if precision == "f64" else np.float32
    x, found = np.array([0.3], dtype), np.zeros(7, dtype)
    powers(x, found)
    expected = [0.3**4, 0.3**5, 0.09 + 5, 1.3**3 * 2.3**2, 9, 0.3**0.5, 0.3**-2]
    np.testing.assert_allclose(found, expected, rtol=8 * np.finfo(dtype).eps)
