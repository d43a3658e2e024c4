"""The picture as the course shows it in a window: a power of 1/2.2, and values from 0 to 1."""

import functools
from typing import Any

import taichi as ti
import taichi.math as tm

from taichi_tracer.system.fields import memory

GAMMA = 2.2


@ti.data_oriented
class Postprocessed:
    """A copy of a canvas, of the same size.

    Attributes:
        canvas: the field [x, y] of RGB vectors.
    """

    def __init__(self, width: int, height: int) -> None:
        self._memory = memory.Memory()
        self.canvas = ti.Vector.field(3, float)
        self._memory.fields.dense(ti.ij, (width, height)).place(self.canvas)
        self._memory.allocate()

    def copy_from(self, canvas: Any) -> None:
        """Show another canvas."""
        self._memory.check("canvas")
        self._copy_from(canvas)

    @ti.kernel
    def _copy_from(self, canvas: ti.template()):
        for x, y in self.canvas:
            self.canvas[x, y] = tm.clamp(canvas[x, y], 0, 1) ** (1 / GAMMA)


class PostprocessedMixin:
    """The methods of the course that show a picture of light with a power of 1/2.2; ``canvas`` stays linear."""

    @functools.cached_property
    def _postprocessed(self) -> Postprocessed:
        return Postprocessed(self.width, self.height)  # type: ignore[attr-defined]

    def postprocess(self) -> None:
        """Write ``canvas_postprocessed``."""
        self._postprocessed.copy_from(self.canvas)  # type: ignore[attr-defined]

    @property
    def canvas_postprocessed(self) -> Any:
        """The Taichi field that ``postprocess`` writes, as ``canvas``."""
        return self._postprocessed.canvas
