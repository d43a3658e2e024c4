"""What the benchmarks share: runs that take turns, tables, meshes, scenes, and the time to an error."""

import datetime
import importlib.metadata
import os
import platform
import statistics
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np
import taichi as ti

from taichi_tracer.geometry import Mesh
from taichi_tracer.materials import Material
from taichi_tracer.picture.metrics import relative_rmse
from taichi_tracer.progressive import ProgressiveRenderer

RUNS = 5
REST = 0.05  # seconds before each call, because threads of some libraries stay busy for a while after their work


def interleaved(candidates: dict[str, Callable[[], object]], runs: int = RUNS) -> dict[str, float]:
    """Name → median time of a call in seconds. The candidates take turns, after two calls that compile and warm up."""
    for call in candidates.values():
        call()
        call()
    seconds: dict[str, list[float]] = {name: [] for name in candidates}
    for _ in range(runs):
        for name, call in candidates.items():
            time.sleep(REST)
            start = time.perf_counter()
            call()
            seconds[name].append(time.perf_counter() - start)
    return {name: statistics.median(values) for name, values in seconds.items()}


def table(title: str, columns: list[str], rows: list[list]) -> str:
    """A markdown table with a title; the first column holds names."""
    lines = [f"\n**{title}**\n", f"| {' | '.join(columns)} |", "|---|" + "--:|" * (len(columns) - 1)]
    return "\n".join([*lines, *(f"| {' | '.join(map(str, row))} |" for row in rows)]) + "\n"


def ratio_table(title: str, medians: dict[str, float], base: str, unit: str, per_second: float | None = None) -> str:
    """A markdown table: for each candidate, its median and its speed relative to ``base``.

    Args:
        unit: the unit of the figures: "ms", or for example "million rays/s".
        per_second: the number of rays, for example, in one call; None shows the time of a call.
    """
    rows = []
    for name, seconds in medians.items():
        figure = seconds * 1e3 if per_second is None else per_second / seconds / 1e6
        rows.append([name, f"{figure:.3g}", f"{medians[base] / seconds:.2f}"])
    return table(title, ["", unit, f"speed relative to {base}"], rows)


def describe_machine() -> str:
    """The time, the processor, the load by other programs, and the versions of the libraries."""
    path = Path("/proc/cpuinfo")  # of Linux
    lines = path.read_text().splitlines() if path.exists() else []
    names = [line.partition(":")[2].strip() for line in lines if line.startswith("model name")]
    model = names[0] if names else platform.processor() or platform.machine()
    versions = ", ".join(f"{name} {version(name)}" for name in ("taichi", "numpy", "mitsuba", "embreex"))
    now = f"{datetime.datetime.now(datetime.timezone.utc):%Y-%m-%d %H:%M} UTC"
    load = f"load of the last minute {os.getloadavg()[0]:.1f}" if hasattr(os, "getloadavg") else "load unknown"
    return f"{now}; {model}, {os.cpu_count()} threads, {load}; Python {platform.python_version()}, {versions}\n"


def version(name: str) -> str:
    """The version of a package, or "absent"."""
    try:
        return importlib.metadata.version(name)
    except importlib.metadata.PackageNotFoundError:
        return "absent"


# ── meshes and scenes ──

BLOB = 82_000  # triangles
BLOB_VIEW = {"eye": (0.0, 0.5, 2.8), "at": (0.0, 0.0, 0.0), "up": (0.0, 1.0, 0.0), "fov": 60.0}
SPHERES_VIEW = {"eye": (0, 1.4, 3.6), "at": (0, 0.4, 0), "up": (0, 1, 0), "fov": 45.0}
SKY_SIZE, SUN_DEGREES, SUN_RADIANCE = (64, 128), 5.0, 20.0


