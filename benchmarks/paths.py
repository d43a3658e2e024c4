"""Paths, compared with Mitsuba 3: time per sample, and time to a given error.

python -m benchmarks.paths [sample | error ...]
"""

import sys
import time
from collections.abc import Callable

import numpy as np
import taichi as ti

import taichi_tracer as tt
from benchmarks.direct import BLOB, BLOB_VIEW, RUNS, SPP_PER_CALL, relative_rmse
from benchmarks.measure import describe_machine, interleaved, ratio_table
from benchmarks.meshes import displaced_sphere
from benchmarks.mitsuba_scenes import MitsubaPicture, path
from benchmarks.scenes import sun_and_sky
from taichi_tracer.geometry import Mesh
from taichi_tracer.materials import Material

SCENE = "cornell_box"
SIZE, BOUNCES = 512, 5  # of the time per sample
ERROR_SIZE = 256
TARGETS = (0.05, 0.02, 0.01)
USUAL = "path"  # the estimator by default
THEIRS = ("multijitter", "ldsampler")  # the best of its samplers on these scenes
SPP = (4, 16, 64, 256, 1024)  # of the points of a curve of Mitsuba's
MOST_SECONDS, MOST_SPP, LEAST_ERROR = 20, 4096, 1e-6  # a curve of ours ends at the first of these
FIRST_LOOK, LATER = 0.05, 1.25  # seconds of the first of its points, and times those of the last one
REFERENCE_SPP, REFERENCE_SEEDS = 512, (1000, 1001)


def renderer_of(scene, size: int, how: str, bounces: int, sampler: str | None = None, seed: int = 0):
    """A renderer of paths."""
    renderer = tt.A4Renderer(scene, size, size, sampler=sampler, seed=seed).use(how)
    renderer.max_bounces = bounces
    return renderer


def per_sample() -> str:
    """A table: milliseconds for one sample of every pixel."""
    scene = tt.load_scene_data(SCENE)
    ours = {
        f"{how}, {s}": renderer_of(scene, SIZE, how, BOUNCES, s)
        for how in WAYS
        for s in ("niederreiter", "independent")
    }
    theirs = MitsubaPicture(SCENE, path(BOUNCES), SIZE, SIZE)

    def render(renderer) -> None:
        renderer.render(SPP_PER_CALL)
        ti.sync()

    calls: dict[str, Callable[[], object]] = {"Mitsuba path, llvm": lambda: theirs.render(SPP_PER_CALL)}
    calls |= {name: lambda r=renderer: render(r) for name, renderer in ours.items()}
    medians = {name: s / SPP_PER_CALL for name, s in interleaved(calls, RUNS).items()}
    title = f"{SCENE}, {SIZE}², {BOUNCES} bounces, {SPP_PER_CALL} samples per call"
    return ratio_table(title, medians, "Mitsuba path, llvm", "ms per sample")


WAYS = ("explicit", "path", "implicit")


def error_to(*truths: np.ndarray) -> Callable[[np.ndarray], float]:
    """The function picture → its ``relative_rmse``; of two references, the noise is subtracted that they show."""
    exact = np.mean(truths, axis=0, dtype=np.float64)
    noise = float(np.mean((truths[0].astype(np.float64) - truths[-1]) ** 2)) / 4 / exact.mean() ** 2
    return lambda image: max(relative_rmse(image, exact) ** 2 - noise, 1e-12) ** 0.5


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
    """(error, seconds) of a picture that is rendered to an error, from time to time; compiling is not counted."""
    points, next_look = [], FIRST_LOOK

    def look(progress) -> None:
        nonlocal next_look
        if progress.is_speed_known and progress.seconds >= next_look:
            points.append((error_of(renderer.image()), progress.seconds))
            next_look = LATER * progress.seconds

    renderer.render(MOST_SPP, most_seconds, error=LEAST_ERROR, watch=look)
    return points


def their_curve(peer: MitsubaPicture, error_of: Callable[[np.ndarray], float]) -> list[tuple[float, float]]:
    """(error, seconds) of Mitsuba's pictures."""
    points = []
    for spp in SPP:
        peer.render(spp)
        start = time.perf_counter()
        image = peer.render(spp, seed=1)
        points.append((error_of(image), time.perf_counter() - start))
    return points


