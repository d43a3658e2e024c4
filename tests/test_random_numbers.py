"""The numbers of one sample: each call takes those of the next dimension."""

from types import SimpleNamespace

import numpy as np
import pytest
import taichi as ti
from sequences import NIEDERREITER, SAMPLERS, TERM, points

from taichi_tracer import sampler

pytestmark = pytest.mark.usefixtures("f32")


@ti.kernel
def _terms_of_a_sample(samples: ti.template(), out: ti.types.ndarray(ndim=1)):
    for _ in range(1):
        rng = samples.start(ti.u32(1), 0, 0, ti.u32(5))
        out[0] = rng.next_2d().x
        out[1] = rng.next_2d_of_term().x
        out[2] = rng.next_2d_of_term().x
        out[3] = rng.next_2d().x
        out[4] = rng.next_2d_of_term().x
        out[5] = rng.next_1d()


@pytest.mark.parametrize(
    ("samples", "dimensions"),
    [
        *((one, (0, 1, 2, 3, 4, 5)) for one in SAMPLERS[:2]),
        (NIEDERREITER, (0, 1 | TERM, 1 | 2 * TERM, 1, 2 | 3 * TERM, 2)),
    ],
    ids=lambda s: getattr(s, "name", ""),
)
def test_terms_share_a_dimension_where_the_sampler_says_so(samples, dimensions):
    out = np.zeros(6, np.float32)
    _terms_of_a_sample(samples, out)
    np.testing.assert_array_equal(out, [points(samples, 6, pixel=0, dimension=d)[5, 0] for d in dimensions])


@ti.kernel
def _numbers_of_a_sample(samples: ti.template(), x: int, y: int, out: ti.types.ndarray(ndim=1)):
    for _ in range(1):
        rng = samples.start(ti.u32(1), x, y, ti.u32(5))
        first = rng.next_2d()
        out[0], out[1], out[2] = first.x, first.y, rng.next_1d()
        rng.dimension += 1
        for k in range(3, 6):  # a loop of the kernel, which takes one dimension in each turn
            out[k] = rng.next_1d()
        out[6] = ti.cast(rng.dimension, float)


@pytest.mark.parametrize("samples", SAMPLERS, ids=lambda s: s.name)
def test_each_call_takes_the_numbers_of_the_next_dimension(samples):
    own = sampler.sampler_of(samples, SimpleNamespace(width=10, height=8))
    out = np.zeros(7, np.float32)
    _numbers_of_a_sample(own, 3, 7, out)
    at = [points(samples, 6, pixel=73, dimension=d)[5] for d in range(6)]
    np.testing.assert_array_equal(out[:3], [at[0][0], at[0][1], at[1][0]])
    np.testing.assert_array_equal(out[3:6], [at[3][0], at[4][0], at[5][0]])
    assert out[6] == 6
