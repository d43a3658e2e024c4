"""What the window shows: the picture in its own proportions between two margins for the panels, at any window size."""

from dataclasses import dataclass

import numpy as np
import taichi as ti
import taichi.math as tm

from taichi_tracer.progressive import ProgressiveRenderer

PANEL_WIDTH, PANEL_LINE = 248, 24  # pixels; they fit 32 characters, and a button, in ti.ui's only font
SMALLEST_PICTURE = 384  # pixels: smaller pictures are shown enlarged, pixel by pixel
LEAST_ROOM = 160  # pixels: a panel that leaves less width than this to the picture is not shown
SHARE_OF_SCREEN = 0.95, 0.88  # of its width and height: what a window may take; the rest is for borders and bars
BACKGROUND = 31  # of 255


@dataclass(frozen=True)
class Layout:
    """Where everything is in a window, in pixels; x from the left and y from the bottom.

    Attributes:
        width, height: of the window.
        left, right: the widths of the margins in which the panels stand; 0 where there is no room for a panel.
        x, y, shown_width, shown_height: the picture.
    """

    width: int
    height: int
    left: int
    right: int
    x: int
    y: int
    shown_width: int
    shown_height: int

    @classmethod
    def of(cls, window: tuple[int, int], picture: tuple[int, int], has_panels: bool = True) -> "Layout":
        """The layout of a window of this size: the picture as large as the margins leave room, and in their middle."""
        width, height = (max(1, int(pixels)) for pixels in window)
        left = PANEL_WIDTH if has_panels and width - PANEL_WIDTH >= LEAST_ROOM else 0
        right = PANEL_WIDTH if left > 0 and width - 2 * PANEL_WIDTH >= LEAST_ROOM else 0
        room = width - left - right
        scale = min(room / picture[0], height / picture[1])
        shown = [max(1, round(scale * pixels)) for pixels in picture]
        return cls(width, height, left, right, left + (room - shown[0]) // 2, (height - shown[1]) // 2, *shown)

    def holds(self, cursor: tuple[float, float]) -> bool:
        """Whether a point of the window, in fractions, is between the panels."""
        return self.left <= cursor[0] * self.width < self.width - self.right

    def as_drag(self, start: tuple[float, float], end: tuple[float, float]) -> tuple[float, float]:
        """How far the mouse went between two points of the window, in fractions of the picture."""
        across = (end[0] - start[0]) * self.width / self.shown_width
        return across, (end[1] - start[1]) * self.height / self.shown_height


def first_size(picture: tuple[int, int], lines: int, screen: tuple[int, int] | None) -> tuple[int, int]:
    """The size of the window when it opens: both panels, and the picture that fills what is between them.

    It is no larger than the screen.

    Args:
        picture: size in pixels; it is enlarged where the panels are higher, or where it is small.
        lines: of the longer panel.
        screen: its size in pixels; None if it is unknown.
    """
    scale = max(1, SMALLEST_PICTURE // max(picture))
    most_width, most_height = (
        (10**6, 10**6) if screen is None else (max(1, int(s * p)) for s, p in zip(SHARE_OF_SCREEN, screen, strict=True))
    )
    height = min(max(scale * picture[1], PANEL_LINE * lines), most_height)
    return min(2 * PANEL_WIDTH + round(height * picture[0] / picture[1]), most_width), height


class Screen:
    """The pixels of the window.

    Attributes:
        layout: where everything is.
        has_panels: whether the panels may be shown.
        pixels: (width, height, 3) uint8 for ``ti.ui``, with y up. It is an array and not a field, because a new field
            for every size of the window would have to be compiled.
    """

    def __init__(self, window: tuple[int, int], picture: tuple[int, int]) -> None:
        self.picture, self.has_panels = picture, True
        self.resize(window)

    def resize(self, window: tuple[int, int]) -> None:
        """Arrange everything for a window of this size; the pixels are empty afterwards."""
        self.layout = Layout.of(window, self.picture, self.has_panels)
        self.pixels = np.full((self.layout.width, self.layout.height, 3), BACKGROUND, np.uint8)

    def update(self, renderer: ProgressiveRenderer) -> None:
        """Copy the canvas of a renderer into its place: data as it is, light as ``renderer.display`` says."""
        at, display = self.layout, renderer.display
        place = tm.ivec4(at.x, at.y, at.shown_width, at.shown_height)
        _copy(renderer.canvas, self.pixels, place, renderer.srgb, display.part, display.scale)


@ti.kernel
def _copy(
    canvas: ti.template(),
    pixels: ti.types.ndarray(dtype=ti.u8, ndim=3),
    place: tm.ivec4,
    srgb: ti.template(),
    tone: ti.template(),
    exposure: ti.f32,
):
    """Each pixel of the window is the mean of the picture's pixels in it; of an enlarged picture, the nearest one.

    ``place`` is the left and the bottom edge of the picture in the window, its width and its height.
    """
    left, bottom, width, height = place
    for i, j in ti.ndrange(width, height):
        x0, y0 = i * canvas.shape[0] // width, j * canvas.shape[1] // height
        x1 = ti.max(x0 + 1, (i + 1) * canvas.shape[0] // width)
        y1 = ti.max(y0 + 1, (j + 1) * canvas.shape[1] // height)
        color = tm.vec3(0)
        for x, y in ti.ndrange((x0, x1), (y0, y1)):
            color += canvas[x, y]
        color /= (x1 - x0) * (y1 - y0)
        if ti.static(srgb):
            color = encode_srgb(tone.curve(tm.clamp(color * exposure, 0.0, tone.white)))
        for k in ti.static(range(3)):
            pixels[left + i, bottom + j, k] = ti.cast(255 * tm.clamp(color[k], 0.0, 1.0) + 0.5, ti.u8)


@ti.func
def encode_srgb(linear):
    """The sRGB transfer function of IEC 61966-2-1, as files are written (C-14)."""
    c = tm.clamp(linear, 0.0, 1.0)
    return ti.select(c <= 0.0031308, 12.92 * c, 1.055 * tm.pow(c, tm.vec3(1 / 2.4)) - 0.055)