def scan_on_floor() -> Mesh:
    """A displaced sphere on a floor."""
    vertices, faces = displaced_sphere(BLOB)
    floor = np.array([[-6, -1.2, 6], [6, -1.2, 6], [6, -1.2, -6], [-6, -1.2, -6]], float)
    return Mesh(
        vertices=np.concatenate([floor, vertices]),
        faces=np.concatenate([[[0, 1, 2], [0, 2, 3]], faces + 4]),
        face_materials=np.repeat([0, 1], [2, len(faces)]),
        materials=[Material("floor", Kd=(0.5, 0.5, 0.5)), Material("scan", Kd=(0.6, 0.5, 0.4))],
    )


# Title → (a shipped scene or a mesh, the radiance of its environment, the view, bounces).
PICTURES: dict[str, Callable[[], tuple]] = {
    "cornell_box, its lamp alone": lambda: (SCENE, None, None, 1),
    "cornell_box, 6 segments": lambda: (SCENE, None, None, 6),
    "veach_plates, 6 segments": lambda: ("veach_plates", None, None, 6),
    "a scan on a floor under a sky, 3 bounces": lambda: (scan_on_floor(), sun_and_sky(), BLOB_VIEW, 3),
}


def to_error() -> str:
    """Tables: seconds of rendering to an error, of ours as a user gets it, and of Mitsuba with its samplers."""
    tables = []
    for title, make in PICTURES.items():
        tables.append(error_table(title, *make()))
        print(tables[-1], file=sys.stderr, flush=True)
    return "".join(tables)


def error_table(title: str, scene: str | Mesh, environment: np.ndarray | None, view: dict | None, bounces: int) -> str:
    """The seconds to each error of ``TARGETS``; its last lines compare the estimator by default with Mitsuba's best."""
    is_shipped = isinstance(scene, str)
    ours = tt.load_scene_data(scene) if is_shipped else tt.SceneData(scene, view=view, environment=environment)
    references = [renderer_of(ours, ERROR_SIZE, USUAL, bounces, seed=s).render(REFERENCE_SPP) for s in REFERENCE_SEEDS]
    error_of = error_to(*(reference.image() for reference in references))
    options = {"environment": environment, "view": view}
    theirs = {s: MitsubaPicture(scene, path(bounces), ERROR_SIZE, ERROR_SIZE, sampler=s, **options) for s in THEIRS}
    their_error_of = error_to(*(theirs["multijitter"].render(REFERENCE_SPP, seed=s) for s in REFERENCE_SEEDS))
    found = {h: curve(renderer_of(ours, ERROR_SIZE, h, bounces), error_of) for h in (USUAL, "explicit")}
    found |= {name: their_curve(peer, their_error_of) for name, peer in theirs.items()}
    lines = [f"\n**{title}, {ERROR_SIZE}², rendering only: seconds to an error**\n"]
    lines += [f"| | {' | '.join(f'{t:.0%}' for t in TARGETS)} |", "|---|" + "--:|" * len(TARGETS)]
    for name, points in found.items():
        cells = " | ".join(f"{time_to(points, t):.3g}" for t in TARGETS)
        lines.append(f"| {'Mitsuba' if name in theirs else 'taichi_tracer'}, {name} | {cells} |")
    best = [np.nanmin([time_to(found[name], t) for name in theirs]) for t in TARGETS]
    ratios = " | ".join(f"{b / time_to(found[USUAL], t):.2f}" for b, t in zip(best, TARGETS, strict=True))
    return "\n".join([*lines, f"| speed of {USUAL}, relative to Mitsuba's best | {ratios} |"]) + "\n"


PARTS = {"sample": per_sample, "error": to_error}


def main(names: list[str]) -> None:
    """Print the requested tables, each when it is complete."""
    tt.init(arch="auto")
    print(describe_machine())
    for name in names or PARTS:
        print(PARTS[name](), flush=True)


if __name__ == "__main__":
    main(sys.argv[1:])
