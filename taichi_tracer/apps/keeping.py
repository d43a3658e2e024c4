"""Samples are added to a picture while a bar grows, and are kept in a checkpoint, so that nothing is lost."""

import contextlib
import math
import sys
import time
from collections.abc import Callable, Iterator
from pathlib import Path

from taichi_tracer.apps.console import note
from taichi_tracer.apps.running import Interruption, written
from taichi_tracer.files import checkpoint
from taichi_tracer.picture.error_estimate import percent
from taichi_tracer.picture.progress import Progress, Target
from taichi_tracer.progressive import ProgressiveRenderer
from taichi_tracer.system import stopwatch
from taichi_tracer.system.errors import InputError
from taichi_tracer.system.stopwatch import stage

SHOW_PROGRESS_AFTER = 1.0  # seconds: shorter work is over before a bar could be read
BAR = "{desc} {percentage:3.0f}%|{bar}| {postfix}"
SHORTEST = 1e-9  # seconds: keeps the share that is done a number before anything was timed


class RenderingStopped(Exception):
    """The rendering was interrupted after a whole sample."""


def add_samples(
    renderer: ProgressiveRenderer,
    keeper: "Keeper",
    target: Target,
    interruption: Interruption,
    render: Callable[..., object],
) -> None:
    """Render until a target is reached or a signal came, and keep a checkpoint if one is wanted."""
    kept = keeper.resume()
    spp = None if target.spp is None else target.spp - kept
    if spp is not None and spp <= 0:
        return
    with progress_bar(renderer) as show:

        def watch(progress: Progress) -> None:
            """After each sample: bring the bar up to date, keep a checkpoint if it is due, and stop after a signal."""
            show(progress)
            keeper.keep_sometimes()
            if interruption.number is not None:
                raise RenderingStopped

        with contextlib.suppress(RenderingStopped):
            render(spp=spp, time=target.time, error=target.error, watch=watch)
    keeper.keep()


class Keeper:
    """Writes a checkpoint every few seconds, and reads the one that is there.

    Args:
        path: of the checkpoint; None keeps none. every: seconds between two of them.
    """

    def __init__(self, renderer: ProgressiveRenderer, path: str | None = None, every: float = math.inf) -> None:
        self.renderer, self.path, self.every = renderer, path, every
        self.kept_at = time.perf_counter()

    def resume(self) -> int:
        """Go on from the file if it exists; returns how many samples it has."""
        if self.path is None or not Path(self.path).exists():
            return 0
        self.renderer.load_checkpoint(self.path)
        print(f"{self.path}: going on after {self.renderer.samples} samples")
        return self.renderer.samples

    def keep_sometimes(self) -> None:
        """Write, unless that was just done."""
        if self.path is not None and self.renderer.samples > 0 and time.perf_counter() - self.kept_at > self.every:
            self.kept_at = time.perf_counter()
            try:
                self.renderer.save_checkpoint(self.path)
            except InputError as error:  # the disk may have room by the next time
                note(f"{error}: rendering goes on")

    def keep(self) -> None:
        """Write now, if there is where to and what."""
        if self.path is not None and self.renderer.samples > 0:
            with stage(stopwatch.WRITE):
                written(Path(self.path), self.renderer.save_checkpoint)

    def kept_at_end(self, picture: Path) -> str:
        """Write now, beside the picture if nobody named a place; says how to go on."""
        if self.renderer.samples == 0:
            return "nothing has come yet: run the same command again"
        self.path = self.path or str(picture.with_suffix(checkpoint.EXTENSION))
        self.keep()
        return f"they are kept: to go on, run the same command again, with --checkpoint {self.path}"


@contextlib.contextmanager
def progress_bar(renderer: ProgressiveRenderer) -> Iterator[Callable[[Progress], None]]:
    """What brings a bar up to date, on stderr, if that is a terminal: samples, seconds, error, seconds left."""
    if not sys.stderr.isatty():  # then tqdm is not loaded either
        yield lambda progress: None
        return
    from tqdm import tqdm

    options = {"delay": SHOW_PROGRESS_AFTER, "leave": False}
    with tqdm(total=1.0, bar_format=BAR, desc=renderer.active.name, **options) as bar:

        def show(progress: Progress) -> None:
            """Bring the bar up to date."""
            left, error = progress.seconds_left, f"error {percent(progress.error)}"
            rest = f"{left:.1f} s left" if left >= 0 else "? left"
            texts = [f"{renderer.samples} spp", f"{progress.seconds:.1f} s", progress.place, error, rest]
            bar.set_postfix_str(", ".join(filter(None, texts)), refresh=False)
            if left >= 0:
                bar.update(max(0.0, progress.seconds / max(progress.seconds + left, SHORTEST) - bar.n))

        yield show
