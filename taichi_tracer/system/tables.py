"""Arrays that are copied into fields, all of them when the memory of the fields is there."""

from dataclasses import dataclass
from typing import Any

import numpy as np

from taichi_tracer.system.memory import Memory


@dataclass(frozen=True)
class Table:
    """A field and the array for it.

    Attributes:
        field: of numbers, of vectors or of matrices.
        array: its numbers, in the shape that ``field.to_numpy()`` has; it may have fewer rows, which are the first.
    """

    field: Any
    array: np.ndarray

    def load(self, memory: Memory) -> None:
        """Copy the array into the field."""
        rows = slice(len(self.array)) if self.field.shape else ...
        if memory.has_arrays:
            memory.array(self.field)[rows] = self.array
        else:
            whole = np.zeros((*self.field.shape, *self.array.shape[len(self.field.shape) :]), self.array.dtype)
            whole[rows] = self.array
            memory.write(self.field, whole)


class Tables:
    """Fields and the arrays for them."""

    def __init__(self) -> None:
        self.tables: dict[int, Table] = {}  # by the id of the field

    def put(self, field: Any, array: np.ndarray) -> None:
        """Let ``load`` copy an array into a field, in place of an earlier array for this field."""
        self.tables[id(field)] = Table(field, array)

    def load(self, memory: Memory) -> None:
        """Copy all arrays into their fields.

        Args:
            memory: of the fields, which were allocated.
        """
        for table in self.tables.values():
            table.load(memory)
