"""Pictures as arrays: pixels are [x, y] with y up on a film, and [row, column] with the top row first in files."""

import numpy as np


def upright(array: np.ndarray, dtype: type = np.float32) -> np.ndarray:
    """[x, y, ...], y up, as an image: contiguous [row, column, ...] with the top row first."""
    return np.ascontiguousarray(array.swapaxes(0, 1)[::-1], dtype)
