"""The first second: from the start of a process to a picture, of it the compiler, and the memory of a large mesh.

Where Mitsuba 3 does the same, it is measured beside it. Each process is measured by the clock and in seconds of the
processor, those of all threads; the latter say how much work there is, also if other programs keep the machine busy.
"Cold" has no kernels from an earlier process; "warm" finds all of them in Taichi's folder.

python -m benchmarks.startup
"""

import json
import os
import statistics
import subprocess
import sys
import tempfile
import time
from pathlib import Path

from benchmarks.measure import describe_machine
from benchmarks.meshes import displaced_sphere, write_ply

RUNS = 5
FEW_RUNS = 3  # of what takes many seconds
TRIANGLES = 1_300_000
MB = 1e6  # bytes
CACHE = "TI_OFFLINE_CACHE_FILE_PATH"  # the variable of Taichi's folder for kernels
VIEW = ["-m", "taichi_tracer", "render", "cornell_box", "--view", "normal", "--size", "512x512", "-o"]
BRDF = ["-m", "taichi_tracer", "render", "specular_spheres", "--estimator", "brdf", "--size", "64x64", "--time", "3"]

# Prints the seconds in which Taichi was started and kernels were read and translated, of the command in its arguments.
COMPILING = """
import sys
from taichi_tracer.__main__ import main
from taichi_tracer.system import compiling
main()
kernels = compiling.kernels()
reading, making = sum(k.reading for k in kernels), sum(k.translating for k in kernels)
print("RESULT", [reading + making, reading, len(kernels)])
"""

MITSUBA_VIEW = """
import sys
import mitsuba as mi
mi.set_variant("scalar_rgb")
scene = mi.cornell_box()
scene["integrator"] = {"type": "aov", "aovs": "n:sh_normal"}
scene["sensor"]["film"] |= {"width": 512, "height": 512}
scene["sensor"]["sampler"]["sample_count"] = 1
image = mi.render(mi.load_dict(scene), spp=1)
mi.util.write_bitmap(sys.argv[1], image[:, :, :3])
"""

MEMORY = """
import sys
import taichi_tracer as tt
scene = tt.load_scene_data(sys.argv[1])
tt.A1Renderer(scene, 512, 512).use("normal").render().save(sys.argv[2])
"""
# trimesh reads the mesh, and Embree traces the rays of a camera that stands in the middle of it.
EMBREE_MEMORY = """
import sys
import numpy as np
import trimesh
from PIL import Image
from trimesh.ray.ray_pyembree import RayMeshIntersector
mesh = trimesh.load(sys.argv[1], process=False)
x, y = np.meshgrid(np.linspace(-1, 1, 512), np.linspace(1, -1, 512))
directions = np.stack([x.ravel(), y.ravel(), np.ones(x.size)], axis=1)
hit = RayMeshIntersector(mesh).intersects_first(np.zeros_like(directions), directions)
normals = np.where(hit[:, None] < 0, 0, mesh.face_normals[hit] / 2 + 0.5)
Image.fromarray((255 * normals).astype(np.uint8).reshape(512, 512, 3)).save(sys.argv[2])
"""
MITSUBA_MEMORY = """
import sys
import mitsuba as mi
mi.set_variant("llvm_ad_rgb")
to_world = mi.ScalarTransform4f().look_at(origin=[2, 1.5, 3], target=[0, 0, 0], up=[0, 1, 0])
film = {"type": "hdrfilm", "width": 512, "height": 512}
scene = mi.load_dict({
    "type": "scene",
    "integrator": {"type": "aov", "aovs": "n:sh_normal"},
    "sensor": {"type": "perspective", "fov": 40, "to_world": to_world, "film": film},
    "mesh": {"type": "ply", "filename": sys.argv[1]},
})
image = mi.render(scene, spp=1)
mi.util.write_bitmap(sys.argv[2], image[:, :, :3])
"""


