"""What a cluster gains: samples per second with local workers, beside processes without a cluster.

python -m benchmarks.cluster [SECONDS]
"""

import json
import os
import subprocess
import sys
import tempfile
from pathlib import Path

import taichi_tracer as tt
from benchmarks.helper import describe_machine, table

NAME, SECONDS = "cornell_box", 5.0  # of each measurement
SCENE = {"estimator": "path", "size": (512, 512), "arch": "cpu"}
ALONE = """
import json, sys, time, taichi_tracer as tt
tt.init("cpu", threads=int(sys.argv[1]))
renderer = tt.A4Renderer(tt.load_scene_data("cornell_box"), 512, 512).use("path")
renderer.render(2)
start = time.perf_counter()
renderer.render(time=float(sys.argv[2]))
print(json.dumps([renderer.samples - 2, time.perf_counter() - start]))
"""


def alone(processes: int, threads: int, seconds: float) -> float:
    """The ideal: samples per second of some processes that render at the same time without a cluster."""
    with tempfile.TemporaryDirectory() as folder:
        program = Path(folder) / "alone.py"  # kernels need their source in a file
        program.write_text(ALONE, encoding="utf-8")
        command = [sys.executable, str(program), str(threads), str(seconds)]
        variables = os.environ | {"PYTHONPATH": str(Path(__file__).parents[1])}
        running = [
            subprocess.Popen(command, stdout=subprocess.PIPE, text=True, env=variables) for _ in range(processes)
        ]
        found = [json.loads(process.communicate()[0].splitlines()[-1]) for process in running]
    return sum(samples / duration for samples, duration in found)


def measure(seconds: float) -> str:
    """A table: with 1 and 2 local workers, beside as many processes without a cluster, what is reached of the ideal."""
    cores, rows = os.cpu_count() or 1, []
    for count in (1, 2):
        ideal = alone(count, max(1, cores // count), seconds)
        result = tt.cluster.render(NAME, cluster=f"local:{count}", time=seconds, **SCENE)
        rate = result.samples / result.seconds
        rows.append([count, f"{ideal:.2f}", f"{rate:.2f}", f"{rate / ideal:.1%}"])
    columns = ["workers", "ideal, samples/s", "cluster, samples/s", "of ideal"]
    return table(f"paths in the Cornell box at 512², {seconds:g} s each", columns, rows)


if __name__ == "__main__":
    print(describe_machine())
    print(measure(float(sys.argv[1]) if sys.argv[1:] else SECONDS))
