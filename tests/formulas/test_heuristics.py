"""The heuristics of multiple importance sampling: the shares of two densities sum to one."""

import numpy as np
import pytest
import taichi as ti

from taichi_tracer.formulas.heuristics import heuristic
from taichi_tracer.system import runtime


@ti.kernel
def run(pairs: ti.types.ndarray(ndim=2), exponent: ti.template(), out: ti.types.ndarray(ndim=1)):
    for i in range(pairs.shape[0]):
        out[i] = heuristic(pairs[i, 0], pairs[i, 1], exponent)


@pytest.mark.parametrize("exponent", [1, 2])
def test_the_shares_of_both_techniques_sum_to_one(precision, exponent):
    """Veach & Guibas: w_a + w_b = 1; β = 2 squares the ratio; no density is no weight; huge ones do not overflow."""
    dtype = runtime.dtype()
    pairs = np.array([[1, 1], [1, 3], [3, 1], [2.5, 0], [0, 2.5], [1e30, 1e30], [1e-30, 1e30]], dtype)
    a, b = np.zeros(len(pairs), dtype), np.zeros(len(pairs), dtype)
    run(pairs, exponent, a)
    run(np.ascontiguousarray(pairs[:, ::-1]), exponent, b)
    np.testing.assert_allclose(a[:5], [1 / 2, 1 / (1 + 3**exponent), 1 - 1 / (1 + 3**exponent), 1, 0], rtol=1e-6)
    np.testing.assert_allclose(a + b, 1, rtol=1e-6)