class Process:
    """A process that has ended.

    Attributes:
        wall, processor: its seconds by the clock and of the processor. peak: its largest memory in bytes.
        result: the list that it has printed after the word RESULT, or an empty list.
    """

    def __init__(self, command: list[str], **environment: str) -> None:
        start = time.perf_counter()
        pipes = {"stdout": subprocess.PIPE, "stderr": subprocess.PIPE, "text": True}
        with subprocess.Popen([sys.executable, *command], env=os.environ | environment, **pipes) as process:
            printed, errors = process.stdout.read(), process.stderr.read()
            _, status, usage = os.wait4(process.pid, 0)
            process.returncode = os.waitstatus_to_exitcode(status)
        if process.returncode != 0:
            raise SystemExit(f"{' '.join(command)} failed: {errors.strip()[-500:]}")
        self.wall = time.perf_counter() - start
        self.processor = usage.ru_utime + usage.ru_stime
        self.peak = usage.ru_maxrss * (1 if sys.platform == "darwin" else 1024)
        lines = [line.removeprefix("RESULT") for line in printed.splitlines() if line.startswith("RESULT")]
        self.result = json.loads(lines[-1]) if lines else []


def median(values) -> float:
    """The median of some numbers."""
    return statistics.median(list(values))


def first_picture(folder: Path) -> str:
    """A table of whole processes: the command with and without kernels, and Mitsuba."""
    names = "taichi_tracer, cold", "taichi_tracer, warm", "Mitsuba scalar_rgb"
    runs: dict[str, list[Process]] = {name: [] for name in names}
    picture, peer, kept = str(folder / "x.png"), folder / "peer.py", {CACHE: str(folder / "kept")}
    peer.write_text(MITSUBA_VIEW)
    Process([*VIEW, picture], **kept)
    for i in range(RUNS):
        runs[names[0]].append(Process([*VIEW, picture], **{CACHE: str(folder / f"fresh{i}")}))
        runs[names[1]].append(Process([*VIEW, picture], **kept))
        runs[names[2]].append(Process([str(peer), picture]))
    lines = ["\n**a new process to a written 512×512 normal view of the Cornell box**\n"]
    lines += ["| | s | s of the processor |", "|---|--:|--:|"]
    for name, done in runs.items():
        lines.append(f"| {name} | {median(p.wall for p in done):.2f} | {median(p.processor for p in done):.2f} |")
    return "\n".join(lines) + "\n"


def compiling(folder: Path) -> str:
    """How long the compiler keeps a small picture of direct light waiting, without kernels and with them."""
    program, picture = folder / "compiling.py", str(folder / "brdf.png")
    program.write_text(COMPILING)
    lines = [f"\n**`{' '.join(BRDF[1:])}`: Taichi's compiler, s by the clock**\n"]
    lines += ["| | compiling | of it, Python reads kernels | kernels |", "|---|--:|--:|--:|"]
    caches = {"cold": [f"brdf{i}" for i in range(FEW_RUNS)], "warm": ["brdf0"] * FEW_RUNS}
    for name, folders in caches.items():
        words = [str(program), *BRDF[2:], "-o", picture]
        done = [Process(words, **{CACHE: str(folder / cache)}).result for cache in folders]
        whole, reading, kernels = (median(column) for column in zip(*done, strict=True))
        lines.append(f"| {name} | {whole:.2f} | {reading:.2f} | {kernels:.0f} |")
    return "\n".join(lines) + "\n"


def memory(folder: Path) -> str:
    """The largest memory of a process that reads a large mesh and renders one view of it, and of its peers."""
    mesh, picture, kept = str(folder / "mesh.ply"), str(folder / "mesh.png"), {CACHE: str(folder / "mesh")}
    write_ply(mesh, *displaced_sphere(TRIANGLES))
    programs = {
        "taichi_tracer, warm": MEMORY,
        "trimesh with Embree": EMBREE_MEMORY,
        "Mitsuba llvm_ad_rgb": MITSUBA_MEMORY,
    }
    done = {}
    for name, text in [("taichi_tracer, cold", MEMORY), *programs.items()]:
        (program := folder / "memory.py").write_text(text)
        done[name] = Process([str(program), mesh, picture], **kept)
    lines = [f"\n**a process that reads {TRIANGLES:,} triangles (PLY) and renders one normal view of 512²**\n"]
    lines += ["| | MB at most | relative to Embree | s | s of the processor |", "|---|--:|--:|--:|--:|"]
    for name in programs:
        one, share = done[name], done[name].peak / done["trimesh with Embree"].peak
        lines.append(f"| {name} | {one.peak / MB:,.0f} | {share:.2f} | {one.wall:.2f} | {one.processor:.2f} |")
    return "\n".join(lines) + "\n"


def report(_arguments: list[str]) -> str:
    """All tables."""
    with tempfile.TemporaryDirectory() as folder:
        return "".join(measured(Path(folder)) for measured in (first_picture, compiling, memory))


if __name__ == "__main__":
    print(describe_machine() + report(sys.argv[1:]))
