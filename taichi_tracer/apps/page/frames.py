"""The pictures of a live page: quick ones while it moves, and lossless ones at rest."""

import io
from dataclasses import dataclass

import numpy as np
import taichi as ti
import taichi.math as tm
from PIL import Image

from taichi_tracer.files.srgb import to_bytes
from taichi_tracer.progressive import ProgressiveRenderer
from taichi_tracer.tones.display import Display

MOST_PIXELS = 1024 * 1024  # of a picture that moves: a larger one is sent smaller
QUALITY = 90  # of JPEG
FASTEST = 1  # of the levels of PNG


@dataclass(frozen=True)
class Frame:
    """One picture with what is known about it.

    Attributes:
        number: counts the frames. kind: "jpeg" or "png". data: the file.
        data_number: the number of the first frame with this file, so that a page gets it only when it is new.
        state: what changes with every picture, as JSON. details: what else the page shows, as JSON.
        details_number: counts the changes of the details, so that a page gets them only when they are new.
    """

    number: int
    kind: str
    data: bytes
    state: str
    details: str = "{}"
    details_number: int = 1
    data_number: int = 0

    def data_after(self, since: int) -> bytes:
        """The file; none for a page that got it with the frame of number ``since``, or with an earlier one."""
        return self.data if since < max(self.data_number, 1) else b""


def exact_pixels(renderer: ProgressiveRenderer) -> np.ndarray:
    """(h, w, 3) bytes: those of the PNG that ``renderer.save`` writes."""
    return to_bytes(renderer.image(), renderer.srgb, renderer.display if renderer.srgb else Display())


def quick_pixels(renderer: ProgressiveRenderer) -> np.ndarray:
    """(h, w, 3) bytes of the picture for a moment: of a large one, only some pixels; a byte may differ by one."""
    step = max(1, int(np.ceil(np.sqrt(renderer.width * renderer.height / MOST_PIXELS))))
    pixels = np.empty((-(-renderer.height // step), -(-renderer.width // step), 3), np.uint8)
    display = renderer.display
    _copy_rows(renderer.canvas, pixels, step, renderer.srgb, display.part, display.scale)
    return pixels


@ti.kernel
def _copy_rows(
    canvas: ti.template(),
    pixels: ti.types.ndarray(dtype=ti.u8, ndim=3),
    step: ti.i32,
    srgb: ti.template(),
    tone: ti.template(),
    exposure: ti.f32,
):
    """Every ``step``-th pixel of every ``step``-th row, the top row first."""
    for row in range(pixels.shape[0]):
        for column in range(pixels.shape[1]):
            color = canvas[column * step, canvas.shape[1] - 1 - row * step]
            if ti.static(srgb):
                color = encode_srgb(tone.curve(tm.clamp(color * exposure, 0.0, tone.white)))
            for k in ti.static(range(3)):
                pixels[row, column, k] = ti.cast(255 * tm.clamp(color[k], 0.0, 1.0) + 0.5, ti.u8)


@ti.func
def encode_srgb(linear):
    """The sRGB transfer function of IEC 61966-2-1, as files are written (C-14)."""
    c = tm.clamp(linear, 0.0, 1.0)
    return ti.select(c <= 0.0031308, 12.92 * c, 1.055 * tm.pow(c, tm.vec3(1 / 2.4)) - 0.055)


def encoded(pixels: np.ndarray, kind: str) -> bytes:
    """The file of a picture: "jpeg" or "png"."""
    options = {"quality": QUALITY} if kind == "jpeg" else {"compress_level": FASTEST}
    file = io.BytesIO()
    Image.fromarray(pixels).save(file, kind.upper(), **options)
    return file.getvalue()
