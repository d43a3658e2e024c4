"""The same pictures and rays on every backend of this machine: the CPU, and graphics cards by CUDA, Metal or Vulkan.

Each backend has processes of its own, which take turns; the figures are medians over them. Kernels are kept between the
processes of a backend, but not in the first one, which tells how long it takes until the first picture.

python -m benchmarks.backends [BACKEND ...]
"""

import json
import os
import statistics
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from pathlib import Path

import taichi as ti

import taichi_tracer as tt
from benchmarks.measure import describe_machine
from benchmarks.meshes import displaced_sphere
from benchmarks.rays import NUM_RAYS, RayKernels, frame, incoherent_rays
from taichi_tracer.system import runtime

PROCESSES, CALLS = 2, 3
MANY, FEW = 512_000, 82_000  # triangles
SAMPLES = 4  # per pixel and call, of pictures of light
CACHE = "TI_OFFLINE_CACHE_FILE_PATH"  # the variable of Taichi's folder for kernels
FIRST = "first sample of `mis`, 512², 82,000 triangles, s"


def seconds_of(call: Callable[[], object]) -> float:
    """The median time of a call, after two calls that compile and warm up."""
    seconds = []
    for i in range(CALLS + 2):
        start = time.perf_counter()
        call()
        ti.sync()
        if i >= 2:
            seconds.append(time.perf_counter() - start)
    return statistics.median(seconds)


def per_sample(renderer: tt.A2Renderer) -> float:
    """Milliseconds per sample of a picture."""
    return seconds_of(lambda: renderer.render(SAMPLES)) / SAMPLES * 1e3


def measured(arch: str) -> dict[str, float]:
    """What is measured → figure, on a backend, in this process."""
    if tt.init(arch).arch != arch:
        raise SystemExit(f"there is no device for {arch}")
    start = time.perf_counter()
    few = tt.scene_from_mesh(*displaced_sphere(FEW), environment="studio")
    light = tt.A2Renderer(few, 512, 512).use("mis").render(1)
    ti.sync()
    found = {FIRST: time.perf_counter() - start}
    start = time.perf_counter()
    many = tt.scene_from_mesh(*displaced_sphere(MANY))
    many.ray_intersector.triangle_test  # noqa: B018 (builds the tree)
    ti.sync()
    found["512,000 triangles, loaded, s"] = time.perf_counter() - start
    for name, scene in (("82,000", few), ("512,000", many)):
        for size in (512, 1024, 2048):
            found[f"frame, {size}², {name} triangles, ms"] = seconds_of(frame(scene, size)) * 1e3
        vertices = scene.geometry.vertices.to_numpy()
        rays = incoherent_rays(vertices.min(0), vertices.max(0))
        kernels = RayKernels(scene, *rays)
        for what, call in (("incoherent rays", kernels.nearest), ("occlusion", kernels.occluded)):
            found[f"{what}, {name} triangles, million/s"] = NUM_RAYS / seconds_of(call) / 1e6
        answer = seconds_of(lambda scene=scene, rays=rays: scene.intersect(*rays))
        found[f"`scene.intersect`, numpy, {name} triangles, million/s"] = NUM_RAYS / answer / 1e6
    found["`mis` per sample, 512², 82,000 triangles, ms"] = per_sample(light)
    found["`mis` per sample, 1024², 82,000 triangles, ms"] = per_sample(tt.A2Renderer(few, 1024, 1024).use("mis"))
    box = tt.load_scene_data("cornell_box")
    for size in (512, 1024):
        found[f"`path` per sample, Cornell box, {size}², ms"] = per_sample(tt.A4Renderer(box, size, size).use("path"))
    return found


def in_a_process(arch: str, folder: str) -> dict[str, float]:
    """The same in a process of its own, with a folder for kernels."""
    paths = os.pathsep.join([str(Path(__file__).parents[1]), *filter(None, [os.environ.get("PYTHONPATH")])])
    command = [sys.executable, "-m", "benchmarks.backends", "--here", arch]
    environment = os.environ | {CACHE: folder, "PYTHONPATH": paths}
    done = subprocess.run(command, capture_output=True, text=True, env=environment)
    if done.returncode != 0:
        raise SystemExit(f"{arch}: {(done.stderr.strip().splitlines() or ['no message'])[-1]}")
    return json.loads(done.stdout.strip().splitlines()[-1])


def report(archs: list[str]) -> str:
    """A markdown table: a column for each backend."""
    found: dict[str, list[dict[str, float]]] = {arch: [] for arch in archs}
    with tempfile.TemporaryDirectory() as folder:
        for _ in range(1 + PROCESSES):
            for arch, runs in found.items():
                runs.append(in_a_process(arch, str(Path(folder, arch))))
    lines = [f"| | {' | '.join(archs)} |", f"|---|{'--:|' * len(archs)}"]
    for name in found[archs[0]][0]:
        figures = {arch: statistics.median(run[name] for run in runs[1:]) for arch, runs in found.items()}
        if name == FIRST:
            lines.append(f"| {name}, cold | {' | '.join(f'{runs[0][name]:.3g}' for runs in found.values())} |")
            name += ", kept kernels"
        lines.append(f"| {name} | {' | '.join(f'{figure:.3g}' for figure in figures.values())} |")
    return "\n".join(lines) + "\n"


def there() -> list[str]:
    """The backends of this machine; Vulkan in software is none."""
    return ["cpu", *(arch for arch in runtime.AUTO if runtime.has_device(arch))]


if __name__ == "__main__":
    if sys.argv[1:2] == ["--here"]:
        print(json.dumps(measured(sys.argv[2])))
    else:
        print(describe_machine() + "\n" + report(sys.argv[1:] or there()))
