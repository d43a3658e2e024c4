"""Samples are added to a picture while a bar grows, and are kept in a checkpoint, so that nothing is lost."""

import math
import signal
import sys
import time
from collections.abc import Callable
from pathlib import Path

from taichi_tracer.apps.notes import note
from taichi_tracer.apps.running import Interruption, written
from taichi_tracer.files import checkpoint
from taichi_tracer.picture.progress import Progress, Target, two_digits
from taichi_tracer.progressive import ProgressiveRenderer
from taichi_tracer.system import stopwatch
from taichi_tracer.system.errors import InputError
from taichi_tracer.system.stopwatch import stage

SHOW_PROGRESS_AFTER = 1.0  # seconds: shorter work is over before a bar could be read
BAR = "{desc} {percentage:3.0f}%|{bar}| {postfix}"
SHORTEST = 1e-9  # seconds: keeps the share that is done a number before anything was timed


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
    if spp is not None:
        if spp <= 0:
            return
    with SampleBar(renderer) as bar:

        def watch(progress: Progress) -> None:
            """After each sample: bring the bar up to date, keep a checkpoint if it is due, and stop after a signal."""
            bar.show(progress)
            keeper.keep_sometimes()
            if interruption.number is not None:
                raise RenderingStopped

        interruption.is_rendering = True
        try:
            render(spp=spp, time=target.time, error=target.error, watch=watch)
        except RenderingStopped:
            pass
        except KeyboardInterrupt:  # within a sample: some pixels may have it, so that nothing can go on from there
            interruption.number = interruption.number or signal.SIGINT
            return
        finally:
            interruption.is_rendering = False
    keeper.keep()


class RenderingStopped(Exception):
    """The rendering was interrupted after a whole sample."""


class Keeper:
    """Writes a checkpoint every few seconds, and reads the one that is there."""

    def __init__(self, renderer: ProgressiveRenderer, path: str | None, every: float) -> None:
        self.renderer, self.path, self.every = renderer, path, every
        self.kept_at, self.is_in_place = time.perf_counter(), True

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

    def kept_at_end(self, picture: Path) -> str:
        """Write now, beside the picture if nobody named a place; says how to go on."""
        if self.renderer.samples == 0:
            return "nothing has come yet: run the same command again"
        if self.path is None:
            self.path = str(picture.with_suffix(checkpoint.EXTENSION))
        self.keep()
        again = f"run the same command again, with --checkpoint {self.path}"
        return f"they are kept in {self.path}: to go on, {again}" if self.is_in_place else "they are kept, see above"

    def keep(self) -> None:
        """Write now, if there is where to and what."""
        if self.path is not None and self.renderer.samples > 0:
            with stage(stopwatch.WRITE):
                self.is_in_place = written(Path(self.path), self.renderer.save_checkpoint) == Path(self.path)


class SampleBar:
    """A progress bar on stderr, when that is a terminal and the work is long: samples, seconds, error, seconds left."""

    def __init__(self, renderer: ProgressiveRenderer) -> None:
        self.renderer, self.bar = renderer, None
        if sys.stderr.isatty():  # where there is no bar, tqdm is not loaded either
            from tqdm import tqdm

            options = {"delay": SHOW_PROGRESS_AFTER, "leave": False}
            self.bar = tqdm(total=1.0, bar_format=BAR, desc=renderer.active.name, **options)

    def __enter__(self):
        return self

    def show(self, progress: Progress) -> None:
        """Bring the bar up to date."""
        if self.bar is None:
            return
        left, texts = progress.seconds_left, [f"{self.renderer.samples} spp", f"{progress.seconds:.1f} s"]
        if not math.isnan(progress.error):
            texts.append(f"error {two_digits(progress.error)}")
        if progress.place:
            texts.append(progress.place)
        texts.append("? left" if math.isnan(left) else f"{left:.1f} s left")
        self.bar.set_postfix_str(", ".join(texts), refresh=False)
        done = 0.0 if math.isnan(left) else progress.seconds / max(progress.seconds + left, SHORTEST)
        self.bar.update(max(0.0, done - self.bar.n))

    def __exit__(self, *_error) -> None:
        if self.bar is not None:
            self.bar.close()
