"""Direct illumination, compared with Mitsuba 3: time per sample, and time to a given error.

python -m benchmarks.direct [sample | error ...]
"""

import sys
import time
from collections.abc import Callable

import numpy as np
import taichi as ti

import taichi_tracer as tt
from benchmarks.measure import describe_machine, interleaved, ratio_table
from benchmarks.mitsuba_scenes import MitsubaPicture
from taichi_tracer.files.shipped import shipped_environments
from taichi_tracer.renderer import A2Renderer

SIZE = 512
SPP_PER_CALL = 16
SCALAR_SPP = 4  # samples per call of Mitsuba's scalar variant, which is slower
RUNS = 5


def mitsuba_picture(environment: str, variant: str, size: int, sampler: str = "independent", mis: bool = False):
    """The three spheres under an environment in Mitsuba 3, with its ``direct`` integrator.

    Args:
        mis: multiple importance sampling with the light; otherwise BRDF sampling only.
    """
    integrator = {"type": "direct", "emitter_samples": 1 if mis else 0, "bsdf_samples": 1}
    pixels = np.load(shipped_environments()[environment])
    return MitsubaPicture("specular_spheres", integrator, size, size, variant, sampler, pixels)


def per_sample() -> str:
    """Tables: milliseconds for one sample of every pixel; 512², three spheres under studio, BRDF sampling."""
    scene = tt.load_scene_data("specular_spheres", environment="studio")
    renderer = tt.A2Renderer(scene, SIZE, SIZE, sampler="independent").use("brdf")
    sobol = tt.A2Renderer(scene, SIZE, SIZE).use("brdf")
    scalar = {"Mitsuba scalar_rgb": (mitsuba_picture("studio", "scalar_rgb", SIZE), SCALAR_SPP)}
    calls = {name: lambda p=p, n=n: p.render(n) for name, (p, n) in scalar.items()}
    report = []

    def ours(which):
        which.render(SPP_PER_CALL)
        ti.sync()

    candidates = calls | {
        "taichi_tracer, independent": lambda: ours(renderer),
        "taichi_tracer, sobol": lambda: ours(sobol),
    }
    medians = interleaved(candidates, RUNS)
    medians = {name: s / (SCALAR_SPP if "scalar" in name else SPP_PER_CALL) for name, s in medians.items()}
    report.append(
        ratio_table(f"direct illumination, {SIZE}², BRDF sampling", medians, "Mitsuba scalar_rgb", "ms per sample")
    )
    llvm = mitsuba_picture("studio", "llvm_ad_rgb", SIZE)
    medians = interleaved(
        {
            "Mitsuba llvm_ad_rgb": lambda: llvm.render(SPP_PER_CALL),
            "taichi_tracer, independent": lambda: ours(renderer),
            "taichi_tracer, sobol": lambda: ours(sobol),
        },
        RUNS,
    )
    medians = {name: s / SPP_PER_CALL for name, s in medians.items()}
    report.append(
        ratio_table(f"the same, {SPP_PER_CALL} samples per call", medians, "Mitsuba llvm_ad_rgb", "ms per sample")
    )
    return "".join(report)


ERROR_SIZE = 256
TARGETS = (0.02, 0.01)
OURS = [(e, s) for e in ("environment", "mis") for s in ("sobol", "independent")]
THEIRS = ("multijitter", "ldsampler", "orthogonal")
REFERENCE_SPP, REFERENCE_SEED = 8192, 1000  # of the picture that errors are measured against
MOST_SECONDS, MOST_SPP = 30, 4096  # the measurement of a curve ends at the first of these
# Times the mean of the picture. Pixels above it show the sun in the mirror; they alone would determine the error.
SUN = 50


def relative_rmse(image: np.ndarray, truth: np.ndarray) -> float:
    """RMSE relative to the mean of the reference, over all pixels except those that mirror the sun."""
    others = truth.max(axis=2) < SUN * truth.mean()
    return float(np.sqrt(((image.astype(np.float64) - truth)[others] ** 2).mean()) / truth[others].mean())


