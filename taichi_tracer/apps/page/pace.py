"""How often a live picture is shown and its error is looked at, in the window, in browsers and in notebooks."""

import math
from collections.abc import Callable

import taichi as ti

from taichi_tracer.progressive import ProgressiveRenderer

ERROR_EVERY = 0.5  # seconds between two estimates of the error at least: each reads the whole film
LATELY = 8  # times over which the cost of something is averaged
MOST_POINTS = 400  # of a curve of the error; of a longer one, every other point is left out


class Rarely:
    """Lets something be done so seldom that it takes at most a share of the time.

    Args:
        least: seconds between two times at least. share: of the time that it may take.
        most: seconds between two times at most, whatever it takes.

    The mean of the times that it took lately is what counts, without the first one, which may have compiled something.
    """

    def __init__(self, least: float, share: float, most: float = math.inf) -> None:
        self.least, self.share, self.most = least, share, most
        self.begin()

    def begin(self) -> None:
        """Let it be done at once, and forget how long it took."""
        self.next = -math.inf
        self._times: list[float] = []

    def done(self, begin: float, end: float) -> None:
        """Note when it was done."""
        self._times = [*self._times, end - begin][-LATELY:]
        later = self._times[1:]
        pause = max(self.least, sum(later) / len(later) / self.share) if later else self.least
        self.next = end + min(self.most, pause)


def thinned(curve: list) -> list:
    """A curve of at most ``MOST_POINTS`` points, its last one among them."""
    last = max(0, len(curve) - 1)
    step = 1 + last // MOST_POINTS
    return curve[last % step :: step]


def warm_up(renderer: ProgressiveRenderer, draw: Callable[[], object], tell: Callable[[str], None] = print) -> None:
    """Compile before a picture is shown what a moving camera needs; otherwise it would freeze at the first key.

    Args:
        draw: renders a sample and shows it. tell: is called with what takes so long.
    """
    for _ in range(3):  # the first pictures compile
        renderer.camera.set_camera_parameters()  # as if moved
        draw()
        ti.sync()
