"""What the window, the page and notebooks share: the first compilation, and curves that stay short."""

from collections.abc import Callable

import taichi as ti

from taichi_tracer.progressive import ProgressiveRenderer

MOST_POINTS = 400  # of a curve of the error; of a longer one, every other point is left out


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
