"""A contact sheet: every picture whole and unchanged, and captions that can be read."""

import io

import numpy as np
from PIL import Image

from taichi_tracer.apps.commands.render import GAP, LINE, SMALLEST_TEXT, contact_sheet


def sheet_of(count, width, height, caption="k"):
    """(the pictures, the sheet as an array)."""
    rng = np.random.default_rng(count)
    pictures = [rng.integers(0, 256, (height, width, 3), np.uint8) for _ in range(count)]
    content = contact_sheet(pictures, [f"{caption} {i}" for i in range(count)])
    return pictures, np.asarray(Image.open(io.BytesIO(content)))


def test_every_picture_is_there_bit_for_bit_in_rows():
    pictures, sheet = sheet_of(5, 60, 40)
    line = round(LINE * SMALLEST_TEXT)
    for i, picture in enumerate(pictures):
        x, y = GAP + i % 3 * (60 + GAP), GAP + i // 3 * (40 + line + GAP)
        np.testing.assert_array_equal(sheet[y : y + 40, x : x + 60], picture)
    assert sheet.shape == (2 * (40 + line + GAP) + GAP, 3 * (60 + GAP) + GAP, 3)
