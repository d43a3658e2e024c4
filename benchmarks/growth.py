"""How time and memory grow with triangles, pixels, samples and lamps: seconds of the processor, and exponents.

Each size has a process of its own, whose largest memory is told. Seconds of the processor are those of all threads;
they say how much work there is, also if other programs keep the machine busy. An exponent is the slope of a straight
line through the logarithms: 1 is twice the time for twice the size. A size that would need more memory than ``MOST`` is
left out.

python -m benchmarks.growth [triangles | pixels | samples | lamps ...]
"""

import json
import math
import resource
import subprocess
import sys
import time
from collections.abc import Callable
from typing import TypeVar

import numpy as np
import taichi as ti

import taichi_tracer as tt
from benchmarks.measure import describe_machine
from benchmarks.meshes import displaced_sphere
from benchmarks.rays import VIEW, RayKernels
from taichi_tracer.picture.progress import slope
from taichi_tracer.system import stopwatch

Result = TypeVar("Result")
MB = 1e6  # bytes
MOST = 4000  # MB of a process
ADDED, WHOLE = "memory added, MB", "process, MB"
ENOUGH = 0.3  # seconds of the processor: a call is repeated until it has taken so long
WARM_UP = 2  # calls that compile, and of which the second one already takes packets
TAIL = 3  # sizes: the exponent where it is large is that of the last so many
RAYS = 1 << 18
FRAME = 512  # pixels, side of the frame whose triangles grow
PICTURE = 128  # pixels, side of the picture whose samples or lamps grow
LAMP = 0.0005  # side of a lamp: a million of them hide only 3 % of each other's light
SIZES = {
    "triangles": (1_000, 10_000, 100_000, 1_000_000, 4_000_000, 20_000_000),
    "pixels": (64, 128, 256, 512, 1024, 2048, 4096, 8192),
    "samples": (1, 4, 16, 64, 256, 1024),
    "lamps": (1, 10, 100, 1_000, 10_000, 100_000, 1_000_000),
}
TITLES = {
    "triangles": f"triangles: a displaced sphere; eye rays of {FRAME}², in packets or one by one, and incoherent rays",
    "pixels": "pixels: side of a normal view of 82,000 triangles, the whole frame",
    "samples": f"samples per pixel: specular_spheres under studio, MIS, {PICTURE}²",
    "lamps": f"lamps: triangles that emit, above a floor, estimator environment, {PICTURE}²; above 64, a hierarchy",
}
SQUARED = {"pixels"}  # sizes that are sides of a square: exponents are those of the area


def processor_seconds(call: Callable[[], object]) -> float:
    """Seconds of the processor for a call, without compilation."""
    for _ in range(WARM_UP):
        call()
    ti.sync()
    start, calls = time.process_time(), 0
    while time.process_time() - start < ENOUGH:
        call()
        ti.sync()
        calls += 1
    return (time.process_time() - start) / calls


def without_compiling(call: Callable[[], Result]) -> tuple[Result, float]:
    """What a call returns, and the seconds of the processor that it took, without those of compiling kernels."""
    ti.sync()
    watch = stopwatch.start(time.process_time(), clock=time.process_time)
    result = call()
    ti.sync()
    stopwatch.stop()
    return result, watch.total - watch.seconds[stopwatch.KERNELS_READ] - watch.seconds[stopwatch.KERNELS_MADE]


def frame(scene: tt.SceneData, side: int) -> Callable[[], object]:
    """A whole frame of the normal view, after a move of the camera."""
    renderer = tt.A1Renderer(scene, side, side).use("normal")

    def call() -> None:
        renderer.camera.version += 1
        renderer.render()

    return call


def of_triangles(size: int) -> dict[str, float]:
    """Seconds to load and build, nanoseconds of a ray, and memory."""
    vertices, faces = displaced_sphere(size)
    before = largest_memory()
    scene, load = without_compiling(lambda: tt.scene_from_mesh(vertices, faces, view={**VIEW, "up": (0, 1, 0)}))
    rng = np.random.default_rng(1)
    origins = rng.uniform(vertices.min(axis=0), vertices.max(axis=0), (RAYS, 3)).astype(np.float32)
    directions = rng.normal(size=(RAYS, 3)).astype(np.float32)
    rays = processor_seconds(RayKernels(scene, origins, directions).nearest)
    eye = processor_seconds(frame(scene, FRAME))
    tree = scene.ray_intersector
    return {
        "load and build, s": load,
        "eye ray, ns": 1e9 * eye / FRAME**2,
        "incoherent ray, ns": 1e9 * rays / RAYS,
        "tree, MB": tree.bytes / MB,
        ADDED: largest_memory() - before,
    }


def of_pixels(side: int) -> dict[str, float]:
    """Seconds of a frame, and memory."""
    scene = tt.scene_from_mesh(*displaced_sphere(82_000), view={**VIEW, "up": (0, 1, 0)})
    before = largest_memory()
    return {
        "frame, s": processor_seconds(frame(scene, side)),
        ADDED: largest_memory() - before,
    }


