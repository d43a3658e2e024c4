"""Two choices beside each other: two pictures of one camera, and how far they differ."""

from collections.abc import Callable

import numpy as np

from taichi_tracer.apps.choices import Choices
from taichi_tracer.picture.heat import Scale, heat, round_up
from taichi_tracer.renderer import ProgressiveRenderer
from taichi_tracer.system.errors import one_of

OFF, SIDES, DIFFERENCE = "off", "sides", "difference"
MODES = {OFF: "one picture", SIDES: "two pictures, one beside the other", DIFFERENCE: "how far the two differ"}
BRIGHTEST = 99.0  # percent of the pixels that the scale of the difference covers: a few are far off in noisy pictures


class Split:
    """Two sides, each with choices of its own, and one camera.

    Attributes:
        sides: the choices of the left and of the right picture. number: which of them the controls change, 0 or 1.
        mode: one of ``MODES``, except "off".
        scale: what the colours of the difference mean, for the page; None if it is not shown.
    """

    def __init__(self, choices: Choices, mode: str) -> None:
        self.sides, self.number, self.mode = (choices, choices.beside()), 1, mode
        self.scale: Scale | None = None

    @classmethod
    def begun(cls, former: "Split | None", choices: Choices, mode: str) -> "Split | None":
        """The split of a mode: the former one if there is one, else one that begins with the same choices twice.

        Raises:
            InputError: there is no such mode.
        """
        if mode not in MODES:
            raise one_of("split", mode, MODES)
        if mode == OFF:
            return None
        if former is None:
            return cls(choices, mode)
        former.mode, former.scale = mode, None
        return former

    @property
    def choices(self) -> Choices:
        """What the controls change."""
        return self.sides[self.number]

    def pixels(self, make: Callable[[ProgressiveRenderer], np.ndarray]) -> np.ndarray:
        """(h, 2 w, 3) bytes of both pictures, the left one first; or (h, w, 3) of their difference.

        Args:
            make: gives the (h, w, 3) bytes of one renderer's picture.
        """
        left, right = (one.renderer for one in self.sides)
        if self.mode == SIDES:
            return np.concatenate([make(left), make(right)], axis=1)
        values = np.abs(left.image().astype(np.float64) - right.image()).mean(axis=2)
        largest = round_up(float(np.percentile(values, BRIGHTEST)) or float(values.max()))
        text = f"difference of left and right, mean of red, green and blue; its mean is {values.mean():.3g}"
        self.scale = Scale(largest, text)
        return np.floor(255 * heat(values, largest) + 0.5).astype(np.uint8)
