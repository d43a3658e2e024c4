"""What would it cost to simulate the effects that a scene does not call for?

The same picture is rendered by code compiled for the scene, by code with one more effect each, and by code with all of
them. The pictures are equal to the last bit; seconds of compilation and milliseconds per sample are not.
"""

import math
import random
import statistics
import time
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
import taichi as ti

from taichi_tracer.effects import Effects
from taichi_tracer.progressive import ProgressiveRenderer
from taichi_tracer.sampler import DEFAULT_SAMPLER
from taichi_tracer.scene_data import SceneData
from taichi_tracer.studies.study import Interval
from taichi_tracer.studies.tables import in_columns
from taichi_tracer.studies.variants import renderer_of
from taichi_tracer.system.errors import digits

RUNS = 9  # of each variant, in turn
SPP, LEAST_SECONDS = 4, 0.04  # samples of a run, and its seconds at least
SAME = 1.08  # the ends of an interval around 1: times that are the same differ by no more
USUAL, EVERYTHING = "what the scene needs", "all effects"


@dataclass(frozen=True)
class CompiledVariant:
    """One way to compile the same picture.

    Attributes:
        name: the effect that was added, or ``USUAL``, ``EVERYTHING``.
        compile_seconds: of the first sample, beyond the time of any other.
        milliseconds: median, of one sample of every pixel.
        is_equal: whether the picture is that of the first variant, bit for bit.
        ratio: its time as a multiple of that of the first variant.
    """

    name: str
    compile_seconds: float
    milliseconds: float
    is_equal: bool
    ratio: Interval = Interval(1.0, 1.0, 1.0)


# What a table calls an effect that is not compiled → the attribute of ``Effects`` in which it differs from all.
ATTRIBUTES = {"look-up": "environment", "emitters": "emitters", "shadow rays": "blockers", "light and BRDF": "scatters"}


def with_one_more(scene: SceneData, every: Effects) -> dict[str, Effects]:
    """Name → the scene's effects and one of all that it does not call for."""
    effects, variants = scene.effects, {}
    for i, brdf in enumerate(scene.material_library.brdfs):
        if i not in effects.brdfs and set(brdf.parameters) <= set(scene.material_library.members):
            variants[brdf.name] = replace(effects, brdfs=tuple(sorted({*effects.brdfs, i})))
    for name, attribute in ATTRIBUTES.items():
        if getattr(effects, attribute) != getattr(every, attribute):
            variants[name] = replace(effects, **{attribute: getattr(every, attribute)})
    return variants


def compile_for(effects: Effects, renderer: ProgressiveRenderer) -> None:
    """Let a renderer's kernels get the scene as it is compiled for other effects than the scene calls for."""
    active = renderer.active
    compiled = renderer.scene_data.in_kernels(effects, active.compensates, active.microfacets)
    vars(renderer)["kernel_scene"] = lambda: compiled


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
    more = with_one_more(scene, complete.effects)
    renderers = {name: usual(scene, *size, sampler=sampler).use(estimator) for name in (USUAL, *more)}
    renderers[EVERYTHING] = usual(complete, *size, sampler=sampler).use(estimator)
    for name, effects in more.items():
        compile_for(effects, renderers[name])
    first, pictures, seconds = {}, {}, {name: [] for name in renderers}
    for name, renderer in renderers.items():
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
        ratio = ratio_of(seconds[name], seconds[USUAL])
        found.append(CompiledVariant(name, first[name] - middle, 1e3 * middle, is_equal, ratio))
    return found


def ratio_of(seconds: list[float], base: list[float]) -> Interval:
    """The median of the ratios of ``RUNS`` runs that took turns.

    The median of all lies between the second smallest and the second largest of nine ratios with a probability of 96 %:
    it is improbable, 20 of 2⁹, that at most one of them falls on one side of it.
    """
    ratios = sorted(a / b for a, b in zip(seconds, base, strict=True))
    return Interval(statistics.median(ratios), ratios[1], ratios[-2])


def timed(renderer: ProgressiveRenderer, spp: int) -> float:
    """Seconds of ``spp`` samples."""
    start = time.perf_counter()
    renderer.render(spp)
    ti.sync()
    return time.perf_counter() - start


def in_words(ratio: Interval) -> str:
    """How much longer a sample takes, with the 95 % interval; or that the difference may be noise."""
    value, low, high = ratio
    if not low <= 1 <= high:
        return f"× {value:.2f} ({low:.2f} to {high:.2f})"
    return "the same" if high / low < SAME else f"noise ({low:.2g} to {high:.2g})"


def table(variants: list[CompiledVariant], reasons: Sequence[tuple[str, bool, str]] = ()) -> list[str]:
    """Lines of text: every effect, whether it is compiled, why, and what it would cost.

    Args:
        reasons: (effect, whether it is compiled, why), as in ``Effects.reasons``.
    """
    measured, why = {v.name: v for v in variants}, {name: (is_on, text) for name, is_on, text in reasons}
    rows = []
    for name in dict.fromkeys([variants[0].name, *why, *measured]):
        is_on, text = why.get(name, (name == variants[0].name, ""))
        row = {"effect": name, "compiled": "yes" if is_on else "no", "compiling takes": "", "time of a sample": ""}
        if name in measured:
            v = measured[name]
            time_of_sample = f"{v.milliseconds:.2f} ms" if v is variants[0] else in_words(v.ratio)
            row["compiling takes"] = f"{digits(v.compile_seconds, '.2f')} s"
            row["time of a sample"] = time_of_sample if v.is_equal else "DIFFERENT PICTURE"
        rows.append(row | {"why": text})
    return [*in_columns(rows), *LEGEND]


LEGEND = (
    "Beside an effect that is not compiled: the same picture, by code that has this effect, too. × 1.10: 10 % slower",
    "than with what the scene needs; in brackets, the 95 % interval. noise: it contains 1, so that chance explains it.",
)
