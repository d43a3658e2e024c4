"""The picture: the mean of the samples of every pixel, and what is needed to know its error."""

import numpy as np
import taichi as ti

from taichi_tracer import runtime


@ti.data_oriented
class Film:
    """A canvas [x, y] with y up, inside kernels; an image with the top row first, outside.

    Args:
        width, height: pixels.
    """

    def __init__(self, width: int, height: int) -> None:
        self.width, self.height = width, height
        self.samples = 0
        self._lifetime = runtime.Lifetime()
        self.canvas = ti.Vector.field(3, float, shape=(width, height))

    def reset(self) -> None:
        """Forget every sample; the canvas keeps its last picture until the next one."""
        self.samples = 0

    @ti.func
    def put(self, x, y, value):
        """The value of a pixel that every sample agrees on: a view without jitter."""
        self.canvas[x, y] = value

    def image(self) -> np.ndarray:
        """(height, width, 3) float32, linear, top row first."""
        self._lifetime.check("film")
        image = np.empty((self.height, self.width, 3), np.float32)
        self._copy_to(image)
        return image

    @ti.kernel
    def _copy_to(self, image: ti.types.ndarray(dtype=ti.f32, ndim=3)):
        for row, column in ti.ndrange(self.height, self.width):
            for k in ti.static(range(3)):
                image[row, column, k] = self.canvas[column, self.height - 1 - row][k]
