"""Independent numbers are hashes."""

import numpy as np
import pytest
import taichi as ti
from oracles import numbers
from sequences import INDEPENDENT

pytestmark = pytest.mark.usefixtures("f32")


@pytest.mark.parametrize("key", [(0, 0, 0, 0), (1, 2, 3, 4), (2**32 - 1, 77, 2**31, 5)])
def test_independent_numbers_are_the_hash_of_their_key(key):
    pixel, index, dimension, seed = key

    @ti.kernel
    def one(samples: ti.template(), s: ti.u32, p: ti.u32, i: ti.u32, d: ti.u32, out: ti.types.ndarray(ndim=1)):
        for _ in range(1):
            x, y = samples.get_2d(s, p, i, d)
            out[0], out[1] = x, y

    out = np.zeros(2, np.float32)
    one(INDEPENDENT, seed, pixel, index, dimension, out)
    a, b, _, _ = numbers.pcg4d(*key)
    assert out.tolist() == [np.float32((word >> 8) / 2**24) for word in (a, b)]
