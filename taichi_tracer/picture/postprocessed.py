"""The picture as the course shows it in a window: a power of 1/2.2, and values from 0 to 1."""

import functools
from typing import Any

import taichi as ti
import taichi.math as tm

from taichi_tracer.system import memory

GAMMA = 2.2


class PostprocessedMixin:
    """The methods of the course that show a picture of light with a power of 1/2.2; ``canvas`` stays linear."""

    canvas: Any
    width: int
    height: int

    @functools.cached_property
    def canvas_postprocessed(self) -> Any:
        """The Taichi field [x, y] of RGB vectors that ``postprocess`` writes, as ``canvas``."""
        self._memory_postprocessed = memory.Memory()
        shown = ti.Vector.field(3, float)
        self._memory_postprocessed.fields.dense(ti.ij, (self.width, self.height)).place(shown)
        self._memory_postprocessed.allocate()
        return shown

    def postprocess(self) -> None:
        """Write ``canvas_postprocessed``."""
        _postprocess(self.canvas, self.canvas_postprocessed)


@ti.kernel
def _postprocess(canvas: ti.template(), shown: ti.template()):
    for x, y in shown:
        shown[x, y] = tm.clamp(canvas[x, y], 0, 1) ** (1 / GAMMA)
