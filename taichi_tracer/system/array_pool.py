"""Large arrays whose memory is used again, as soon as nobody refers to the former array any more.

The system hands out memory in pages that it fills with zeros first. For a large array, numpy gives the memory back when
the array is deleted, and so the next one pays for this again.
"""

import sys

import numpy as np

LARGE = 8 << 20  # bytes; the memory of smaller arrays is used again by the C library
MOST_KEPT = 2  # arrays: in a loop, the next result is made while the variable still holds the former one
MOST_BYTES = 1 << 28  # of an array that is kept


class ArrayPool:
    """Arrays of bytes without values. The memory of the last large ones is kept."""

    def __init__(self) -> None:
        self._kept: list[np.ndarray] = []

    def empty(self, size: int) -> np.ndarray:
        """(size,) uint8. No other array that somebody can still refer to has the same memory."""
        if not LARGE <= size <= MOST_BYTES:
            return np.empty(size, np.uint8)
        for k in range(len(self._kept)):
            if size <= self._kept[k].size <= 2 * size and _references(self._kept, k) == _ALONE:
                return self._kept[k][:size]  # a view, like all parts of it, refers to the whole array
        self._kept = [*self._kept[1 - MOST_KEPT :], np.empty(size, np.uint8)]
        return self._kept[-1][:]


def _references(arrays: list[np.ndarray], k: int) -> int:
    """The number of references to a member of a list, plus those of this very call."""
    return sys.getrefcount(arrays[k])


_ALONE = _references([np.empty(0, np.uint8)], 0)  # of an array to which only a list refers
