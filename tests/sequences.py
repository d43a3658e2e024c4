"""The points of samplers, for tests."""

import numpy as np
import taichi as ti

from taichi_tracer.formulas.random_numbers import TERM_BIT
from taichi_tracer.samplers.independent import IndependentSampler
from taichi_tracer.samplers.niederreiter import NiederreiterSampler
from taichi_tracer.samplers.sobol import SobolSampler
from taichi_tracer.system import runtime

SOBOL, INDEPENDENT, NIEDERREITER = SAMPLERS = [SobolSampler(), IndependentSampler(), NiederreiterSampler()]
TERM = 1 << TERM_BIT  # the first pair of ``next_2d_of_term``, as a part of the dimension


@ti.kernel
def _points(samples: ti.template(), seed: ti.u32, pixel: ti.u32, dimension: ti.u32, out: ti.types.ndarray(ndim=2)):
    for i in range(out.shape[0]):
        x, y = samples.get_2d(seed, pixel, ti.cast(i, ti.u32), dimension)
        out[i, 0], out[i, 1] = x, y


def points(samples, count, seed=1, pixel=2, dimension=0):
    """(count, 2) the pairs of the first samples of a pixel, for one use."""
    out = np.zeros((count, 2), runtime.dtype())
    _points(samples, seed, pixel, dimension, out)
    return out
