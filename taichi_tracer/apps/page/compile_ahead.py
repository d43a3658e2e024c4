"""What was chosen, and its kernels, which another process compiles before it is shown.

While Taichi translates a kernel, nothing else of a process runs. The other process renders a small picture with the
settings of the choice, while the old picture still moves; Taichi keeps its kernels in the cache of the user, from which
this process then reads them.
"""

import subprocess
import sys
import time
from collections.abc import Callable
from dataclasses import dataclass, field, replace
from pathlib import Path

from taichi_tracer.settings import RenderSettings

SIDE, SPP = 64, 2  # of the picture of the other process: two samples have an error, too
START = 1.0  # seconds that the other process takes to start
NOTICE = 0.15  # seconds in which a page can show that something will take time, before nothing runs
# How long the first picture takes to compile, as a multiple of that of a view.
COSTS = {"view": 1.0, "map": 2.0, "estimator": 3.0, "path": 4.0}


@dataclass
class Choice:
    """Something that was chosen, and that takes time.

    Attributes:
        text: what happens, in words. about: seconds that it may take. take: shows what was chosen.
        began: when it was chosen, on the clock of ``time.monotonic``.
        process: the one that compiles; None if this one must.
    """

    text: str
    about: float
    take: Callable[[], None]
    process: "subprocess.Popen | None" = None
    began: float = field(default_factory=time.monotonic)

    @property
    def is_due(self) -> bool:
        """Whether it can be shown now."""
        if self.process is not None:
            return self.process.poll() is not None
        return time.monotonic() - self.began > NOTICE

    def cancel(self) -> None:
        """Give it up."""
        if self.process is not None:
            self.process.kill()
            self.process.wait()


def compiling_process(settings: RenderSettings, folder: str) -> subprocess.Popen:
    """A process that compiles what a picture with these settings needs; its picture is written into a folder."""
    small = replace(settings, size=(SIDE, SIDE), crop=None, bounces=(), spp=SPP, time=None, error=None, adaptive=None)
    place = str(Path(folder) / "compiled.png")
    words = [sys.executable, "-m", "taichi_tracer", "render", small.scene, *small.words(), "-o", place]
    return subprocess.Popen(words, stdin=subprocess.DEVNULL, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
