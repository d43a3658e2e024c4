"""A cache of objects that are slow to make, and large arrays whose memory is used again."""

import sys
from collections.abc import Callable, Hashable
from typing import Any

import numpy as np

LARGE = 8 << 20  # bytes; the memory of smaller arrays is used again by the C library
MOST_KEPT = 2  # arrays: in a loop, the next result is made while the variable still holds the former one
MOST_BYTES = 1 << 28  # of an array that is kept


class Lru:
    """The objects that were made for the keys that were asked for last.

    Args:
        most: how many are kept.
    """

    def __init__(self, most: int) -> None:
        self.most = most
        self._kept: dict[Hashable, Any] = {}

    def __contains__(self, key: Hashable) -> bool:
        return key in self._kept

    def get(self, key: Hashable, make: Callable[[], Any]) -> Any:
        """What was made for a key; it is made if nothing is kept for it."""
        found = self._kept.pop(key) if key in self._kept else make()
        self._kept[key] = found
        while len(self._kept) > self.most:
            del self._kept[next(iter(self._kept))]
        return found


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
