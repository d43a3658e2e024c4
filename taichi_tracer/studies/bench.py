"""Renders the variants of a study: in a process of its own, or in that of the caller if the scene is the caller's."""

import signal
import sys
import time
from concurrent.futures import Future, ProcessPoolExecutor
from multiprocessing import active_children, get_context
from typing import Any, NamedTuple

import numpy as np
import taichi as ti

from taichi_tracer.picture.error_estimate import RelativeError
from taichi_tracer.progressive import ProgressiveRenderer
from taichi_tracer.renderer import A4Renderer
from taichi_tracer.scene_data import SceneData
from taichi_tracer.studies.machine import describe_machine
from taichi_tracer.studies.source import SceneFacts, Source
from taichi_tracer.studies.variants import Variant, renderer_of
from taichi_tracer.system import compiling, registry


class Shot(NamedTuple):
    """A picture in the making.

    Attributes:
        seconds: of the samples that were just added. samples: per pixel, all of this seed.
        error: the estimate of the picture itself. variance: (h, w, 3) of the mean of every pixel.
    """

    seconds: float
    samples: int
    image: np.ndarray
    error: RelativeError
    variance: np.ndarray


class Bench:
    """Renders the variants of one precision.

    Args:
        source: where the scenes come from. size: width and height. parts: files that register parts of the user.
    """

    def __init__(self, source: Source, size: tuple[int, int], arch: str = "auto", parts: tuple[str, ...] = ()) -> None:
        for path in parts:
            registry.load_parts(path)
        self.source, self.size, self.arch = source, size, arch
        self.scenes: dict[tuple, SceneData] = {}
        self.renderers: dict[tuple, ProgressiveRenderer] = {}

    def start(self, variant: Variant) -> SceneFacts:
        """Start Taichi and read the scene of a variant.

        Raises:
            InputError: it has no light.
        """
        self.source.start(variant, self.arch)
        start = time.perf_counter()
        scene = self.scene_of(variant)
        seconds = time.perf_counter() - start
        has_environment = scene.environment is not None
        return SceneFacts(self.source.title(scene), describe_machine(), scene.lamps.count, has_environment, seconds)

    def scene_of(self, variant: Variant) -> SceneData:
        """The scene of a variant, loaded once."""
        if variant.scene not in self.scenes:
            self.scenes[variant.scene] = self.source.load(variant)
        return self.scenes[variant.scene]

    def prepare(self, variant: Variant) -> tuple[float, int]:
        """Compile a variant: (seconds, how many kernels were not found in Taichi's folder)."""
        start, kernels = time.perf_counter(), compiling.kernels_made()
        self.render(variant, 1, seed=0)
        return time.perf_counter() - start, compiling.kernels_made() - kernels

    def render(self, variant: Variant, samples: int, seed: int | None = None) -> Shot:
        """Add samples to the picture of a variant; with a seed, to a new picture with these random numbers."""
        renderer = self.renderer_of(variant)
        if seed is not None:
            renderer.seed = seed
            if isinstance(renderer, A4Renderer):
                renderer.path_settings.set(**variant.paths)
            renderer.use(variant.estimator).begin_anew()
        start = time.perf_counter()
        renderer.render(samples)
        ti.sync()
        seconds, film = time.perf_counter() - start, renderer.film
        variance = np.nan_to_num(film.variance_of_mean()).astype(np.float32)
        return Shot(seconds, renderer.samples, film.image().astype(np.float32), renderer.error(), variance)

    def renderer_of(self, variant: Variant) -> ProgressiveRenderer:
        """The renderer of a variant; one for all estimators of a kind."""
        width, height = (max(1, int(variant.scale * n)) for n in self.size)
        if variant.renderer not in self.renderers:
            make, options = renderer_of(variant.estimator), {"sampler": variant.sampler, "adaptive": variant.adaptive}
            self.renderers[variant.renderer] = make(self.scene_of(variant), width, height, **options)
        return self.renderers[variant.renderer]


_bench: Bench | None = None  # of this process


def begin() -> None:
    """What a ``BenchProcess`` does first: Ctrl-C is for its parent, which then writes what is done."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)


def answer(method: str, words: tuple[Any, ...]) -> Any:
    """Call a method of the bench of this process; "open" makes the bench."""
    global _bench
    if method == "open":
        _bench = Bench(*words)
        return None
    return getattr(_bench, method)(*words)


class BenchProcess:
    """A ``Bench`` in a process of its own."""

    def __init__(self) -> None:
        self.pool = ProcessPoolExecutor(1, get_context("spawn"), begin)
        main = sys.modules["__main__"]
        known = {name: vars(main).get(name) for name in ("__spec__", "__file__")}
        vars(main).update(dict.fromkeys(known))  # the process does not run the program of the user once more
        try:
            self.pool.submit(int)  # starts it
        finally:
            vars(main).update(known)

    def ask(self, method: str, *words: Any) -> Future:
        """Call a method of the bench, after those that were asked for before; "open" makes the bench."""
        return self.pool.submit(answer, method, words)

    def close(self) -> None:
        """End the process; a kernel that it compiles now is lost."""
        self.pool.shutdown(wait=False, cancel_futures=True)
        for child in active_children():
            child.terminate()


class BenchHere:
    """A ``Bench`` in this process, for scenes and parts of the caller that no other process has."""

    def ask(self, method: str, *words: Any) -> Future:
        """Call a method of the bench now."""
        future: Future = Future()
        try:
            future.set_result(answer(method, words))
        except Exception as error:
            future.set_exception(error)
        return future

    def close(self) -> None:
        """Forget the scenes."""
        global _bench
        _bench = None
