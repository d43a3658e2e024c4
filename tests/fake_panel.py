"""A panel of the window that shows nothing: what it is asked to show is noted, and the test presses its buttons."""

import contextlib

import numpy as np


class FakePanel:
    """Records what ``ti.ui``'s panels are asked to show.

    ``pressed`` is the button or checkbox that the mouse is on; ``slides`` moves the sliders with these labels.
    """

    def __init__(self, pressed=None, **slides):
        self.pressed, self.slides = pressed, slides
        self.windows, self.texts, self.buttons, self.sliders = [], [], [], []

    @contextlib.contextmanager
    def sub_window(self, name, x, y, width, height):
        assert 0 <= x <= x + width <= 1 + 1e-9
        assert 0 <= y <= y + height <= 1 + 1e-9
        self.windows.append(name.split("##")[0])
        yield self

    def text(self, text):
        self.texts.append(text)

    def button(self, label):
        self.buttons.append(label)
        return label == self.pressed

    def checkbox(self, label, value):
        return value != (label == self.pressed)

    def slider_int(self, label, value, low, high):
        self.sliders.append(label)
        assert low <= value <= high
        return self.slides.get(label.split()[-1], value)

    def slider_float(self, label, value, low, high):
        self.sliders.append(label)
        assert low <= value <= high
        return float(np.float32(self.slides.get(label.split()[-1], value)))
