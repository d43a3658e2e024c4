"""In place of film and shares: what takes the samples of chosen pixels; another choice compiles nothing anew."""

from collections.abc import Callable
from typing import Any

import numpy as np
import taichi as ti

from taichi_tracer.system import memory
from taichi_tracer.system.compile_time import compile_time, element, variable


@ti.data_oriented
class SomePixels:
    """Takes samples as a film does, and gives them to a function.

    Args:
        take: what gets (x, y, value, index) of every sample, in a kernel.
    """

    def __init__(self, take: Callable[..., Any]) -> None:
        self.take = take
        self._memory, (self.ends,) = memory.filled(np.zeros(4, np.int32))

    def choose(self, columns: tuple[int, int], rows: tuple[int, int]) -> None:
        """Let the next samples be those of a range of columns and a range of rows, counted from the bottom left."""
        self._memory.write(self.ends, [*columns, *rows])

    @property
    def ranges(self) -> tuple[tuple, tuple]:
        """((x0, x1), (y0, y1)), for the kernel that begins its loop over them now."""
        x0, x1, y0, y1 = (variable(element(self.ends, k)) for k in range(4))
        return (x0, x1), (y0, y1)

    @ti.func
    def sample_of(self, x, y, index):
        """Every chosen pixel takes every sample, see ``Shares.sample_of``."""
        return index, True

    @compile_time
    def record(self, x, y, value, index) -> None:
        """Take the sample of a pixel, see ``Film.record``."""
        self.take(x, y, value, index)
