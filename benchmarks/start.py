"""The first second: from the start of a process to a picture, beside Mitsuba 3, and how long the compiler takes.

"Cold" has no kernels from an earlier process; "warm" finds all of them in Taichi's folder.

python -m benchmarks.start
"""

import json
import os
import statistics
import subprocess
import sys
import tempfile
import time
from pathlib import Path

from benchmarks.helper import describe_machine, table

RUNS = 5
FEW_RUNS = 3  # of what takes many seconds
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


def seconds_of(command: list[str], **environment: str) -> tuple[float, list[float]]:
    """Seconds of a process by the clock, and the list that it prints after the word RESULT."""
    start = time.perf_counter()
    variables = os.environ | {"PYTHONPATH": str(Path(__file__).parents[1])} | environment
    variables.pop("PYTHONDONTWRITEBYTECODE", None)  # what pip installs, as it does Mitsuba, has its bytecode
    done = subprocess.run([sys.executable, *command], env=variables, capture_output=True, text=True)
    seconds = time.perf_counter() - start
    if done.returncode != 0:
        raise SystemExit(f"{' '.join(command)} failed: {done.stderr.strip()[-500:]}")
    found = [line.removeprefix("RESULT") for line in done.stdout.splitlines() if line.startswith("RESULT")]
    return seconds, json.loads(found[-1]) if found else []


def first_picture(folder: Path) -> str:
    """A table of whole processes: the command with and without kernels, and Mitsuba."""
    picture, peer, kept = str(folder / "x.png"), folder / "peer.py", {CACHE: str(folder / "kept")}
    peer.write_text(MITSUBA_VIEW)
    seconds_of([*VIEW, picture], **kept)
    runs: dict[str, list[float]] = {"taichi_tracer, cold": [], "taichi_tracer, warm": [], "Mitsuba scalar_rgb": []}
    for i in range(RUNS):
        fresh = {CACHE: str(folder / f"fresh{i}")}
        calls = ([*VIEW, picture], fresh), ([*VIEW, picture], kept), ([str(peer), picture], {})
        for found, (command, environment) in zip(runs.values(), calls, strict=True):
            found.append(seconds_of(command, **environment)[0])
    rows = [[name, f"{statistics.median(found):.2f}"] for name, found in runs.items()]
    return table("a new process to a written 512×512 normal view of the Cornell box", ["", "s"], rows)


def compiling(folder: Path) -> str:
    """How long the compiler keeps a small picture of direct light waiting, without kernels and with them."""
    program, rows = folder / "compiling.py", []
    program.write_text(COMPILING)
    words = [str(program), *BRDF[2:], "-o", str(folder / "brdf.png")]
    for name, folders in (("cold", range(FEW_RUNS)), ("warm", [0] * FEW_RUNS)):
        done = [seconds_of(words, **{CACHE: str(folder / f"brdf{cache}")})[1] for cache in folders]
        whole, reading, kernels = (statistics.median(column) for column in zip(*done, strict=True))
        rows.append([name, f"{whole:.2f}", f"{reading:.2f}", f"{kernels:.0f}"])
    columns = ["", "compiling", "of it, Python reads kernels", "kernels"]
    return table(f"`{' '.join(BRDF[1:])}`: Taichi's compiler, s", columns, rows)


if __name__ == "__main__":
    print(describe_machine())
    with tempfile.TemporaryDirectory() as place:
        print(first_picture(Path(place)), compiling(Path(place)))
