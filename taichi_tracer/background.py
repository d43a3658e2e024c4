"""What stands behind everything in a picture: one colour, four corners, or an image over the whole frame (RT-7).

A background belongs to the picture and not to the world. It is looked up by pixel, at the pixel centres of the full
frame, and it does not light the scene. Light that surrounds the scene on all sides is an ``Environment``.
"""

from pathlib import Path

import numpy as np
import taichi as ti
from numpy.typing import ArrayLike

from taichi_tracer.environment import checked, read_linear
from taichi_tracer.system import memory, runtime

CORNERS = ("bl", "tl", "tr", "br")  # bottom left, top left, top right, bottom right: the order in the scene files


@ti.data_oriented
class Background:
    """Texels that are stretched over the frame and interpolated bilinearly between their centres.

    Args:
        texels: (rows, columns, 3) or (rows, columns) linear colours, top row first. (1, 1, 3) is one colour. (2, 2, 3)
            are four corners if ``corners`` is True, otherwise an image.
        corners: whether the outermost texels lie on the border of the frame, instead of half a texel inside it.
        what: the name of the background in messages.

    Raises:
        InputError: the shape is not that of an image, or a colour is negative or not finite; the message names its
            row and column.
    """

    def __init__(self, texels: "ArrayLike", corners: bool = False, what: str = "background") -> None:
        runtime.ensure()
        self.what, self.corners = what, corners
        self.pixels = checked(texels, what, "a background", "a colour")
        self.rows, self.columns = map(memory.varying, self.pixels.shape[:2])
        self._memory, (self.texels,) = memory.filled(self.pixels, indices=2)

    def destroy(self) -> None:
        """Free the memory now; the background cannot be used afterwards."""
        self._memory.free()

    def check_alive(self) -> None:
        """Raise a StaleSceneError if Taichi was initialised again after the background was made."""
        self._memory.check("background")

    @ti.func
    def between(self, pixel, pixels, texels: ti.template()):
        """(first texel, second texel, fraction of the way to the second) for the centre of a pixel, along one axis.

        The place is a quotient of two whole numbers, so that an image of the frame's size is shown texel by texel.
        """
        twice = 2 * ti.cast(pixel, ti.i64) + 1  # divided by 2·pixels, this is the place of the centre in the frame
        place = twice * (texels - 1)
        if ti.static(not self.corners):
            place = ti.max(twice * texels - pixels, 0)
        first = ti.cast(place // (2 * pixels), ti.i32)
        rest = ti.cast(place - ti.cast(first, ti.i64) * (2 * pixels), float) / (2 * pixels)
        second = ti.min(first + 1, texels - 1)
        return ti.min(first, texels - 1), second, rest

    @ti.func
    def color(self, x, y, width, height):
        """The colour behind pixel (x, y), counted from the bottom left; a + f (b − a) keeps equal colours exact."""
        left, right, fx = self.between(x, width, self.columns)
        top, bottom, fy = self.between(height - 1 - y, height, self.rows)
        above = self.texels[top, left] + fx * (self.texels[top, right] - self.texels[top, left])
        below = self.texels[bottom, left] + fx * (self.texels[bottom, right] - self.texels[bottom, left])
        return above + fy * (below - above)


def load_background(value: "ArrayLike | Path | Background | None") -> Background | None:
    """A background from one colour, four colours (``CORNERS``), an image, a path, a ``Background``, or None.

    PNG and JPEG files are decoded from sRGB; files of the other formats hold linear values.

    Raises:
        InputError: the file cannot be used, or the values are not colours.
    """
    if value is None or isinstance(value, Background):
        return value
    if isinstance(value, (str, Path)):
        path = Path(value).expanduser()
        return Background(read_linear(path), what=str(path))
    if np.shape(value) == (3,):
        return Background(np.reshape(value, (1, 1, 3)), what="one colour")
    if np.shape(value) == (4, 3):
        bl, tl, tr, br = np.asarray(value)
        return Background([[tl, tr], [bl, br]], corners=True, what="four corners")
    return Background(value)
