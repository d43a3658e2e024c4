"""Directions towards the light of an environment, drawn for sixteen pixels at once, with the same bits.

To find the texel of a random number takes two reads of tables, one after the other, in slow memory. A loop that only
searches has the reads of many pixels on their way at once. Of a loop that turns texels into directions, LLVM makes
vector instructions.
"""

import taichi as ti
import taichi.math as tm

from taichi_tracer.fast.lanes import LANES, lanes
from taichi_tracer.system import memory


@ti.data_oriented
class LightLanes:
    """What ``EnvironmentLight.sample_direction`` draws for each pixel of a group, in each place.

    Fields of a place, sixteen lanes each: ``x``, ``y`` and ``z``, the components of a direction; ``pdf``, its density.

    Args:
        light: an ``EnvironmentLight``. places: the number of threads.
    """

    def __init__(self, light, places: int) -> None:
        self.light = light
        self._memory = memory.Memory()
        self.x, self.y, self.z, self.pdf = (ti.Vector.field(LANES, float) for _ in range(4))
        self._memory.fields.dense(ti.i, places).place(self.x, self.y, self.z, self.pdf)
        self._memory.allocate()

    @ti.func
    def find(self, c, first, second):
        """Draw a direction for each pixel of a group.

        Args:
            first, second: the pairs of random numbers of the pixels, in lanes.
        """
        u, height, pdf = lanes(0.0), lanes(0.0), lanes(0.0)
        for lane in range(LANES):
            row, column, u[lane], height[lane] = self.light.find_texel(tm.vec2(first[lane], second[lane]))
            pdf[lane] = self.light.pdf_of(row, column)
        x, y, z = lanes(0.0), lanes(0.0), lanes(0.0)
        for lane in range(LANES):
            w_i = self.light.direction_at(u[lane], height[lane])
            x[lane], y[lane], z[lane] = w_i.x, w_i.y, w_i.z
        self.x[c], self.y[c], self.z[c], self.pdf[c] = x, y, z, pdf

    @ti.func
    def sample(self, c, lane):
        """(direction, pdf) of one pixel."""
        return tm.vec3(self.x[c][lane], self.y[c][lane], self.z[c][lane]), self.pdf[c][lane]
