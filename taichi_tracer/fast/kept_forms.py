"""Which forms were compiled on this machine, and for how long others rendered in their place: kept between processes.

The compiled kernels are kept beside it. A form whose kernels are there costs little, so that it runs from the first
sample on. Whoever has rendered so much without it that it would have paid will do so again: then it is compiled.
"""

import math
import weakref
from pathlib import Path
from typing import Any, NamedTuple

from taichi.lang import impl

from taichi_tracer.system import runtime
from taichi_tracer.system.cache import cache_folder, wanted_folder
from taichi_tracer.system.trial import read, versions, write

FILE = "taichi_tracer_forms.json"  # in the folder of compiled kernels
MOST = 500  # forms that are remembered
COMPILED = 1e9  # in place of seconds: infinity is no number of JSON
LONG = 8.0  # seconds of rendering in which a form gains more than its compilation takes


def key_of(renderer: Any, scene: Any, integrator: Any) -> str:
    """What the kernels of tiles depend on, roughly: a form that is thought to be kept, and is not, is compiled."""
    of_scene = {name: value for name, value in vars(scene.effects).items() if name != "reasons"}
    parts = type(renderer.camera).__name__, renderer.sampler.name, integrator.name, renderer.shares.are_kept
    watched = renderer.watcher is not None
    return f"{of_taichi()} {parts} {watched} {of_scene}"


def key_of_packets(scene_data: Any, camera: Any, sampler: Any) -> str:
    """The same of the packets of eye rays."""
    effects, test = scene_data.geometry.effects, scene_data.ray_intersector.triangle_test
    parts = type(camera).__name__, sampler.name, test, effects.spheres, effects.culling, effects.holes
    return f"{of_taichi()} packets {parts}"


def of_taichi() -> str:
    """The versions, and what Taichi was started with."""
    settings = runtime.current()
    return f"{versions()} {settings.arch} {settings.precision} {settings.fast_math}"


class Least(NamedTuple):
    """From how many samples of pixels on a form gains more time than its start takes.

    Attributes:
        started: where this process has used it. kept: where its kernels are kept, or it would have paid by now. new:
            elsewhere.
    """

    started: float
    kept: float
    new: float = math.inf


class KeptForms:
    """For each key the seconds that were rendered without the form, or ``COMPILED``; the newest ``MOST`` of them."""

    def __init__(self) -> None:
        self._known: dict[str, float] | None = None
        self._started: weakref.WeakKeyDictionary[Any, set[str]] = weakref.WeakKeyDictionary()  # by Taichi's programs

    @staticmethod
    def path() -> Path | None:
        """The file; None if no folder can be written."""
        folder, _ = cache_folder(wanted_folder())
        return None if folder is None else folder / FILE

    def seconds(self, key: str) -> float:
        """How long others have rendered in place of this form; ∞ if it was compiled."""
        if self._known is None:
            path = self.path()
            self._known = {} if path is None else read(path)
        seconds = self._known.get(key, 0.0)
        return math.inf if seconds >= COMPILED else seconds

    def are_worth(self, key: str) -> bool:
        """Whether a form was compiled, or would have paid by now."""
        return self.seconds(key) >= LONG

    def pay_from(self, key: str, least: Least) -> float:
        """From how many samples on a form pays now."""
        if key in self._started.get(impl.get_runtime().prog, ()):
            return least.started
        return least.kept if self.are_worth(key) else least.new

    def start(self, key: str) -> None:
        """Note that this process uses a form, whose kernels are kept from now on."""
        self._started.setdefault(impl.get_runtime().prog, set()).add(key)
        self.add(key, math.inf)

    def add(self, key: str, seconds: float) -> None:
        """Note that others have rendered for so long, or ∞: that it was compiled."""
        known = self.seconds(key)
        path = self.path()
        if path is None or known == math.inf:
            return
        kept = read(path)  # other processes may have written since
        total = min(kept.pop(key, 0.0) + seconds, COMPILED)
        kept[key] = total
        self._known = dict(list(kept.items())[-MOST:])
        write(path, self._known)


KEPT = KeptForms()