def displaced_sphere(triangles: int) -> tuple[np.ndarray, np.ndarray]:
    """(V, 3) float64 vertices and (F, 3) int32 faces, about ``triangles`` of them; the radius is 1 ± 0.2."""
    columns = round(np.sqrt(triangles))
    rows = columns // 2 + 1
    theta, phi = np.meshgrid(
        np.linspace(0, np.pi, rows + 1), np.linspace(0, 2 * np.pi, columns, endpoint=False), indexing="ij"
    )
    radius = 1 + 0.15 * np.sin(5 * theta) * np.cos(7 * phi)
    radius += 0.05 * np.sin(23 * theta) * np.cos(17 * phi) + 0.017 * np.sin(61 * theta) * np.cos(71 * phi)
    direction = np.stack([np.sin(theta) * np.cos(phi), np.cos(theta), np.sin(theta) * np.sin(phi)], axis=-1)
    row, column = np.meshgrid(np.arange(rows), np.arange(columns), indexing="ij")
    a, b = row * columns + column, row * columns + (column + 1) % columns
    c, d = a + columns, b + columns
    upper = np.stack([a, b, c], axis=-1)[1:].reshape(-1, 3)
    lower = np.stack([b, d, c], axis=-1)[:-1].reshape(-1, 3)
    vertices = (radius[..., None] * direction).reshape(-1, 3)
    return vertices, np.concatenate([upper, lower]).astype(np.int32)


def meshes_of(arguments: list[str], usual: tuple[int, ...]) -> dict[str, tuple[np.ndarray, np.ndarray]]:
    """Name → displaced sphere for every number of triangles in the arguments, or for the usual numbers."""
    spheres = [displaced_sphere(int(number)) for number in arguments or usual]
    return {f"{len(faces):,} triangles": (vertices, faces) for vertices, faces in spheres}


def sun_and_sky() -> np.ndarray:
    """(h, w, 3) radiance: a sky that is brighter at the horizon, and a sun that stands high behind the camera."""
    height, width = SKY_SIZE
    v, u = np.meshgrid((np.arange(height) + 0.5) / height, (np.arange(width) + 0.5) / width, indexing="ij")
    elevation, azimuth = np.pi * (0.5 - v), 2 * np.pi * (u - 0.5)
    d = np.stack([np.cos(elevation) * np.cos(azimuth), np.sin(elevation), np.cos(elevation) * np.sin(azimuth)], -1)
    sky = (1 - 0.6 * np.abs(d[..., 1:2])) * np.array([0.5, 0.7, 1.0])
    sun = np.array([0.5, 1.0, 0.8]) / np.linalg.norm([0.5, 1.0, 0.8])
    sky[d @ sun > np.cos(np.radians(SUN_DEGREES))] += SUN_RADIANCE
    return sky


def three_spheres() -> Mesh:
    """Spheres with Ns 1, 20 and 200 on a floor."""
    materials = [Material("floor", Kd=(0.5, 0.5, 0.5))]
    materials += [Material(f"Ns {ns}", Kd=(0.8, 0.7, 0.6), Ns=ns) for ns in (1, 20, 200)]
    return Mesh(
        vertices=np.array([[-6, 0, 6], [6, 0, 6], [6, 0, -6], [-6, 0, -6]], float),
        faces=np.array([[0, 1, 2], [0, 2, 3]], np.int32),
        face_materials=np.zeros(2, np.int32),
        materials=materials,
        spheres=np.array([[-1.2, 0.5, 0, 0.5], [0, 0.5, 0, 0.5], [1.2, 0.5, 0, 0.5]]),
        sphere_ids=np.array([2, 3, 4], np.int32),
        sphere_materials=np.array([1, 2, 3], np.int32),
    )


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


# ── light, beside Mitsuba ──

SPP_PER_CALL = 16
TARGETS = (0.05, 0.02, 0.01)  # relative RMSE
SPP = (4, 16, 64, 256, 1024)  # of the points of a curve of Mitsuba's
MOST_SECONDS, MOST_SPP, LEAST_ERROR = 6, 4096, 1e-6  # a curve of ours ends at the first of these
FIRST_LOOK, LATER = 0.05, 1.25  # seconds of the first of its points, and times those of the last one
REFERENCE_SPP, REFERENCE_SEEDS = 512, (1000, 1001)
Points = list[tuple[float, float]]  # (relative RMSE, seconds of rendering)


