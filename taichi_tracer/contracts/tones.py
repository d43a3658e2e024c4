"""What every tone curve must do: 0 stays 0, white becomes 1, and nothing decreases."""

import numpy as np
import taichi as ti

from taichi_tracer.contracts.lab import Rows
from taichi_tracer.contracts.statistics import ABOVE_ZERO, check_near, check_range
from taichi_tracer.formulas import vector_math as tm

STEPS = 4000
ROUNDING = 1e-12  # by which the last steps of a curve in float64 may go back
KERNEL_TOLERANCE = 4e-6  # of f32


def check_tone(tone):
    """0 stays 0, white becomes 1, nothing decreases, and kernels agree with Python."""
    check_range(f"{tone.name}: white", tone.white, ABOVE_ZERO)
    even, dark = np.linspace(0.0, tone.white, STEPS), np.geomspace(1e-9 * tone.white, tone.white, STEPS)
    x = np.unique(np.concatenate([even, dark]))
    y = np.asarray(tone.curve(x.copy()), np.float64)
    check_range(f"{tone.name}: a value", y)
    assert y[0] == 0, f"{tone.name}: 0 becomes {y[0]}"
    check_near(f"{tone.name}: white, {tone.white:g}, becomes {y[-1]:g}", y[-1], 1, 1e-6)
    assert (np.diff(y) >= -ROUNDING).all(), f"{tone.name}: it decreases at {x[np.diff(y).argmin()]:.3g}"

    @ti.func
    def of_kernels(value):
        return tone.curve(tm.vec3(value, 0.0, tone.white))

    expected = np.column_stack([y, np.zeros_like(y), np.ones_like(y)])
    what = f"{tone.name}: a kernel and Python differ, or the channels are mixed"
    check_near(what, Rows(of_kernels, [1], [3])(x), expected, KERNEL_TOLERANCE)
