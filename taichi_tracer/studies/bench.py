"""Where the pictures of a study are rendered: one Taichi, its scenes and renderers, and the time of every block.

The study itself knows no Taichi. It asks a ``Bench``, which is in a process of its own (``workers``), or in that of the
caller where the scene is the caller's.
"""

import time
from dataclasses import dataclass

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

WARM_UP = 3  # samples: after them everything is compiled
TRIAL = 8  # samples more, from which the plan learns what a sample takes


@dataclass(frozen=True)
class Prepared:
    """What it took until a variant was ready.

    Attributes:
        compile_seconds: beyond the time of rendering.
        new_kernels, seconds_to_save: kernels that were not in Taichi's folder, and what a second run is spared.
        seconds_per_sample: of the picture, in a short trial.
    """

    compile_seconds: float
    new_kernels: int
    seconds_to_save: float
    seconds_per_sample: float


@dataclass(frozen=True)
class Shot:
    """A picture in the making.

    Attributes:
        seconds: of the samples that were just added. pilot_seconds: of the pilot of adaptive sampling before them.
        samples: per pixel, all of this seed.
        image, error: None if the picture was not asked for; the error is what the picture tells of itself.
        variance: (h, w, 3) of the mean of every pixel; None if it was not asked for.
    """

    seconds: float
    pilot_seconds: float
    samples: int
    image: np.ndarray | None = None
    error: RelativeError | None = None
    variance: np.ndarray | None = None


class Bench:
    """Renders the variants of one precision.

    Args:
        source: where the scenes come from. parts: files that register parts of the user.
        threads: how many processors kernels use; None for all.
    """

    def __init__(
        self, source: Source, arch: str = "auto", parts: tuple[str, ...] = (), threads: int | None = None
    ) -> None:
        for path in parts:
            registry.load_parts(path)
        self.source, self.arch, self.threads = source, arch, threads
        self.scenes: dict[tuple, SceneData] = {}
        self.renderers: dict[tuple, ProgressiveRenderer] = {}
        self.read_seconds: dict[tuple, float] = {}
        self.is_started = False

    def scene_of(self, variant: Variant) -> SceneData:
        """The scene of a variant, loaded once; the first one starts Taichi."""
        if not self.is_started:
            self.source.start(variant, self.arch, self.threads)
            self.is_started = True
        if variant.scene not in self.scenes:
            start = time.perf_counter()
            self.scenes[variant.scene] = self.source.load(variant)
            self.read_seconds[variant.scene] = time.perf_counter() - start
        return self.scenes[variant.scene]

    def facts(self, variant: Variant) -> SceneFacts:
        """What the scene of a variant is.

        Raises:
            InputError: it has no light.
        """
        scene = self.scene_of(variant)
        return SceneFacts(
            self.source.title(scene),
            scene.source,
            describe_machine(),
            scene.lamps.count,
            scene.environment is not None,
            scene.geometry.n_primitives,
            self.read_seconds[variant.scene],
        )

    def prepare(self, variant: Variant, size: tuple[int, int]) -> Prepared:
        """Compile a variant, and render a few samples of it."""
        before, kernels = compiling.seconds_to_save(), compiling.kernels_made()
        start = time.perf_counter()
        renderer = self.renderer_of(variant, size)
        self.begin(variant, size, 0)
        renderer.render(WARM_UP, watch=lambda _: None)
        renderer.film.image(), renderer.film.spread()
        ti.sync()
        took, start = time.perf_counter() - start, time.perf_counter()
        renderer.render(TRIAL)
        ti.sync()
        per_sample = (time.perf_counter() - start) / TRIAL
        return Prepared(
            max(0.0, took - WARM_UP * per_sample),
            compiling.kernels_made() - kernels,
            compiling.seconds_to_save() - before,
            per_sample,
        )

    def render(
        self, variant: Variant, size: tuple[int, int], samples: int, seed: int | None = None, wants: str = ""
    ) -> Shot:
        """Add samples to the picture of a variant.

        Args:
            seed: begin anew with these random numbers; None goes on.
            wants: "image" for the picture and its error, "variance" for that of its pixels too.
        """
        renderer = self.renderer_of(variant, size)
        pilot = 0.0
        if seed is not None:
            self.begin(variant, size, seed)
        start = time.perf_counter()
        renderer.render(samples)
        ti.sync()
        seconds = time.perf_counter() - start
        if seed is not None and renderer.progress.pilot is not None:
            pilot = renderer.progress.pilot.seconds
        image = error = variance = None
        if wants:
            image, error = renderer.film.image(), renderer.error()
        if wants == "variance":
            variance = renderer.film.variance_of_mean().astype(np.float32)
        return Shot(max(seconds - pilot, 0.0), pilot, renderer.samples, image, error, variance)

    def begin(self, variant: Variant, size: tuple[int, int], seed: int) -> None:
        """Start the picture of a variant over with other random numbers."""
        renderer = self.renderer_of(variant, size)
        renderer.seed = seed
        as_variant(renderer, variant).begin_anew()

    def renderer_of(self, variant: Variant, size: tuple[int, int]) -> ProgressiveRenderer:
        """The renderer of a variant; one for all estimators."""
        width, height = (max(1, int(variant.scale * n)) for n in size)
        if variant.film not in self.renderers:
            renderer_class, scene = renderer_of(variant.estimator), self.scene_of(variant)
            self.renderers[variant.film] = make(renderer_class, scene, variant, (width, height))
        return self.renderers[variant.film]


def make(
    renderer_class: type[ProgressiveRenderer], scene: SceneData, variant: Variant, size: tuple[int, int]
) -> ProgressiveRenderer:
    """A renderer of a variant."""
    width, height = size
    renderer = renderer_class(scene, width, height, sampler=variant.sampler, adaptive=variant.adaptive)
    return as_variant(renderer, variant)


def as_variant(renderer: ProgressiveRenderer, variant: Variant) -> ProgressiveRenderer:
    """The renderer, with the estimator of a variant, and with the length of its paths."""
    if isinstance(renderer, A4Renderer):
        renderer.path_settings.set(**variant.paths)
    return renderer.use(variant.estimator)
