"""A log that kernels write: the numbers that a function got and gave, in the order in which the functions ran.

While a kernel is being compiled, ``Log.note`` is called with names and values. It remembers the names in Python, and
compiles a few stores for the numbers. In memory, each entry begins with its own number, which leads to its names, and
its values follow. All numbers are stored in f64 if the backend has it, so that they are exact; whole numbers are stored
in the same way.
"""

from dataclasses import dataclass
from typing import Any

import numpy as np
import taichi as ti
from taichi.lang import expr, impl, struct

from taichi_tracer.system import memory, runtime
from taichi_tracer.system.compile_time import compile_time

MOST_KINDS = 64  # of steps that are limited; a picture has about ten of them
CAPACITY = 1 << 18  # numbers; a path of 64 bounces needs less
MOST_OF_A_KIND = 400  # entries of a kind that is limited: more of them say nothing new


@dataclass(frozen=True)
class Entry:
    """What one place in the code notes.

    Attributes:
        name: of the step. mark: "begin", "end" or "" for a step without steps within it.
        values: (name, how many numbers it has; 0 for a single one) of each value.
    """

    name: str
    mark: str
    values: tuple[tuple[str, int], ...]


@ti.data_oriented
class Log:
    """See the module. ``clear`` before the kernel, ``read`` after it."""

    def __init__(self) -> None:
        self.entries: list[Entry] = []
        self._limits: dict[str, int] = {}
        self._memory = memory.Memory()
        self.number_type = ti.f64 if runtime.has_f64() else ti.f32
        self.numbers = ti.field(self.number_type)
        # place: where the values of the entry that is being noted begin; −1 if they are not kept.
        self.used, self.is_on, self.is_full, self.place = (ti.field(ti.i32) for _ in range(4))
        self.counts = ti.field(ti.i32)
        self._memory.fields.dense(ti.i, CAPACITY).place(self.numbers)
        self._memory.fields.place(self.used, self.is_on, self.is_full, self.place)
        self._memory.fields.dense(ti.i, MOST_KINDS).place(self.counts)
        self._memory.allocate()

    def is_over(self) -> bool:
        """Whether its memory is gone, because Taichi was started again."""
        return self._memory.is_over()

    def clear(self) -> None:
        """Forget everything that was noted, and note nothing until ``is_on`` is 1."""
        self.used[None] = self.is_on[None] = self.is_full[None] = 0
        self.counts.fill(0)

    @compile_time
    def note(self, name: str, mark: str = "", is_limited: bool = False, **values: Any) -> None:
        """Note named values; kernels call it.

        Args:
            name, mark: as for ``Entry``. is_limited: whether only the first ``MOST_OF_A_KIND`` of this name are kept;
                all of them are counted.
            values: numbers, vectors, or structs, whose members become values of their own.
        """
        flat, names = [], []
        for key, value in values.items():
            flatten(key, value, names, flat)
        self.entries.append(Entry(name, mark, tuple(names)))
        limit = self._limits.setdefault(name, len(self._limits)) if is_limited else -1
        self._begin(len(self.entries) - 1, len(flat), limit)
        for k, number in enumerate(flat):
            self._store(k, number)

    @ti.func
    def _begin(self, number: ti.template(), count: ti.template(), limit: ti.template()):
        """Store the number of an entry, and make room for its values if they are kept."""
        self.place[None] = -1
        if self.is_on[None] != 0:
            is_kept = self.used[None] + count + 1 <= CAPACITY
            if ti.static(limit >= 0):
                self.counts[limit] = self.counts[limit] + 1
                is_kept = is_kept and self.counts[limit] <= MOST_OF_A_KIND
            if is_kept:
                self.numbers[self.used[None]] = number
                self.place[None] = self.used[None] + 1
                self.used[None] = self.used[None] + count + 1
            elif self.used[None] + count + 1 > CAPACITY:
                self.is_full[None] = 1

    @ti.func
    def _store(self, k: ti.template(), number):
        if self.place[None] >= 0:
            self.numbers[self.place[None] + k] = ti.cast(number, self.number_type)

    def read(self) -> tuple[list[tuple[Entry, dict[str, Any]]], dict[str, int]]:
        """Everything that was noted, in order, and how often each limited step ran."""
        numbers, used, found, at = self.numbers.to_numpy(), int(self.used[None]), [], 0
        while at < used:
            entry = self.entries[int(numbers[at])]
            at += 1
            values: dict[str, Any] = {}
            for name, size in entry.values:
                values[name] = numbers[at] if size == 0 else np.array(numbers[at : at + size])
                at += max(size, 1)
            found.append((entry, values))
        counts = self.counts.to_numpy()
        return found, {name: int(counts[i]) for name, i in self._limits.items()}


def flatten(name: str, value: Any, names: list[tuple[str, int]], flat: list[Any]) -> None:
    """Append the numbers of a value, at compile time, and the name and size of each of its vectors and numbers."""
    if value is None:
        return
    if isinstance(value, struct.Struct):
        for member in value.keys:
            flatten(member if not name else f"{name}.{member}", getattr(value, member), names, flat)
    elif isinstance(value, tuple | list):
        for k, part in enumerate(value):
            flatten(f"{name}[{k}]", part, names, flat)
    elif isinstance(value, expr.Expr) and value.is_tensor():
        shape = value.get_shape()
        if len(shape) == 1:
            names.append((name, shape[0]))
            flat += [impl.subscript(None, value, k) for k in range(shape[0])]
    elif isinstance(value, expr.Expr | int | float | bool | np.number):
        names.append((name, 0))
        flat.append(value)
