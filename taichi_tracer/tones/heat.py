"""Numbers as colours: black, red, yellow and white, as glowing iron."""

import math
from dataclasses import dataclass

import numpy as np

from taichi_tracer.formulas import vector_math as tm
from taichi_tracer.system.compile_time import compile_time
from taichi_tracer.tones.base import Tone

ROUND = 1.0, 2.0, 5.0, 10.0  # times a power of ten


@dataclass(frozen=True)
class Scale:
    """What the colours of a picture mean: black is 0.

    Attributes:
        high: what white is. text: the unit, and of what the numbers are.
    """

    high: float
    text: str


class Heat(Tone):
    """The mean of the three channels as a colour: black for 0, through red and yellow, to white for 1.

    It mixes the channels, and so it is no tone curve that can be chosen for pictures of light.
    """

    name, label = "heat", "Heat"

    @compile_time
    def curve(self, x):
        """The colour; x is an array whose last axis has the channels, or a vector."""
        if isinstance(x, np.ndarray):
            return np.clip(3 * x.mean(axis=-1, keepdims=True) - np.arange(3), 0, 1)
        return tm.clamp(tm.dot(x, tm.vec3(1)) - tm.vec3(0, 1, 2), 0, 1)


HEAT = Heat()


def heat(values: np.ndarray, largest: float) -> np.ndarray:
    """(h, w, 3) colours of (h, w) values: black for 0, and white for ``largest``."""
    share = np.clip(values / largest if largest > 0 else np.zeros_like(values), 0, 1)
    return HEAT.curve(np.asarray(share)[..., None])


def round_up(value: float) -> float:
    """The smallest of 1, 2 and 5 times a power of ten that is not less than a value; 1 for what is not above 0."""
    if not 0 < value < math.inf:
        return 1.0
    unit = 10.0 ** math.floor(math.log10(value))
    return next((k * unit for k in ROUND if k * unit >= value), ROUND[-1] * unit)
