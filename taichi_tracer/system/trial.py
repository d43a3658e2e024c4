"""Whether a backend renders as the CPU does on this machine: a small picture shows it, before "auto" takes the backend.

Drivers of graphics cards differ: one cannot compile a kernel, another one ends the process. The picture is therefore
rendered in a process of its own, once for each driver, and the answer is kept beside the compiled kernels.
"""

import functools
import importlib.metadata
import json
import os
import subprocess
import sys
import time
from pathlib import Path
from typing import Any

from taichi_tracer.system.cache import cache_folder, wanted_folder

PROGRAM = """
import sys, warnings
import numpy as np
import taichi_tracer as tt
warnings.simplefilter("ignore")
chosen = tt.init(sys.argv[1])
scene = tt.load_scene_data("specular_spheres", environment="studio")
print(chosen.arch, float(np.asarray(tt.A2Renderer(scene, 16, 16).use("mis").render(1).image()).mean()))
"""
SAME_PICTURE = 1e-3  # of the mean
SECONDS = 120  # a picture may take, with the start of Python and of the driver
LONGEST_LINE = 120  # letters of what went wrong
KEPT = "taichi_tracer_trials.json"  # in the folder of compiled kernels


def problem_of(arch: str, driver: str) -> str | None:
    """Why a backend cannot be taken: its picture is not the CPU's, or there is none; None if it can.

    Args:
        arch: "vulkan", "metal" or "cuda". driver: what names the device; another device is tried anew.
    """
    folder, _ = cache_folder(wanted_folder())
    if folder is None:
        return "a trial of it cannot be kept, because no folder for compiled kernels can be written"
    path, key = folder / KEPT, f"{arch} {driver} {versions()}"
    kept = read(path)
    if key not in kept:
        right, told = picture_on("cpu")
        kept[key] = told if right is None else difference(*picture_on(arch), right)
        write(path, kept)
    return kept[key]


def difference(mean: float | None, told: str, right: float) -> str | None:
    """What is wrong with a picture, or None.

    Args:
        mean: that of the picture, None if there is none. told: what ``picture_on`` tells of it. right: the CPU's mean.
    """
    if mean is None:
        return told
    return None if abs(mean - right) <= SAME_PICTURE * abs(right) else f"another picture: {told}"


def picture_on(arch: str) -> tuple[float | None, str]:
    """(mean, what is told) of a picture that a process of its own renders; the mean is None if there is no picture."""
    start = time.perf_counter()
    package = Path(__file__).parents[2]  # the program may run where the package is not installed
    paths = os.pathsep.join([str(package), *filter(None, [os.environ.get("PYTHONPATH")])])
    command, environment = [sys.executable, "-c", PROGRAM, arch], os.environ | {"PYTHONPATH": paths}
    try:
        done = subprocess.run(command, capture_output=True, text=True, timeout=SECONDS, env=environment)
    except subprocess.TimeoutExpired:
        return None, f"not ready after {SECONDS} s"
    words = done.stdout.split()
    if done.returncode != 0 or words[-2:-1] != [arch]:
        lines = done.stderr.strip().splitlines() or [f"exit code {done.returncode}"]
        return None, lines[-1][:LONGEST_LINE]
    return float(words[-1]), f"in {time.perf_counter() - start:.1f} s with the start of Python"


@functools.cache
def versions() -> str:
    """What the answer depends on besides the driver: Taichi, and when this package was installed."""
    return f"taichi {importlib.metadata.version('taichi')}, {Path(__file__).stat().st_mtime_ns}"


def read(path: Path) -> dict[str, Any]:
    """The answers that were kept; none if the file is not there, or is no such file."""
    try:
        found = json.loads(path.read_text(encoding="utf-8"))
    except (OSError, ValueError):
        return {}
    return found if isinstance(found, dict) else {}


def write(path: Path, kept: dict[str, Any]) -> None:
    """Keep the answers; the file is whole at each moment."""
    part = path.with_suffix(f".{os.getpid()}")
    part.write_text(json.dumps(kept, indent=1), encoding="utf-8")
    part.replace(path)
