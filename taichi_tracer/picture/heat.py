"""Numbers as colours: black, red, yellow and white, as glowing iron."""

import math

import numpy as np

ROUND = 1.0, 2.0, 5.0, 10.0  # times a power of ten


def heat(values: np.ndarray, largest: float) -> np.ndarray:
    """(h, w, 3) colours of (h, w) values: black for 0, through red and yellow, to white for ``largest``."""
    share = np.clip(values / largest if largest > 0 else np.zeros_like(values), 0, 1)
    return np.stack([np.clip(3 * share - k, 0, 1) for k in range(3)], axis=-1)


def round_up(value: float) -> float:
    """The smallest of 1, 2 and 5 times a power of ten that is not less than a value; 1 for what is not above 0."""
    if not 0 < value < math.inf:
        return 1.0
    unit = 10.0 ** math.floor(math.log10(value))
    return next((k * unit for k in ROUND if k * unit >= value), ROUND[-1] * unit)
