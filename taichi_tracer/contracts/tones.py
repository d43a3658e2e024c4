"""What every tone curve must do: 0 stays 0, white becomes 1, nothing decreases, and kernels agree with Python."""

import numpy as np
import taichi as ti
import taichi.math as tm

from taichi_tracer.contracts.lab import Rows
from taichi_tracer.contracts.statistics import ABOVE_ZERO, check_range

STEPS = 4000
ROUNDING = 1e-12  # by which the last steps of a curve in float64 may go back
KERNEL_TOLERANCE = 4e-6  # of f32


def places(tone):
    """(n,) from 0 to white: even steps, and steps by the logarithm down to dark places."""
    steps = np.linspace(0.0, tone.white, STEPS)
    return np.unique(np.concatenate([steps, np.geomspace(1e-9 * tone.white, tone.white, STEPS)]))


def check_tone(tone):
    """0 stays 0, white becomes 1, nothing decreases, and kernels agree with Python."""
    check_range(f"{tone.name}: white", tone.white, ABOVE_ZERO)
    x = places(tone)
    y = np.asarray(tone.curve(x.copy()), np.float64)
    assert y.shape == x.shape, f"{tone.name}: {x.shape} values became {y.shape}"
    check_range(f"{tone.name}: a value", y)
    assert y[0] == 0, f"{tone.name}: 0 becomes {y[0]}"
    assert abs(y[-1] - 1) < 1e-6, f"{tone.name}: white, {tone.white:g}, becomes {y[-1]}"
    assert (np.diff(y) >= -ROUNDING).all(), f"{tone.name}: it decreases at {x[np.diff(y).argmin()]:.3g}"

    @ti.func
    def of_kernels(value):
        return tone.curve(tm.vec3(value, 0.0, tone.white))

    out = Rows(of_kernels, [1], [3])(x)
    off = np.abs(out[:, 0] - y).max()
    assert off < KERNEL_TOLERANCE, f"{tone.name}: a kernel and Python differ by {off:.2g}"
    assert (out[:, 1] == 0).all(), f"{tone.name}: the channels are mixed"
    assert np.ptp(out[:, 2]) == 0, f"{tone.name}: the channels are mixed"