def of_samples(count: int) -> dict[str, float]:
    """Seconds of so many samples, and the error that is left."""
    scene = tt.load_scene_data("specular_spheres", environment="studio")
    renderer = tt.A2Renderer(scene, PICTURE, PICTURE, integrator="mis")
    renderer.render(WARM_UP)
    renderer.begin_anew()
    _, seconds = without_compiling(lambda: renderer.render(count))
    return {"rendering, s": seconds, "error, %": 100 * float(renderer.error())}


def of_lamps(count: int) -> dict[str, float]:
    """Seconds to load, seconds of a sample, and its error after 16 of them."""
    rng = np.random.default_rng(2)
    corner = rng.uniform((-1, 0.2, -1), (1, 1.2, 1), (count, 1, 3))
    lamps = corner + LAMP * np.array([[0, 0, 0], [1, 0, 0], [0, 0, 1]])  # they shine downwards
    floor = np.array([[-2, 0, -2], [-2, 0, 2], [2, 0, -2], [2, 0, 2]], float)
    vertices = np.concatenate([floor, lamps.reshape(-1, 3)])
    faces = np.concatenate([[[0, 1, 2], [2, 1, 3]], 4 + np.arange(3 * count).reshape(-1, 3)])
    grey, glowing = tt.Material(Kd=(0.6, 0.6, 0.6)), tt.Material(Kd=(0, 0, 0), Ke=(1, 1, 1))
    materials = {"material": [grey, glowing], "face_materials": np.r_[0, 0, np.ones(count, int)]}
    view = {"eye": (0.0, 1.5, 2.5), "at": (0.0, 0.0, 0.0), "up": (0, 1, 0), "fov": 50.0}
    scene, load = without_compiling(lambda: tt.scene_from_mesh(vertices, faces, view=view, **materials))
    renderer = tt.A3Renderer(scene, PICTURE, PICTURE, integrator="environment").render(16)
    error = float(renderer.error())
    return {"load, s": load, "sample, s": processor_seconds(renderer.render), "error of 16, %": 100 * error}


MEASURE = {"triangles": of_triangles, "pixels": of_pixels, "samples": of_samples, "lamps": of_lamps}


def largest_memory() -> float:
    """MB that this process had at most."""
    return 1024.0 * resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / MB


def in_a_process(axis: str, size: int) -> dict[str, float]:
    """What ``MEASURE`` finds for one size, in a process of its own, and the largest memory of the process."""
    command = [sys.executable, "-m", "benchmarks.growth", "--one", axis, str(size)]
    done = subprocess.run(command, capture_output=True, text=True)
    if done.returncode != 0:
        raise SystemExit(f"{axis} {size} failed: {done.stderr.strip()[-400:]}")
    return json.loads(done.stdout.strip().splitlines()[-1])


def report(axis: str) -> str:
    """A markdown table of one axis: a row for each size, and the exponents."""
    found: dict[int, dict[str, float]] = {}
    left_out = []
    for size in SIZES[axis]:
        if found:
            last, peak = list(found.items())[-1]
            growth = (size / last) ** (2 if axis in SQUARED else 1)
            expected = peak[WHOLE] + peak.get(ADDED, 0) * (growth - 1)
            if expected > MOST:
                left_out.append(f"{size:,} (about {expected / 1e3:.0f} GB)")
                continue
        found[size] = in_a_process(axis, size)
    columns = [name for name in next(iter(found.values())) if name != ADDED]
    lines = [f"\n**{TITLES[axis]}**\n", f"| | {' | '.join(columns)} |", "|---|" + "--:|" * len(columns)]
    lines += [f"| {size:,} | {' | '.join(f'{row[c]:.3g}' for c in columns)} |" for size, row in found.items()]
    for name, rows in (("exponent", list(found.items())), (f"of the last {TAIL}", list(found.items())[-TAIL:])):
        lines.append(f"| {name} | {' | '.join(exponent(axis, rows, c) for c in columns)} |")
    if left_out:
        lines.append(f"\nLeft out, because of more than {MOST / 1e3:.0f} GB of memory: {', '.join(left_out)}.")
    return "\n".join(lines) + "\n"


def exponent(axis: str, rows: list[tuple[int, dict[str, float]]], column: str) -> str:
    """The slope of the logarithms of a column against those of the sizes."""
    power = 2 if axis in SQUARED else 1
    points = [(size**power, row[column]) for size, row in rows if row[column] > 0 and math.isfinite(row[column])]
    return f"{slope(points):.2f}" if len(points) > 1 else ""


def one(axis: str, size: int) -> None:
    """Measure one size, and print it as JSON."""
    tt.init(arch="cpu")
    found = MEASURE[axis](size)
    print(json.dumps({**found, WHOLE: largest_memory()}))


if __name__ == "__main__":
    if sys.argv[1:2] == ["--one"]:
        one(sys.argv[2], int(sys.argv[3]))
    else:
        print(describe_machine() + "".join(report(axis) for axis in sys.argv[1:] or SIZES))
