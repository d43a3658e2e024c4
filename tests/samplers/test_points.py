"""The points of every sequence: uniform, a pixel's own, and the same for several pixels at once."""

import numpy as np
import pytest
import taichi as ti
from scipy import stats
from sequences import SAMPLERS, points

pytestmark = pytest.mark.usefixtures("f32")


@pytest.mark.parametrize("samples", SAMPLERS, ids=lambda s: s.name)
def test_numbers_are_uniform_below_one_and_their_own(samples):
    p = points(samples, 1 << 16).astype(np.float64)
    assert p.min() >= 0
    assert p.max() < 1
    for k in range(2):
        assert stats.kstest(p[:, k], "uniform").pvalue > 1e-4
    assert abs(np.corrcoef(p.T)[0, 1]) < 4 / 256
    for other in ({"seed": 2}, {"pixel": 3}, {"dimension": 1}):
        q = points(samples, 1 << 12, **other).astype(np.float64)
        assert abs(np.corrcoef(p[: 1 << 12, 0], q[:, 0])[0, 1]) < 4 / 64, other
    np.testing.assert_array_equal(points(samples, 1 << 12), p[: 1 << 12])


@pytest.mark.parametrize("samples", SAMPLERS, ids=lambda s: s.name)
def test_vectors_of_keys_give_the_numbers_of_single_keys(samples):
    """What the fast forms take: the numbers of several pixels at once."""

    @ti.kernel
    def four(out: ti.types.ndarray(ndim=2)):
        for i in range(out.shape[0]):
            zero = ti.Vector([ti.u32(0)] * 4)
            pixels = ti.Vector([ti.cast(k, ti.u32) for k in range(4)])
            x, y = samples.point(ti.u32(1) + zero, pixels, ti.cast(i, ti.u32) + zero, ti.u32(3) + zero)
            for k in ti.static(range(4)):
                out[i, 2 * k], out[i, 2 * k + 1] = x[k], y[k]

    out = np.zeros((64, 8), np.float32)
    four(out)
    expected = [points(samples, 64, pixel=pixel, dimension=3) for pixel in range(4)]
    np.testing.assert_array_equal(out, np.concatenate(expected, axis=1))
