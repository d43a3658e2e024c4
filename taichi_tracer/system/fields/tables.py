"""Arrays that are copied into fields: on a CPU directly, elsewhere all of them by one kernel.

Each kernel costs time in every process: Python reads it, and Taichi translates or loads it. For small arrays, this
takes much longer than the copying.
"""

from dataclasses import dataclass
from typing import Any

import numpy as np
import taichi as ti

from taichi_tracer.system import runtime
from taichi_tracer.system.fields.memory import Memory

# Cells from which on a kernel copies them in parallel: a parallel loop takes 10 ms longer to translate or load.
MANY_CELLS = 1 << 18
MANY_CELLS_OF_A_GPU = 1 << 12  # one of its threads is slow; and Vulkan in software ends every loop after 65,535 turns


@dataclass(frozen=True)
class Table:
    """A field and the array for it.

    Attributes:
        field: of numbers or of vectors, with at most two indices; or one matrix without an index. Of the running
            precision, of f64, or of integers.
        array: its numbers, in the shape that ``field.to_numpy()`` has; it may have fewer rows, which are the first.
        number: of the table among all.
    """

    field: Any
    array: np.ndarray
    number: int

    @property
    def components(self) -> int:
        """How many numbers a cell of the field has."""
        return int(np.prod(self.array.shape[len(self.field.shape) :]))

    @property
    def columns(self) -> int:
        """The columns of the m in an n × m matrix, which is a cell of the field; 1 for other cells."""
        return getattr(self.field, "m", 1)

    @property
    def is_whole(self) -> bool:
        """Whether the numbers are integers."""
        return np.dtype(self.array.dtype).kind in "iub"

    @property
    def is_wide(self) -> bool:
        """Whether the numbers are in f64 and kernels run in f32: then the bits of a number come as two integers."""
        return self.field.dtype == ti.f64 and runtime.dtype() is np.float32

    @property
    def cells(self) -> int:
        """How many cells of the field are written."""
        return int(np.prod(self.array.shape[: len(self.field.shape)]))

    @property
    def is_large(self) -> bool:
        """Whether a kernel copies the cells in parallel."""
        return self.cells >= (MANY_CELLS if runtime.ensure().arch == "cpu" else MANY_CELLS_OF_A_GPU)


@ti.data_oriented
class Tables:
    """Fields and the arrays for them."""

    def __init__(self) -> None:
        self.tables: dict[int, Table] = {}  # id of the field → its table

    def put(self, field: Any, array: np.ndarray) -> None:
        """Let ``load`` copy an array into a field, in place of an earlier array of the same shape for this field."""
        number = self.tables[id(field)].number if id(field) in self.tables else len(self.tables)
        self.tables[id(field)] = Table(field, array, number)

    def load(self, memory: Memory) -> None:
        """Copy all arrays into their fields.

        Args:
            memory: of the fields, which were allocated.
        """
        if memory.has_arrays:
            for table in self.tables.values():
                rows = slice(len(table.array)) if table.field.shape else ...
                memory.array(table.field)[rows] = table.array
        else:
            self.load_by_kernel()

    def load_by_kernel(self) -> None:
        """The same, where kernels have memory of their own."""
        self._load(*self.arguments())

    def arguments(self) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """All numbers, all integers, and for each table where its own begin and how many cells it has."""
        places: list[int] = []
        parts: dict[bool, list[np.ndarray]] = {False: [np.zeros(1, runtime.dtype())], True: [np.zeros(1, np.int32)]}
        sizes = {False: 1, True: 1}
        for table in self.tables.values():
            array, is_whole = table.array.reshape(-1), table.is_whole or table.is_wide
            if table.is_wide:
                array = array.astype("<f8").view("<i4")
            places += [sizes[is_whole], table.cells]
            parts[is_whole].append(array)
            sizes[is_whole] += array.size
        numbers = np.concatenate(parts[False], dtype=runtime.dtype(), casting="same_kind")
        integers = np.concatenate(parts[True], dtype=np.int32, casting="unsafe")
        return numbers, integers, np.array([*places, 0], np.int32)

    @ti.kernel
    def _load(
        self,
        numbers: ti.types.ndarray(ndim=1),
        integers: ti.types.ndarray(dtype=ti.i32, ndim=1),
        places: ti.types.ndarray(dtype=ti.i32, ndim=1),
    ):
        ti.loop_config(serialize=True)
        for _ in range(1):  # all small tables are inside this loop, so that Taichi translates them as one piece
            for table in ti.static([table for table in self.tables.values() if not table.is_large]):
                for i in range(places[2 * table.number + 1]):
                    self.put_cell(table, numbers, integers, places[2 * table.number], i)
        for table in ti.static([table for table in self.tables.values() if table.is_large]):
            for i in range(places[2 * table.number + 1]):
                self.put_cell(table, numbers, integers, places[2 * table.number], i)

    @ti.func
    def put_cell(self, table: ti.template(), numbers: ti.template(), integers: ti.template(), first, i):
        """Write the i-th cell of a field, whose numbers begin at ``first``."""
        source = ti.static(integers if table.is_whole or table.is_wide else numbers)
        shape = ti.static(table.field.shape)
        for k in ti.static(range(table.components)):
            value = number_at(table, source, first, i * table.components + k)
            if ti.static(len(shape) == 0):
                if ti.static(table.columns > 1):
                    table.field[None][k // table.columns, k % table.columns] = value
                elif ti.static(hasattr(table.field, "n")):
                    table.field[None][k] = value
                else:
                    table.field[None] = value
            elif ti.static(len(shape) == 1):
                if ti.static(hasattr(table.field, "n")):
                    table.field[i][k] = value
                else:
                    table.field[i] = value
            else:
                row, column = i // shape[1], i % shape[1]
                if ti.static(hasattr(table.field, "n")):
                    table.field[row, column][k] = value
                else:
                    table.field[row, column] = value


def filled(*arrays: np.ndarray, indices: int = 1) -> tuple[Memory, list[Any]]:
    """The memory of new fields with these numbers, and the fields: of i32, or of the running precision.

    Args:
        arrays: one for each field; those of equal length stand side by side in memory.
        indices: how many of their axes, 1 or 2, fields have as indices; a further axis has the components of vectors.
    """
    memory, tables, blocks, made = Memory(), Tables(), {}, []
    for array in arrays:
        dtype, kind = (np.int32, ti.i32) if np.issubdtype(array.dtype, np.integer) else (runtime.dtype(), float)
        made.append(ti.field(kind) if array.ndim == indices else ti.Vector.field(array.shape[-1], kind))
        counts = array.shape[:indices]
        if counts not in blocks:
            blocks[counts] = memory.fields.dense(ti.i if indices == 1 else ti.ij, counts)
        blocks[counts].place(made[-1])
        tables.put(made[-1], array.astype(dtype, copy=False))
    memory.allocate()
    tables.load(memory)
    return memory, made


@ti.func
def number_at(table: ti.template(), source: ti.template(), first, i):
    """The i-th number of a table, whose numbers begin at ``first``."""
    if ti.static(table.is_wide):
        low, high = ti.cast(source[first + 2 * i], ti.u32), ti.cast(source[first + 2 * i + 1], ti.u32)
        return ti.bit_cast(ti.cast(low, ti.u64) | (ti.cast(high, ti.u64) << 32), ti.f64)
    else:  # noqa: RET505 (Taichi compiles one of the two)
        return ti.cast(source[first + i], table.field.dtype)
