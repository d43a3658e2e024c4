"""Direct illumination, compared with Mitsuba 3: time per sample, and time to a given error.

python -m benchmarks.direct [sample | error ...]
"""

import functools
import math
import sys
from collections.abc import Callable

import numpy as np
import taichi as ti

import taichi_tracer as tt
from benchmarks.measure import describe_machine, interleaved, ratio_table
from benchmarks.meshes import displaced_sphere
from benchmarks.mitsuba_scenes import MitsubaPicture
from benchmarks.scenes import (
    DIRECT,
    SPHERES_VIEW,
    spheres_on_floor,
    spheres_under_sun,
    sun_and_sky,
    their_sky,
    three_spheres,
)
from taichi_tracer.geometry import Mesh

SIZE = 512
SPP_PER_CALL = 16
RUNS = 3
BLOB = 82_000  # triangles
BLOB_VIEW = {"eye": (0.0, 0.5, 2.8), "at": (0.0, 0.0, 0.0), "up": (0.0, 1.0, 0.0), "fov": 60.0}
THEIR_ESTIMATORS = {"brdf": {"type": "direct", "emitter_samples": 0, "bsdf_samples": 1}, "mis": DIRECT}


@functools.cache
def blob() -> Mesh:
    """A displaced sphere."""
    return Mesh(*displaced_sphere(BLOB))


# What makes the scene here, and what makes Mitsuba's picture of it from its integrator.
SCENES: dict[str, tuple[Callable, Callable]] = {
    "three spheres": (
        lambda: tt.load_scene_data("specular_spheres", environment="studio"),
        lambda how, size: MitsubaPicture("specular_spheres", how, size, size, environment=their_sky()),
    ),
    "three spheres on a floor": (
        lambda: spheres_on_floor("studio"),
        lambda how, size: MitsubaPicture(three_spheres(), how, size, size, environment=their_sky(), view=SPHERES_VIEW),
    ),
    f"displaced sphere of {BLOB:,} triangles": (
        lambda: tt.SceneData(blob(), view=BLOB_VIEW, environment="studio"),
        lambda how, size: MitsubaPicture(blob(), how, size, size, environment=their_sky(), view=BLOB_VIEW),
    ),
}


def per_sample() -> str:
    """Tables: milliseconds for one sample of every pixel, for calls of 16 samples."""
    report = ""
    for title, (make_ours, make_theirs) in SCENES.items():
        scene = make_ours()
        for estimator, how in THEIR_ESTIMATORS.items():
            theirs = make_theirs(how, SIZE)
            calls = {"Mitsuba llvm": lambda theirs=theirs: theirs.render(SPP_PER_CALL)}
            renderer = tt.A2Renderer(scene, SIZE, SIZE).use(estimator)
            calls["taichi_tracer"] = lambda renderer=renderer: (renderer.render(SPP_PER_CALL), ti.sync())
            medians = {name: s / SPP_PER_CALL for name, s in interleaved(calls, RUNS).items()}
            report += ratio_table(f"{title}, {SIZE}², {estimator}", medians, "Mitsuba llvm", "ms per sample")
        scene.destroy()
    return report


# ── time to an error ──

ERROR_SIZE = 256
TARGETS = (0.05, 0.02, 0.01)
OURS = ("niederreiter", "niederreiter_two")
THEIRS = ("multijitter", "ldsampler", "orthogonal")
WITH_OPTION = "multijitter with mis_compensation"  # an option of Mitsuba's environments, off by default
COUNTS = (4, 16, 64, 256, 512)
REFERENCE_SPP, REFERENCE_SEED = 4096, 1000  # of the picture that errors are measured against


def relative_rmse(image: np.ndarray, truth: np.ndarray) -> float:
    """RMSE relative to the mean of the reference."""
    return float(np.sqrt(((image.astype(np.float64) - truth) ** 2).mean()) / truth.mean())


def needed(errors: list[float], counts: list[int], target: float) -> float:
    """The number of samples with this error, interpolated between the logarithms; NaN outside the measured counts."""
    logs, at = np.log(np.array(errors)), math.log(target)
    if not logs.min() <= at <= logs.max():
        return math.nan
    return float(np.exp(np.interp(at, logs[::-1], np.log(counts)[::-1])))


def rms(values: list[float]) -> float:
    """The root of the mean of the squares."""
    return math.sqrt(sum(value**2 for value in values) / len(values))


