"""Values of an integrator that can be changed while its picture is shown: what windows offer, and what kernels read.

``Integrator.controls`` returns them, with their present values; ``Integrator.change`` takes the new ones by name.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import taichi as ti

from taichi_tracer.system import memory


@dataclass(frozen=True)
class Slider:
    """A number between two ends, which belong to it. It is whole if both ends are whole.

    Attributes:
        name: of the value, for ``Integrator.change``.
        label: what stands beside the slider; up to 10 characters have room there.
    """

    name: str
    value: float
    low: float
    high: float
    label: str


@dataclass(frozen=True)
class NameControl:
    """One of several names, which a button chooses one after another.

    Attributes:
        name: of the value, for ``Integrator.change``.
        label: what stands before the value on the button.
    """

    name: str
    value: str
    names: Sequence[str]
    label: str


@dataclass(frozen=True)
class BouncesControl:
    """The light of which bounces is shown: of all (None), or of some, (first, last); see ``PathSettings.bounces``.

    Attributes:
        name: of the value, for ``Integrator.change``.
        most: the largest number of bounces.
    """

    name: str
    value: tuple[int, int | None] | None
    most: int


Control = Slider | NameControl | BouncesControl


@ti.data_oriented
class LiveNumbers:
    """A row of numbers in the running precision, which kernels read. A change compiles nothing again.

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