def sample_table(title: str, ours: dict, theirs) -> str:
    """A table: milliseconds for one sample of every pixel.

    Args:
        ours: name → renderer. theirs: a ``MitsubaPicture``.
    """
    calls: dict[str, Callable[[], object]] = {"Mitsuba llvm": lambda: theirs.render(SPP_PER_CALL)}
    for name, renderer in ours.items():
        calls[f"taichi_tracer, {name}"] = lambda renderer=renderer: (renderer.render(SPP_PER_CALL), ti.sync())
    medians = {name: seconds / SPP_PER_CALL for name, seconds in interleaved(calls).items()}
    return ratio_table(title, medians, "Mitsuba llvm", "ms per sample")


def error_to(truths: list[np.ndarray]) -> Callable[[np.ndarray], float]:
    """The function picture → relative RMSE to the mean of two references, whose own noise is subtracted."""
    exact = np.mean(truths, axis=0, dtype=np.float64)
    noise = float(np.mean((truths[0].astype(np.float64) - truths[1]) ** 2)) / 4 / exact.mean() ** 2
    return lambda image: max(relative_rmse(image, exact) ** 2 - noise, 1e-12) ** 0.5


def our_points(renderer: ProgressiveRenderer, error_of: Callable[[np.ndarray], float]) -> Points:
    """The points of a picture as a user gets it, compared from time to time; compiling is not counted."""
    points: Points = []

    def look(progress) -> None:
        due = LATER * points[-1][1] if points else FIRST_LOOK
        if progress.seconds_per_sample > 0 and progress.seconds >= due:
            points.append((error_of(renderer.image()), progress.seconds))

    renderer.render(MOST_SPP, MOST_SECONDS, error=LEAST_ERROR, watch=look)
    return points


def their_points(picture, error_of: Callable[[np.ndarray], float]) -> Points:
    """The points of Mitsuba's pictures."""
    points = []
    for spp in SPP:
        picture.render(spp)  # compiles
        start = time.perf_counter()
        image = picture.render(spp, seed=1)
        points.append((error_of(image), time.perf_counter() - start))
    return points


def seconds_to(points: Points, target: float) -> float:
    """Seconds to an error, linear between the logarithms of the points; NaN outside of them."""
    errors, seconds = np.log(np.array(sorted(points))).T
    return float(np.exp(np.interp(np.log(target), errors, seconds, left=np.nan, right=np.nan)))


def error_table(title: str, make: Callable, ours: tuple[str, ...], theirs: dict) -> str:
    """A table: seconds of rendering to each of ``TARGETS``, and our speed relative to Mitsuba's best.

    Args:
        make: (name, seed) → renderer. ours: the names; the first one makes the reference.
        theirs: name → ``MitsubaPicture``; the first one makes the reference of Mitsuba's pictures.
    """
    error_of = error_to([make(ours[0], seed).render(REFERENCE_SPP).image() for seed in REFERENCE_SEEDS])
    first = next(iter(theirs.values()))
    their_error_of = error_to([first.render(REFERENCE_SPP, seed=seed) for seed in REFERENCE_SEEDS])
    found = {f"taichi_tracer, {name}": our_points(make(name, 0), error_of) for name in ours}
    peers = {f"Mitsuba llvm, {name}": their_points(picture, their_error_of) for name, picture in theirs.items()}
    seconds = {name: [seconds_to(points, t) for t in TARGETS] for name, points in (found | peers).items()}
    rows = [[name, *(f"{s:.3g}" for s in values)] for name, values in seconds.items()]
    best, own = np.nanmin([seconds[name] for name in peers], axis=0), seconds[f"taichi_tracer, {ours[0]}"]
    ratios = [f"{b / s:.2f}" for b, s in zip(best, own, strict=True)]
    rows.append([f"speed of {ours[0]}, relative to Mitsuba's best", *ratios])
    return table(f"{title}: seconds of rendering to an error", ["", *(f"{t:.0%}" for t in TARGETS)], rows)
