"""Numbers that kernels read and that can be changed at any time, without compiling anything again."""

import taichi as ti

from taichi_tracer.system import memory


@ti.data_oriented
class LiveNumbers:
    """A row of numbers in the running precision.

    Attributes:
        version: counts the changes, so that a renderer knows when its samples belong to an older picture.
    """

    def __init__(self, *numbers: float) -> None:
        self._memory = memory.Memory()
        self._field = ti.field(float)
        self._memory.fields.dense(ti.i, len(numbers)).place(self._field)
        self._memory.allocate()
        self.version = 0
        self._write(numbers)

    def is_over(self) -> bool:
        """Whether Taichi was started again since then, which freed the numbers."""
        return self._memory.is_over()

    def set(self, *numbers: float) -> None:
        """Change all numbers."""
        self._write(numbers)
        self.version += 1

    def _write(self, numbers) -> None:
        self._memory.write(self._field, numbers)

    @ti.func
    def get(self, i: ti.template()):
        """The i-th number; in kernels."""
        return self._field[i]
