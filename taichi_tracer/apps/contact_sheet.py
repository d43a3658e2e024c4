"""A contact sheet: several pictures in one, side by side, each with a caption below it."""

import io

import numpy as np

from taichi_tracer.files.fonts import font_of

MOST_COLUMNS = 4  # pictures side by side
GAP = 8  # pixels around each picture
SMALLEST_TEXT = 14  # pixels: the height of letters that can be read
TEXT_SHARE = 1 / 20  # of a picture's height: the size of the letters, in a large picture
LINE = 1.6  # the height of a caption's line, as a multiple of the letters' size
BACKGROUND, TEXT = (24, 24, 24), (235, 235, 235)


def contact_sheet(pictures: list[np.ndarray], captions: list[str]) -> bytes:
    """A PNG file with all pictures, in rows of up to four.

    A column is as wide as its pictures, or as the longest caption.

    Args:
        pictures: (height, width, 3) uint8, all of the same size, top row first.
        captions: one line for each of them.
    """
    from PIL import Image, ImageDraw

    height, width = pictures[0].shape[:2]
    size = max(SMALLEST_TEXT, round(TEXT_SHARE * height))
    font = font_of(size)
    line = round(LINE * size)
    column = GAP + max(width, *(int(np.ceil(font.getlength(caption))) for caption in captions))
    columns = balanced(len(pictures))
    rows = -(-len(pictures) // columns)
    sheet = Image.new("RGB", (columns * column + GAP, rows * (height + line + GAP) + GAP), BACKGROUND)
    pen = ImageDraw.Draw(sheet)
    for i, (picture, caption) in enumerate(zip(pictures, captions, strict=True)):
        x, y = GAP + i % columns * column, GAP + i // columns * (height + line + GAP)
        middle = x + (column - GAP) // 2
        sheet.paste(Image.fromarray(picture), (middle - width // 2, y))
        pen.text((middle, y + height + line // 2), caption, fill=TEXT, font=font, anchor="mm")
    content = io.BytesIO()
    sheet.save(content, "PNG")
    return content.getvalue()


def balanced(count: int) -> int:
    """The number of columns of a sheet: up to four, and rows that are as full as possible."""
    rows = -(-count // MOST_COLUMNS)
    return -(-count // rows)
