"""Where the time of a command goes: the seconds of named stages, which add up to the whole.

A place whose time is of interest says ``with stage(NAME):``. Stages may be nested; then the seconds of the inner stage
do not count for the outer one, so that every moment belongs to exactly one stage. What belongs to none is ``OTHER``.
As long as no stopwatch runs, ``stage`` does nothing.
"""

from collections.abc import Iterator
from contextlib import contextmanager
from time import perf_counter

import taichi as ti

IMPORTS = "Python starts and imports"
TAICHI = "Taichi starts"
READ = "the scene is read"
BUILD = "the hierarchy is built"
LIGHTS = "the tables of the lights are made"
FILM = "camera and film are made"
KERNELS_READ = "kernels: Python reads them"
KERNELS_MADE = "kernels: translated or loaded"
SAMPLES = "samples are taken"  # what eye rays hit is shaded, other rays are traced, and the film takes the values
ERROR = "the error is estimated"
WRITE = "files are written"
OTHER = "other"
STAGES = IMPORTS, TAICHI, READ, BUILD, LIGHTS, FILM, KERNELS_READ, KERNELS_MADE, SAMPLES, ERROR, WRITE, OTHER


class Stopwatch:
    """The seconds of each stage since ``started``.

    Args:
        started: the value of ``time.perf_counter`` at the beginning.
        first: the stage to which the time until now belongs.

    Attributes:
        seconds: stage → seconds.
    """

    def __init__(self, started: float, first: str) -> None:
        self.started = self._since = started
        self.seconds = dict.fromkeys(STAGES, 0.0)
        self.within = OTHER  # the stage that began last
        self.charge(first)

    def charge(self, name: str) -> None:
        """Let the time since the last change of stages belong to ``name``."""
        now = perf_counter()
        self.seconds[name] = self.seconds.get(name, 0.0) + now - self._since
        self._since = now


_running: Stopwatch | None = None


def start(started: float, first: str = IMPORTS) -> Stopwatch:
    """Let a stopwatch run, which gets every ``stage``; see ``Stopwatch``."""
    global _running
    _running = Stopwatch(started, first)
    return _running


def stop() -> None:
    """Let it run no longer, if one runs; its last stage is charged."""
    global _running
    if _running is not None:
        _running.charge(_running.within)
        _running = None


@contextmanager
def stage(name: str, waits: bool = False) -> Iterator[None]:
    """The context of a stage; nothing happens unless a stopwatch runs.

    Args:
        waits: whether the stage ends only when the kernels that it has started are done.
    """
    watch = _running
    if watch is None:
        yield
        return
    watch.charge(watch.within)
    former, watch.within = watch.within, name
    try:
        yield
        if waits:
            ti.sync()
    finally:
        watch.charge(name)
        watch.within = former