@functools.cache
def curves() -> dict[str, tuple[list[float], list[int], list[float]]]:
    """Name → (errors, real counts, seconds of rendering), for the three spheres on a floor under sun and sky, MIS."""
    scene = spheres_under_sun()
    ours = {name: tt.A2Renderer(scene, ERROR_SIZE, ERROR_SIZE, sampler=name).use("mis") for name in OURS}
    reference = tt.A2Renderer(scene, ERROR_SIZE, ERROR_SIZE, seed=REFERENCE_SEED).use("mis").render(REFERENCE_SPP)
    truth = reference.image().astype(np.float64)
    theirs = {name: their_spheres(name) for name in (*THEIRS, WITH_OPTION)}
    their_truth = theirs["multijitter"].render(REFERENCE_SPP, seed=REFERENCE_SEED).astype(np.float64)
    for renderer in ours.values():
        renderer.render(3)
    found = {name: ([], [], []) for name in (*ours, *theirs)}
    for count in COUNTS:
        images: dict[str, list[np.ndarray]] = {name: [] for name in found}
        calls = {name: functools.partial(ours_of, r, count, images[name]) for name, r in ours.items()}
        calls |= {name: functools.partial(theirs_of, peer, count, images[name]) for name, peer in theirs.items()}
        seconds = interleaved(calls, RUNS)
        for name in found:
            error = rms([relative_rmse(image, truth if name in ours else their_truth) for image in images[name]])
            real = count if name in ours else theirs[name].real_count(count)
            add(found[name], error, real, seconds[name])
    return found


def ours_of(renderer, count: int, images: list[np.ndarray]) -> None:
    """One more of our pictures, with a seed of its own."""
    renderer.seed = len(images)
    renderer.begin_anew()
    images.append(renderer.render(count).image())


def theirs_of(peer: MitsubaPicture, count: int, images: list[np.ndarray]) -> None:
    """One more of Mitsuba's pictures, with a seed of its own."""
    images.append(peer.render(count, seed=len(images) + 1))


def add(curve: tuple[list, list, list], error: float, count: int, seconds: float) -> None:
    """One more point of a curve."""
    for values, value in zip(curve, (error, count, seconds), strict=True):
        values.append(value)


def their_spheres(name: str) -> MitsubaPicture:
    """Mitsuba's picture of the three spheres under sun and sky, with a sampler of ``THEIRS`` or ``WITH_OPTION``."""
    size, sampler, compensates = ERROR_SIZE, name.split()[0], name == WITH_OPTION
    options = {"environment": sun_and_sky(), "view": SPHERES_VIEW, "compensates": compensates}
    return MitsubaPicture(three_spheres(), DIRECT, size, size, sampler=sampler, **options)


def seconds_to(curve, target: float) -> float:
    """Seconds of rendering to an error: the samples that it needs, at the speed of the counts beside them."""
    errors, counts, seconds = curve
    count = needed(errors, counts, target)
    return float(np.exp(np.interp(math.log(count), np.log(counts), np.log(seconds)))) if count == count else math.nan


def to_error() -> str:
    """A table: samples and seconds to 5, 2 and 1 %, and how the ratio divides into samples and speed."""
    found = curves()
    lines = [
        f"\n**time to an error, {ERROR_SIZE}², three spheres on a floor under sun and sky, mis, rendering only**\n"
    ]
    head = [f"samples to {t:.0%} | s to {t:.0%}" for t in TARGETS]
    lines += [f"| | {' | '.join(head)} | ms per sample |", "|---|" + "--:|" * (2 * len(TARGETS) + 1)]
    for name, curve in found.items():
        cells = [f"{needed(*curve[:2], t):.0f} | {seconds_to(curve, t):.3g}" for t in TARGETS]
        label = f"taichi_tracer, {name}" if name in OURS else f"Mitsuba llvm, {name}"
        lines.append(f"| {label} | {' | '.join(cells)} | {1e3 * curve[2][-1] / curve[1][-1]:.3g} |")
    for target in TARGETS:
        for peers, what in ((THEIRS, "Mitsuba's speed"), ((WITH_OPTION,), f"that of {WITH_OPTION}")):
            ours, theirs = best(found, OURS, target), best(found, peers, target)
            if math.isnan(ours[0] + theirs[0]):
                continue
            samples = theirs[1] / ours[1]
            ratio = theirs[0] / ours[0]
            lines.append(
                f"\nTo {target:.0%}: {ratio:.2f} × {what} = {samples:.2f} by the samples needed × "
                f"{ratio / samples:.2f} by the time of a sample."
            )
    return "\n".join(lines) + "\n"


def best(found: dict, names: tuple[str, ...], target: float) -> tuple[float, float]:
    """(seconds, samples) of the fastest of some curves; NaN if none reaches the target."""
    times = [(seconds_to(found[name], target), needed(*found[name][:2], target)) for name in names]
    return min((pair for pair in times if pair[0] == pair[0]), default=(math.nan, math.nan))


PARTS = {
    "sample": per_sample,
    "error": to_error,
}


def report(names: list[str]) -> str:
    """The requested tables."""
    tt.init(arch="auto")
    return "".join(PARTS[name]() for name in names or PARTS)


if __name__ == "__main__":
    print(describe_machine() + report(sys.argv[1:]))
