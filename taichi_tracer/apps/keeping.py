"""Samples are added to a picture while a bar grows, and are kept in a checkpoint, so that nothing is lost."""

import contextlib
import math
import time
from collections.abc import Callable
from pathlib import Path

from tqdm import tqdm

from taichi_tracer.apps.console import note
from taichi_tracer.apps.running import Interruption, written
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
    target: Target,
    interruption: Interruption,
    render: Callable[..., object],
    checkpoint: str | None = None,
    every: float = math.inf,
) -> None:
    """Render until a target is reached or a signal came.

    Args:
        render: ``renderer.render``, or what takes its place.
        checkpoint: a file to go on from if it exists, and to which the samples go in the end. every: seconds after
            which they go there, too; a disk that is full then may have room by the next time.
    """
    spp, kept_at = target.spp, time.perf_counter()
    if checkpoint is not None and Path(checkpoint).exists():
        renderer.load_checkpoint(checkpoint)
        print(f"{checkpoint}: going on after {renderer.samples} samples")
        spp = None if spp is None else spp - renderer.samples
        if spp is not None and spp <= 0:
            return
    options = {"desc": renderer.active.name, "disable": None, "delay": SHOW_PROGRESS_AFTER, "leave": False}
    with tqdm(total=1.0, bar_format=BAR, **options) as bar, contextlib.suppress(RenderingStopped):

        def watch(progress: Progress) -> None:
            """After each sample: bring the bar up to date, keep a checkpoint if it is due, and stop after a signal."""
            nonlocal kept_at
            show(bar, progress, renderer.samples)
            if checkpoint is not None and renderer.samples > 0 and time.perf_counter() - kept_at > every:
                kept_at = time.perf_counter()
                try:
                    renderer.save_checkpoint(checkpoint)
                except InputError as error:
                    note(f"{error}: rendering goes on")
            if interruption.number is not None:
                raise RenderingStopped

        render(spp=spp, time=target.time, error=target.error, watch=watch)
    if checkpoint is not None and renderer.samples > 0:
        with stage(stopwatch.WRITE):
            written(Path(checkpoint), renderer.save_checkpoint)


def show(bar: tqdm, progress: Progress, samples: int) -> None:
    """Bring a bar up to date: samples, seconds, error, seconds left."""
    left, error = progress.seconds_left, f"error {percent(progress.error)}"
    rest = f"{left:.1f} s left" if left >= 0 else "? left"
    texts = [f"{samples} spp", f"{progress.seconds:.1f} s", progress.place, error, rest]
    bar.set_postfix_str(", ".join(filter(None, texts)), refresh=False)
    if left >= 0:
        bar.update(max(0.0, progress.seconds / max(progress.seconds + left, SHORTEST) - bar.n))