def time_to(error_and_seconds: list[tuple[float, float]], target: float) -> float:
    """The time at which the error reaches the target, interpolated linearly between the logarithms of the points."""
    errors, seconds = np.log(np.array(error_and_seconds)).T
    order = np.argsort(errors)
    if not errors.min() <= np.log(target) <= errors.max():
        return np.nan
    return float(np.exp(np.interp(np.log(target), errors[order], seconds[order])))


def curve(
    renderer, error_of: Callable[[np.ndarray], float], most_seconds: float = MOST_SECONDS
) -> list[tuple[float, float]]:
    """(error, seconds) of a picture that doubles its samples; compiling is not counted."""
    renderer.render(3)
    renderer.begin_anew()
    points, seconds, wanted = [], 0.0, 4
    while seconds < most_seconds and wanted <= MOST_SPP:
        start = time.perf_counter()
        renderer.render(wanted - renderer.samples)
        ti.sync()
        seconds += time.perf_counter() - start
        points.append((error_of(renderer.image()), seconds))
        wanted *= 2
    return points


def to_error() -> str:
    """A table: seconds of rendering until 2 % and 1 % relative RMSE; 256², three spheres under sunny."""
    curves = {}
    scene = tt.load_scene_data("specular_spheres", environment="sunny")
    reference = A2Renderer(scene, ERROR_SIZE, ERROR_SIZE, seed=REFERENCE_SEED).use("mis").render(REFERENCE_SPP)
    truth = reference.image().astype(np.float64)
    for estimator, sampler in OURS:
        renderer = A2Renderer(scene, ERROR_SIZE, ERROR_SIZE, sampler=sampler).use(estimator)
        curves[f"taichi_tracer, {estimator}, {sampler}"] = curve(renderer, lambda image: relative_rmse(image, truth))
    for variant in ("llvm_ad_rgb",):
        theirs = mitsuba_picture("sunny", variant, ERROR_SIZE, mis=True).render(REFERENCE_SPP, seed=REFERENCE_SEED)
        their_truth = theirs.astype(np.float64)
        for sampler in THEIRS:
            peer = mitsuba_picture("sunny", variant, ERROR_SIZE, sampler, mis=True)
            points = []
            for spp in (4, 16, 64, 256, 1024):
                peer.render(spp)
                start = time.perf_counter()
                image = peer.render(spp, seed=1)
                points.append((relative_rmse(image, their_truth), time.perf_counter() - start))
            curves[f"Mitsuba {variant}, {sampler}"] = points
    lines = ["\n**time to an error, 256², three spheres under sunny, rendering only**\n"]
    lines += [f"Pixels above {SUN} times the mean, which mirror the sun itself, are left out on both sides.\n"]
    lines += ["| | " + " | ".join(f"s to {t:.0%}" for t in TARGETS) + " |", "|---|" + "--:|" * len(TARGETS)]
    for name, points in curves.items():
        lines.append(f"| {name} | " + " | ".join(f"{time_to(points, t):.2f}" for t in TARGETS) + " |")
    for target in TARGETS:
        best = {who: np.nanmin([time_to(p, target) for n, p in curves.items() if n.startswith(who)]) for who in WHO}
        lines.append(f"\nbest to {target:.0%}: {best[WHO[1]] / best[WHO[0]]:.2f} × Mitsuba's speed\n")
    return "\n".join(lines)


WHO = ("taichi_tracer", "Mitsuba")
PARTS = {"sample": per_sample, "error": to_error}


def report(names: list[str]) -> str:
    """The requested tables."""
    tt.init(arch="auto")
    return "".join(PARTS[name]() for name in names or PARTS)


if __name__ == "__main__":
    print(describe_machine() + report(sys.argv[1:]))
