"""Arrays that are copied into fields, many of them by one kernel.

Each kernel costs time in every process: Python reads it, and Taichi translates or loads it. For small arrays, this
takes much longer than the copying. A loop that runs in parallel costs most, therefore these loops do not.
"""

from dataclasses import dataclass
from typing import Any

import numpy as np
import taichi as ti

from taichi_tracer.system import runtime

# Numbers from which on it saves time to copy them in parallel: a parallel loop takes 10 ms longer to translate or load.
MANY_NUMBERS = 1 << 20


@dataclass(frozen=True)
class Table:
    """A field and the array for it.

    Attributes:
        field: a scalar field with one or two indices, or a field of vectors with one index; of the running precision
            or of i32.
        array: (rows, width) or (rows,) numbers; they begin in the first row of the field.
        number: of the table among all.
    """

    field: Any
    array: np.ndarray
    number: int

    @property
    def is_vector(self) -> bool:
        """Whether a row of the field is a vector."""
        return hasattr(self.field, "n")

    @property
    def is_whole(self) -> bool:
        """Whether the numbers are integers."""
        return self.field.dtype == ti.i32

    @property
    def width(self) -> int:
        """The numbers of a row."""
        return self.array.shape[1] if self.array.ndim == 2 else 1


@ti.data_oriented
class Tables:
    """Fields and the arrays for them. A kernel calls ``fill`` with the ``arguments``; ``load`` is such a kernel."""

    def __init__(self) -> None:
        self.tables: list[Table] = []

    def put(self, field: Any, array: np.ndarray) -> None:
        """Let ``fill`` copy an array into a field."""
        self.tables.append(Table(field, array, len(self.tables)))

    def arguments(self) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """All numbers, all integers, and for each table where its own begin and how many rows it has."""
        places: list[int] = []
        parts: dict[bool, list[np.ndarray]] = {False: [np.zeros(1, runtime.dtype())], True: [np.zeros(1, np.int32)]}
        sizes = {False: 1, True: 1}
        for table in self.tables:
            places += [sizes[table.is_whole], len(table.array), table.width]
            parts[table.is_whole].append(table.array.reshape(-1))
            sizes[table.is_whole] += table.array.size
        numbers = np.concatenate(parts[False], dtype=runtime.dtype(), casting="same_kind")
        integers = np.concatenate(parts[True], dtype=np.int32, casting="same_kind")
        return numbers, integers, np.array([*places, 0], np.int32)

    def load(self) -> None:
        """Copy all arrays into their fields."""
        self._load(*self.arguments())

    @ti.kernel
    def _load(
        self,
        numbers: ti.types.ndarray(ndim=1),
        integers: ti.types.ndarray(dtype=ti.i32, ndim=1),
        places: ti.types.ndarray(dtype=ti.i32, ndim=1),
    ):
        ti.loop_config(serialize=True)
        for _ in range(1):
            self.fill(numbers, integers, places)

    @ti.func
    def fill(self, numbers: ti.template(), integers: ti.template(), places: ti.template()):
        """Copy all arrays into their fields, in a kernel that has the ``arguments``.

        The caller is in a loop that is not parallel. All loops are inside this one, so that Taichi translates them as
        one piece.
        """
        for table in ti.static(self.tables):
            begin = 3 * table.number
            first, rows, width = places[begin], places[begin + 1], places[begin + 2]
            source = ti.static(integers if table.is_whole else numbers)
            for i in range(rows):
                if ti.static(table.is_vector):
                    for k in ti.static(range(table.width)):
                        table.field[i][k] = source[first + i * width + k]
                elif ti.static(table.array.ndim == 2):
                    for k in range(width):
                        table.field[i, k] = source[first + i * width + k]
                else:
                    table.field[i] = source[first + i]
