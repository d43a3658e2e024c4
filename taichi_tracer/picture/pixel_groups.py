"""Numbers of pixels in Taichi fields, of which sixteen neighbours lie side by side in memory.

A kernel for one pixel reads and writes the number of this pixel. A kernel that treats a group of 4 × 4 pixels at once
reads and writes sixteen numbers with one instruction (``fast.pixel_lanes``).
"""

import numpy as np
import taichi as ti
import taichi.math as tm

from taichi_tracer.system import runtime
from taichi_tracer.system.memory import Memory
from taichi_tracer.system.seams import element, in_kernels, variable

GROUP_BITS = 2
GROUP = 1 << GROUP_BITS  # pixels along each side of a group
PIXELS = GROUP * GROUP  # of a group


@ti.data_oriented
class PixelGroups:
    """One number, or the three numbers of a colour, for every pixel and each half of its samples.

    Args:
        node: the Taichi field structure with the shape (groups across, groups upwards, halves) in which it is placed.
        width, height: of the picture, in pixels.
        channels: 1 for numbers, 3 for colours. dtype: the type of a number; None for that of kernels.

    Attributes:
        lanes: for each channel a field of vectors of sixteen; pixel (x, y) is in lane 4 (x mod 4) + y mod 4. Vulkan and
            Metal know no lane whose number is computed: there, it is a fourth index of a field of numbers.
    """

    def __init__(self, node, width: int, height: int, channels: int = 1, dtype=None) -> None:
        self.width, self.height, self.channels = width, height, channels
        self.has_vectors, kind = runtime.can("dynamic lanes"), float if dtype is None else dtype
        if self.has_vectors:
            self.lanes = [ti.Vector.field(PIXELS, kind) for _ in range(channels)]
            node.place(*self.lanes)
        else:
            self.lanes = [ti.field(kind) for _ in range(channels)]
            node.dense(ti.l, PIXELS).place(*self.lanes)

    @in_kernels
    def number(self, x, y, half):
        """The number of a pixel."""
        return self.parts(x, y, half)[0]

    @in_kernels
    def set_number(self, x, y, half, number):
        """Set the number of a pixel."""
        self.parts(x, y, half)[0]._assign(number)

    @in_kernels
    def colour(self, x, y, half):
        """The colour of a pixel."""
        return variable(tm.vec3(*self.parts(x, y, half)))

    @in_kernels
    def set_colour(self, x, y, half, colour):
        """Set the colour of a pixel."""
        for channel, part in enumerate(self.parts(x, y, half)):
            part._assign(element(colour, channel))

    @in_kernels
    def parts(self, x, y, half):
        """The number of a pixel for each channel, which can be read and set."""
        lane, place = variable(lane_of(x, y)), (variable(x >> GROUP_BITS), variable(y >> GROUP_BITS), half)
        if self.has_vectors:
            return [element(element(lanes, *place), lane) for lanes in self.lanes]
        return [element(lanes, *place, lane) for lanes in self.lanes]

    def read(self, memory: Memory) -> np.ndarray:
        """[x, y, half] the numbers, or [x, y, half, channel] the colours; ``memory`` is that of the fields."""
        arrays = [self._by_pixel(memory.read(field)) for field in self.lanes]
        return np.stack(arrays, axis=-1) if self.channels > 1 else arrays[0]

    def write(self, memory: Memory, numbers: np.ndarray) -> None:
        """Set all pixels; ``numbers`` as from ``read``."""
        for channel, field in enumerate(self.lanes):
            memory.write(
                field, self._by_group(numbers[..., channel] if self.channels > 1 else numbers, field.shape[:3])
            )

    def _by_pixel(self, groups: np.ndarray) -> np.ndarray:
        across, upwards, halves, _ = groups.shape
        pixels = groups.reshape(across, upwards, halves, GROUP, GROUP).transpose(0, 3, 1, 4, 2)
        return pixels.reshape(across * GROUP, upwards * GROUP, halves)[: self.width, : self.height]

    def _by_group(self, pixels: np.ndarray, shape: tuple[int, ...]) -> np.ndarray:
        across, upwards, halves = shape
        beyond = (0, across * GROUP - self.width), (0, upwards * GROUP - self.height), (0, 0)
        groups = np.pad(pixels, beyond).reshape(across, GROUP, upwards, GROUP, halves)
        return groups.transpose(0, 2, 4, 1, 3).reshape(across, upwards, halves, PIXELS)


@in_kernels
def lane_of(x, y):
    """The lane of a pixel within its group."""
    return (x & (GROUP - 1)) << GROUP_BITS | (y & (GROUP - 1))


def groups_along(pixels: int) -> int:
    """How many groups are needed for some pixels."""
    return -(-pixels // GROUP)


def upright(array: np.ndarray, dtype: type = np.float32) -> np.ndarray:
    """[x, y, ...], y up, as an image: contiguous [row, column, ...] with the top row first."""
    return np.ascontiguousarray(array.swapaxes(0, 1)[::-1], dtype)
