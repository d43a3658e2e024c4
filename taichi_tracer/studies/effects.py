"""What would it cost to simulate the effects that a scene does not call for?

The same picture is rendered by code compiled for the scene, by code with one more effect each, and by code with all of
them. The pictures are equal to the last bit; seconds of compilation and milliseconds per sample are not.
"""

import math
import random
import statistics
import time
from dataclasses import dataclass, replace

import numpy as np
import taichi as ti

from taichi_tracer.effects import Effects
from taichi_tracer.progressive import ProgressiveRenderer
from taichi_tracer.sampler import DEFAULT_SAMPLER
from taichi_tracer.scene_data import SceneData
from taichi_tracer.scene_in_kernels import SceneInKernels
from taichi_tracer.studies.variants import renderer_of
from taichi_tracer.system.digits import digits

RUNS = 9  # of each variant, in turn
SPP, LEAST_SECONDS = 4, 0.04  # samples of a run, and its seconds at least
SAME = 1.08  # the ends of an interval around 1: times that are the same differ by no more
USUAL, EVERYTHING = "as the scene needs", "everything"


@dataclass(frozen=True)
class CompiledVariant:
    """One way to compile the same picture.

    Attributes:
        name: the effect that was added, or ``USUAL``, ``EVERYTHING``.
        compile_seconds: of the first sample, beyond the time of any other.
        milliseconds: median, of one sample of every pixel.
        is_equal: whether the picture is that of the first variant, bit for bit.
        ratio, low, high: its time as a multiple of that of the first variant, and the 95 % interval.
    """

    name: str
    compile_seconds: float
    milliseconds: float
    is_equal: bool
    ratio: float = 1.0
    low: float = 1.0
    high: float = 1.0


def with_one_more(scene: SceneData) -> dict[str, Effects]:
    """Name → the scene's effects and one that it does not call for."""
    effects, variants = scene.effects, {}
    for i, brdf in enumerate(scene.material_library.brdfs):
        if i not in effects.brdfs and set(brdf.parameters) <= set(scene.material_library.members):
            variants[f"+ {brdf.name}"] = replace(effects, brdfs=tuple(sorted({*effects.brdfs, i})))
    if effects.environment in ("black", "constant"):
        variants["+ environment look-up"] = replace(effects, environment="image")
    if not effects.emitters:
        variants["+ emitters"] = replace(effects, emitters=True)
    if effects.is_lit and effects.blockers != "all":
        variants["+ shadow rays"] = replace(effects, blockers="all")
    if effects.is_lit and not effects.scatters:
        variants["+ light and BRDF"] = replace(effects, scatters=True)
    return variants


def compiled_for(effects: Effects, renderer_class: type[ProgressiveRenderer]) -> type[ProgressiveRenderer]:
    """A renderer whose kernels are compiled for other effects than the scene calls for."""

    class WithEffects(renderer_class):
        """The renderer, but that its kernels get the scene as it is compiled for ``effects``."""

        _compiled: SceneInKernels | None = None

        def kernel_scene(self) -> SceneInKernels:
            """What the kernels know of the scene."""
            if self._compiled is None:
                self._compiled = self.scene_data.in_kernels(effects, self.active.compensates, self.active.microfacets)
            return self._compiled

    return WithEffects


def measure(
    scene: SceneData,
    complete: SceneData,
    estimator: str = "brdf",
    width: int = 512,
    height: int = 512,
    sampler: str = DEFAULT_SAMPLER,
) -> list[CompiledVariant]:
    """A ``CompiledVariant`` for the scene as it is, for each effect more, and for all.

    Args:
        scene: compiled for what it calls for.
        complete: the same scene, made with ``effects="all"``.
    """
    usual, size = renderer_of(estimator), (width, height)
    renderers = {USUAL: usual(scene, *size, sampler=sampler)}
    for name, more in with_one_more(scene).items():
        renderers[name] = compiled_for(more, usual)(scene, *size, sampler=sampler)
    renderers[EVERYTHING] = usual(complete, *size, sampler=sampler)
    first, pictures, seconds = {}, {}, {name: [] for name in renderers}
    for name, renderer in renderers.items():
        renderer.use(estimator)
        first[name] = timed(renderer, 1)
        pictures[name] = renderer.render(SPP - 1).image()
    spp = max(SPP, math.ceil(LEAST_SECONDS * SPP / timed(renderers[USUAL], SPP)))
    for run in range(RUNS):  # in another order each time, so that none is always measured after the same one
        for name in random.Random(run).sample(list(renderers), len(renderers)):
            timed(renderers[name], 1)  # which brings its memory into the caches
            seconds[name].append(timed(renderers[name], spp) / spp)
    found = []
    for name in renderers:
        middle, is_equal = statistics.median(seconds[name]), np.array_equal(pictures[name], pictures[USUAL])
        ratios = ratio_of(seconds[name], seconds[USUAL])
        found.append(CompiledVariant(name, first[name] - middle, 1e3 * middle, is_equal, *ratios))
    return found


def ratio_of(seconds: list[float], base: list[float]) -> tuple[float, float, float]:
    """(median, low, high) of the ratios of runs that took turns.

    Of n ratios, the median of all lies between the k-th smallest and the k-th largest with a probability of 95 % if it
    is improbable that fewer than k of n fall on one side of it.
    """
    ratios = sorted(a / b for a, b in zip(seconds, base, strict=True))
    n, k, chance = len(ratios), 0, 0.0
    while chance + math.comb(n, k) / 2**n <= 0.025:
        chance += math.comb(n, k) / 2**n
        k += 1
    k = max(0, k - 1)
    return statistics.median(ratios), ratios[k], ratios[n - 1 - k]


def timed(renderer: ProgressiveRenderer, spp: int) -> float:
    """Seconds of ``spp`` samples."""
    start = time.perf_counter()
    renderer.render(spp)
    ti.sync()
    return time.perf_counter() - start


def in_words(ratio: float, low: float, high: float) -> str:
    """A ratio of times with its 95 % interval, or that it cannot be told from 1."""
    if not low <= 1 <= high:
        return f"{ratio:.2f} ({low:.2f} to {high:.2f})"
    return "1.00 (the same)" if high / low < SAME else f"noise ({low:.2g} to {high:.2g})"


def table(variants: list[CompiledVariant]) -> list[str]:
    """Lines of text: what each variant took, and how much more than the first; what is only noise is called so."""
    width = max(len(v.name) for v in variants)
    lines = [f"{'compiled for':<{width}}  compile s  ms per sample  {'times the first':<24} picture"]
    for v in variants:
        same = "the same bits" if v.is_equal else "DIFFERENT"
        ratio = "1" if v is variants[0] else in_words(v.ratio, v.low, v.high)
        compiling = digits(v.compile_seconds, "9.2f")
        lines.append(f"{v.name:<{width}}  {compiling}  {v.milliseconds:13.2f}  {ratio:<24} {same}")
    return [*lines, "Noise cannot be told from 1. In brackets: the 95 % interval."]
