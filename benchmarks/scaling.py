"""How the time per frame grows with the number of triangles, and how much a second thread gains.

python -m benchmarks.scaling [TRIANGLES | FILE ...]
"""

import statistics
import sys
import time

import taichi_tracer as tt
from benchmarks.measure import REST, RUNS, describe_machine
from benchmarks.meshes import from_arguments
from benchmarks.rays import frame

RESOLUTION = 1024
ROUNDS = 3
WARM_UP = 3  # frames before the measurement, which compile
THREADS_MESH = "82000"  # triangles


def frame_milliseconds(scene: tt.SceneData) -> float:
    """The median time of a whole frame of the normal view, in milliseconds."""
    call = frame(scene, RESOLUTION)
    seconds = []
    for i in range(RUNS + WARM_UP):
        time.sleep(REST)
        start = time.perf_counter()
        call()
        if i >= WARM_UP:
            seconds.append(time.perf_counter() - start)
    return statistics.median(seconds) * 1e3


def by_triangles(meshes: dict) -> str:
    """A markdown table: the same picture with more and more triangles."""
    lines = [f"\n**normal view, {RESOLUTION}²**\n", "| | ms per frame | relative to the first |", "|---|--:|--:|"]
    medians = {name: frame_milliseconds(tt.scene_from_mesh(*mesh)) for name, mesh in meshes.items()}
    first = next(iter(medians.values()))
    lines += [f"| {name} | {ms:.3g} | {ms / first:.2f} |" for name, ms in medians.items()]
    return "\n".join(lines) + "\n"


def by_threads(name: str, mesh: tuple) -> str:
    """A markdown table: one thread and two threads, in turns. Taichi starts again for each measurement."""
    medians: dict[int, list[float]] = {1: [], 2: []}
    for _ in range(ROUNDS):
        for threads, values in medians.items():
            tt.init("cpu", threads=threads, force=True)
            values.append(frame_milliseconds(tt.scene_from_mesh(*mesh)))
    ms = {threads: statistics.median(values) for threads, values in medians.items()}
    lines = [f"\n**{name}: normal view, {RESOLUTION}²**\n", "| threads | ms per frame | speed |", "|---|--:|--:|"]
    lines += [f"| {threads} | {value:.3g} | {ms[1] / value:.2f} |" for threads, value in ms.items()]
    return "\n".join(lines) + "\n"


def report(arguments: list[str]) -> str:
    """Both tables."""
    tt.init(arch="auto")
    text = by_triangles(from_arguments(arguments))
    ((name, mesh),) = from_arguments([THREADS_MESH]).items()
    return text + by_threads(name, mesh)


if __name__ == "__main__":
    print(describe_machine() + report(sys.argv[1:]))
