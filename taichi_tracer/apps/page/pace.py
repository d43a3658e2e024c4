"""How often a live picture is shown and its error is looked at, in the window, in browsers and in notebooks."""

from collections.abc import Callable

import taichi as ti

from taichi_tracer.progressive import ProgressiveRenderer

MOST_POINTS = 400  # of a curve of the error; of a longer one, every other point is left out


class Throttle:
    """Lets something be done so seldom that it takes at most a share of the time.

    Args:
        least: seconds between two times at least. share: of the time that it may take.
        most: seconds between two times at most, whatever it takes.
    """

    def __init__(self, least: float, share: float, most: float) -> None:
        self.least, self.share, self.most = least, share, most
        self.next = 0.0  # when it may be done again

    def done(self, begin: float, end: float) -> None:
        """Note when it was done."""
        self.next = end + min(self.most, max(self.least, (end - begin) / self.share))


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
