"""The time from the start of a process to a written picture, with and without Taichi's cache, compared with Mitsuba 3.

The picture is the normal view of the Cornell box, 512×512.

python -m benchmarks.startup
"""

import os
import statistics
import subprocess
import sys
import tempfile
import time
from pathlib import Path

from benchmarks.measure import describe_machine

RUNS = 5
OURS = ["-m", "taichi_tracer", "render", "cornell_box", "--view", "normal", "--size", "512x512", "-o"]
PARTS = """
import sys, time
start = time.perf_counter()
def lap(what):
    global start
    now = time.perf_counter()
    print(what, f"{now - start:.2f} s", end="; ")
    start = now
import taichi_tracer as tt
from taichi_tracer import renderer
lap("imports")
tt.init("cpu")
lap("init")
scene = tt.load_scene_data("cornell_box")
lap("scene with its build kernels")
picture = tt.A1Renderer(scene_data=scene, width=512, height=512).use("normal")
lap("camera and film")
picture.render(); image = picture.image()
lap("compile and render")
tt.save_image(sys.argv[1], image)
lap("write")
"""
MITSUBA = """
import sys
import mitsuba as mi
mi.set_variant("llvm_ad_rgb" if len(sys.argv) > 2 else "scalar_rgb")
scene = mi.cornell_box()
scene["integrator"] = {"type": "aov", "aovs": "n:sh_normal"}
scene["sensor"]["film"] |= {"width": 512, "height": 512}
scene["sensor"]["sampler"]["sample_count"] = 1
image = mi.render(mi.load_dict(scene), spp=1)
mi.util.write_bitmap(sys.argv[1], image[:, :, :3])
"""


def seconds(command: list[str], **environment: str) -> float:
    """The wall-clock time of a process; the program ends if the process fails."""
    start = time.perf_counter()
    done = subprocess.run([sys.executable, *command], env=os.environ | environment, capture_output=True, text=True)
    if done.returncode != 0:
        raise SystemExit(f"{' '.join(command)} failed: {done.stderr.strip()[-500:]}")
    return time.perf_counter() - start


def report(_arguments: list[str]) -> str:
    """A markdown table, and the time of each step."""
    times = {name: [] for name in ("taichi_tracer, no cache", "taichi_tracer, cache", "Mitsuba scalar_rgb")}
    with tempfile.TemporaryDirectory() as folder:
        picture, programs = str(Path(folder) / "x.png"), {}
        for name, text in (("peer", MITSUBA), ("parts", PARTS)):
            programs[name] = str(Path(folder) / f"{name}.py")
            Path(programs[name]).write_text(text)
        kept = {"TI_OFFLINE_CACHE_FILE_PATH": str(Path(folder) / "kept")}
        seconds([*OURS, picture], **kept)
        for i in range(RUNS):
            fresh = {"TI_OFFLINE_CACHE_FILE_PATH": str(Path(folder) / f"fresh{i}")}
            times["taichi_tracer, no cache"].append(seconds([*OURS, picture], **fresh))
            times["taichi_tracer, cache"].append(seconds([*OURS, picture], **kept))
            times["Mitsuba scalar_rgb"].append(seconds([programs["peer"], picture]))
        parts = {}
        for name, cache in (("no cache", "parts"), ("cache", "parts")):
            environment = os.environ | {"TI_OFFLINE_CACHE_FILE_PATH": str(Path(folder) / cache)}
            command = [sys.executable, programs["parts"], picture]
            parts[name] = subprocess.run(command, env=environment, capture_output=True, text=True).stdout.strip()
    lines = ["\n**a new process to a written 512×512 normal view of the Cornell box**\n", "| | s |", "|---|--:|"]
    lines += [f"| {name} | {statistics.median(values):.2f} |" for name, values in times.items()]
    lines += [f"\nwhere it goes, {name}: {text}" for name, text in parts.items()]
    return "\n".join(lines) + "\n"


if __name__ == "__main__":
    print(describe_machine() + report(sys.argv[1:]))
