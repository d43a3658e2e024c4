"""A contact sheet: every picture whole and unchanged, and captions that can be read."""

import io

import numpy as np
import pytest
from PIL import Image

from taichi_tracer.apps.contact_sheet import BACKGROUND, GAP, LINE, SMALLEST_TEXT, balanced, contact_sheet


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


@pytest.mark.parametrize("size", [(4, 3), (64, 48), (600, 600)])
def test_captions_are_below_their_pictures_and_do_not_touch(size):
    width, height = size
    _, sheet = sheet_of(2, width, height, caption="a caption that is not short")
    text = (sheet[GAP + height + 1 :] != BACKGROUND).any(axis=(0, 2))
    edges = np.flatnonzero(np.diff(text.astype(int)))
    gaps = np.diff(edges)[1::2]  # between letters, and between the captions
    middle = sheet.shape[1] // 2
    assert not text[middle - GAP // 2 : middle + GAP // 2].any()
    assert gaps.max() >= GAP - 1
    rows = (sheet[GAP + height + 1 :] != BACKGROUND).any(axis=(1, 2))
    assert rows.sum() >= 0.7 * SMALLEST_TEXT
    assert not rows[-GAP:].any()


def test_rows_are_as_full_as_possible():
    assert [balanced(count) for count in (1, 2, 4, 5, 6, 7, 8, 9)] == [1, 2, 4, 3, 3, 4, 4, 3]
