"""Two pictures of one camera, to be compared: side by side, or as their difference."""

from collections.abc import Callable

import numpy as np

from taichi_tracer.apps.page.renderer_state import RendererState
from taichi_tracer.progressive import ProgressiveRenderer
from taichi_tracer.system.errors import one_of
from taichi_tracer.tones.heat import Scale, heat, round_up

OFF, SIDES, DIFFERENCE = "off", "sides", "difference"
MODES = {OFF: "one picture", SIDES: "two pictures, one beside the other", DIFFERENCE: "how far the two differ"}
EQUAL = ("samples", "seconds")  # what both pictures have the same number of
BRIGHTEST = 99.0  # percent of the pixels that the scale of the difference covers: a few are far off in noisy pictures


class CompareView:
    """Two sides, each with settings of its own, and one camera.

    Attributes:
        sides: the states of the left and of the right picture. number: which of them the controls change, 0 or 1.
        mode: one of ``MODES``, except "off". equal: one of ``EQUAL``.
        scale: what the colours of the difference mean, for the page; None if it is not shown.
    """

    def __init__(self, state: RendererState, mode: str) -> None:
        self.sides, self.number, self.equal = (state, state.beside()), 1, EQUAL[0]
        self.scale: Scale | None = None
        self.set_mode(mode)
        self.begin_again()

    def set_mode(self, mode: str) -> None:
        """Choose how the two are shown; InputError for no such mode."""
        if mode not in MODES:
            raise one_of("split", mode, MODES)
        self.mode, self.scale = mode, None

    def set_equal(self, by: str) -> None:
        """Choose what both pictures have the same number of; both begin again."""
        if by not in EQUAL:
            raise one_of("equal", by, EQUAL)
        self.equal = by
        self.begin_again()

    def begin_again(self) -> None:
        """Forget the samples of both, so that neither is ahead."""
        for one in self.sides:
            one.renderer.reset()

    @property
    def state(self) -> RendererState:
        """What the controls change."""
        return self.sides[self.number]

    @property
    def behind(self) -> ProgressiveRenderer:
        """The renderer that has fewer samples, or was rendered for less time: it takes the next sample."""
        left, right = (one.renderer for one in self.sides)
        if not (left.is_random and right.is_random):
            return left if left.is_random else right
        if not (left.is_current() and right.is_current()):
            return right if left.is_current() else left
        if self.equal == "samples":
            return left if left.samples <= right.samples else right
        return left if left.rendered_seconds <= right.rendered_seconds else right

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
