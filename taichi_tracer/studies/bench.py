"""Renders the variants of a study: in a process of its own, or in a thread if the scene is the caller's."""

import signal
import sys
import time
from concurrent.futures import Executor, Future, ProcessPoolExecutor, ThreadPoolExecutor
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
from taichi_tracer.system.parts import registry


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
    """Renders the variants of one precision. The first call starts Taichi.

    Args:
        source: where the scenes come from. size: width and height. parts: files that register parts of the user.
    """

    def __init__(self, source: Source, size: tuple[int, int], arch: str = "auto", parts: tuple[str, ...] = ()) -> None:
        for path in parts:
            registry.load_parts(path)
        self.source, self.size, self.arch = source, size, arch
        self.scenes: dict[tuple, SceneData] = {}
        self.renderers: dict[tuple, ProgressiveRenderer] = {}

    def facts(self, variant: Variant) -> SceneFacts:
        """Read the scene of a variant, and describe it.

        Raises:
            InputError: it has no light.
        """
        self.start(variant)
        start = time.perf_counter()
        scene = self.scene_of(variant)
        seconds = time.perf_counter() - start
        has_environment = scene.environment is not None
        return SceneFacts(self.source.title(scene), describe_machine(), scene.lamps.count, has_environment, seconds)

    def start(self, variant: Variant) -> None:
        """Start Taichi in the precision of a variant, once."""
        if not self.scenes:
            self.source.start(variant, self.arch)

    def scene_of(self, variant: Variant) -> SceneData:
        """The scene of a variant, loaded once."""
        self.start(variant)
        if variant.scene not in self.scenes:
            self.scenes[variant.scene] = self.source.load(variant)
        return self.scenes[variant.scene]

    def prepare(self, variant: Variant) -> float:
        """Compile a variant, or load what an earlier run compiled: the seconds."""
        start = time.perf_counter()
        self.render(variant, 1, seed=0)
        return time.perf_counter() - start

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


def begin(is_process: bool, *words: Any) -> None:
    """Make the bench of this process. A process leaves Ctrl-C to its parent, which then writes what is done."""
    global _bench
    if is_process:
        signal.signal(signal.SIGINT, signal.SIG_IGN)
    _bench = Bench(*words)


def answer(method: str, words: tuple[Any, ...]) -> Any:
    """Call a method of the bench of this process."""
    return getattr(_bench, method)(*words)


class Worker:
    """A ``Bench`` in a process of its own, or in a thread, for scenes and parts that no other process has.

    Args:
        words: the arguments of ``Bench``.
    """

    def __init__(self, *words: Any) -> None:
        self.pool: Executor
        if words[0].here:
            self.pool = ThreadPoolExecutor(1, initializer=begin, initargs=(False, *words))
            self.ready = self.pool.submit(int)
        else:
            self.pool = ProcessPoolExecutor(1, get_context("spawn"), begin, (True, *words))
            main = sys.modules["__main__"]
            known = {name: vars(main).get(name) for name in ("__spec__", "__file__")}
            vars(main).update(dict.fromkeys(known))  # the process does not run the program of the user once more
            self.ready = self.pool.submit(int)  # starts it
            vars(main).update(known)

    def ask(self, method: str, *words: Any) -> Future:
        """Call a method of the bench, after those that were asked for before."""
        return self.pool.submit(answer, method, words)

    def close(self) -> None:
        """End the process, with what it does now; a thread ends after it."""
        self.pool.shutdown(wait=False, cancel_futures=True)
        for child in active_children():
            child.terminate()
