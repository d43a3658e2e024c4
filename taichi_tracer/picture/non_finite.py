"""Samples that are not finite: counted and located, so that the user can look at them, and never added (C-20)."""

import numpy as np
import taichi as ti

from taichi_tracer.system.memory import Memory

MAX_LOCATED = 16  # all non-finite samples are counted; this number of places is enough to find the cause


@ti.data_oriented
class NonFiniteSamples:
    """How many samples of a film were not finite, and where the first of them were.

    Args:
        memory: of the film, in which the fields are placed.
    """

    def __init__(self, memory: Memory) -> None:
        self.memory = memory
        self.number, self.at = ti.field(ti.i32), ti.Vector.field(3, ti.i32)
        memory.fields.place(self.number)
        memory.fields.dense(ti.i, MAX_LOCATED).place(self.at)

    @ti.func
    def locate(self, x, y, sample):
        """Count a sample that is not finite, and keep where the first of them were."""
        place = ti.atomic_add(self.number[None], 1)
        if place < MAX_LOCATED:
            self.at[place] = ti.Vector([x, y, ti.cast(sample, ti.i32)])

    def clear(self) -> None:
        """Forget all of them."""
        self.memory.write(self.number, 0)

    def count(self) -> int:
        """How many there were."""
        return int(self.memory.read(self.number))

    def places(self) -> list[tuple[int, int, int]]:
        """(x, y, sample index) of the first ``MAX_LOCATED`` of them."""
        located = self.memory.read(self.at)[: self.count()]
        return [tuple(int(number) for number in place) for place in located]

    def add(self, other: "NonFiniteSamples") -> None:
        """Add those of another film."""
        located = [*self.places(), *other.places()][:MAX_LOCATED]
        array = self.to_array()
        array[0, 0] += other.count()
        array[1 : 1 + len(located)] = np.reshape(located, (-1, 3))
        self.from_array(array)

    def to_array(self) -> np.ndarray:
        """(1 + MAX_LOCATED, 3) int32: how many there were, then (x, y, sample index) of each."""
        return np.concatenate([[[self.count(), 0, 0]], self.memory.read(self.at)]).astype(np.int32)

    def from_array(self, array: np.ndarray) -> None:
        """Restore what ``to_array`` returned."""
        self.memory.write(self.at, array[1:])
        self.memory.write(self.number, array[0, 0])
