"""The window under a virtual display: it opens, a key moves the eye, ``p`` saves the picture, Esc closes it."""

import numpy as np
import pytest
from desktop import opened, poll

import taichi_tracer as tt


@pytest.mark.slow
def test_a_window_opens_saves_and_closes(tmp_path):
    words = ["-m", "taichi_tracer", "view", "cube", "--size", "300x200", "--view", "normal"]
    with opened(words, tmp_path) as desktop:
        poll(lambda: desktop.window().max() > 100, "a picture")
        desktop.point(desktop.width // 2, desktop.height // 2)
        desktop.xdotool("key", "p")
        (file,) = poll(lambda: list(tmp_path.rglob("*.png")), "a saved picture")
        poll(lambda: file.stat().st_size > 1000, "a whole file")
        assert len(np.unique(tt.read_image(file).reshape(-1, 3), axis=0)) >= 3  # sides of the cube, and what is behind
        desktop.xdotool("key", "Escape")
        assert poll(lambda: desktop.process.poll() is not None, "the end of the program")
        assert desktop.process.returncode == 0
