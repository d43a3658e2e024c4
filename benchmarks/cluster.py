"""What a cluster gains: samples per second with local workers, beside processes without a cluster.

python -m benchmarks.cluster
"""

import argparse
import json
import os
import subprocess
import sys
import tempfile
from pathlib import Path

from benchmarks.measure import describe_machine

SCENE = {"estimator": "path", "size": (512, 512), "arch": "cpu"}
NAME, SECONDS = "cornell_box", 60.0
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
    return sum(n / taken for n, taken in found)


def measure(seconds: float) -> str:
    """A table: with 1 and 2 local workers, beside as many processes without a cluster, what is reached of the ideal."""
    import taichi_tracer as tt

    cores = os.cpu_count() or 1
    rows = ["| workers | ideal, samples/s | cluster, samples/s | of ideal |", "|--:|--:|--:|--:|"]
    for count in (1, 2):
        ideal = alone(count, max(1, cores // count), seconds / 2)
        result = tt.cluster.render(NAME, cluster=f"local:{count}", time=seconds, **SCENE)
        rate = result.samples / result.seconds
        rows.append(f"| {count} | {ideal:.2f} | {rate:.2f} | {rate / ideal:.1%} |")
    return "\n".join(rows)


def main() -> None:
    """Print a section of RESULTS.md."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--seconds", type=float, default=SECONDS, help="of each measurement (default: %(default)s)")
    args = parser.parse_args()
    print(describe_machine(), end="\n\n")
    print("**1 and 2 local workers, paths in the Cornell box at 512²**\n")
    print(measure(args.seconds))


if __name__ == "__main__":
    main()
