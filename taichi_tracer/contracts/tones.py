"""What every tone curve must do: 0 stays 0, white becomes 1, nothing decreases, and kernels agree with Python."""

import numpy as np
import taichi as ti
import taichi.math as tm

STEPS = 4000
ROUNDING = 1e-12  # by which the last steps of a curve in float64 may go back
KERNEL_TOLERANCE = 4e-6  # of f32


@ti.data_oriented
class Bench:
    """A curve, to be asked by kernels, as the window does."""

    def __init__(self, tone):
        self.tone = tone

    @ti.kernel
    def ask(self, tone: ti.template(), x: ti.types.ndarray(ndim=1), out: ti.types.ndarray(ndim=2)):
        """Write the curve of each number into the first channel, of 0 and of white into the others."""
        for i in range(x.shape[0]):
            value = tone.curve(tm.vec3(x[i], 0.0, x[x.shape[0] - 1]))
            for k in ti.static(range(3)):
                out[i, k] = value[k]


def places(tone):
    """(n,) from 0 to white: even steps, and steps by the logarithm down to dark places."""
    steps = np.linspace(0.0, tone.white, STEPS)
    return np.unique(np.concatenate([steps, np.geomspace(1e-9 * tone.white, tone.white, STEPS)]))


def check_tone(tone):
    """0 stays 0, white becomes 1, nothing decreases, and kernels agree with Python."""
    assert np.isfinite(tone.white), f"{tone.name}: white is {tone.white}"
    assert tone.white > 0, f"{tone.name}: white is {tone.white}"
    x = places(tone)
    y = np.asarray(tone.curve(x.copy()), np.float64)
    assert y.shape == x.shape, f"{tone.name}: {x.shape} values became {y.shape}"
    assert np.isfinite(y).all(), f"{tone.name}: values are not finite"
    assert y[0] == 0, f"{tone.name}: 0 becomes {y[0]}"
    assert abs(y[-1] - 1) < 1e-6, f"{tone.name}: white, {tone.white:g}, becomes {y[-1]}"
    assert (np.diff(y) >= -ROUNDING).all(), f"{tone.name}: it decreases at {x[np.diff(y).argmin()]:.3g}"
    out = np.zeros((len(x), 3), np.float32)
    Bench(tone).ask(tone, x.astype(np.float32), out)
    off = np.abs(out[:, 0] - y).max()
    assert off < KERNEL_TOLERANCE, f"{tone.name}: a kernel and Python differ by {off:.2g}"
    assert (out[:, 1] == 0).all(), f"{tone.name}: the channels are mixed"
    assert np.ptp(out[:, 2]) == 0, f"{tone.name}: the channels are mixed"
