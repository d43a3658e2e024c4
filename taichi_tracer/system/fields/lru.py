"""A cache of objects that are slow to make."""

from collections.abc import Callable, Hashable
from typing import Any


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
