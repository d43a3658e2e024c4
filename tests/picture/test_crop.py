"""Crop windows: which pixels they hold."""

import itertools
import math

import pytest

from taichi_tracer.picture.crop import crop_pixels
from taichi_tracer.system.errors import InputError


def test_crop_windows_that_meet_share_no_pixel():
    """C-12, and 1 means the edge: however the frame is cut, every pixel is in one piece."""
    for width, height, cut in itertools.product((1, 7, 100), (3, 64), (0.1, 1 / 3, 0.5, 0.999)):
        windows = (0, cut, 0, 1), (cut, 1, 0, 1)
        if 0 < math.ceil(cut * width) < width:
            (a0, a1, *_), (b0, b1, *_) = (crop_pixels(window, width, height) for window in windows)
            assert (a0, a1, b1) == (0, b0, width)
        else:
            with pytest.raises(InputError, match="holds no pixel"):
                crop_pixels(windows[1 if math.ceil(cut * width) == width else 0], width, height)


@pytest.mark.parametrize("window", [(0, 0, 0, 1), (0.5, 0.2, 0, 1), (-0.1, 1, 0, 1), (0, 1, 0, 1.5)])
def test_a_window_that_is_none_is_refused(window):
    with pytest.raises(InputError, match="0 <= x0 < x1 <= 1"):
        crop_pixels(window, 8, 8)
