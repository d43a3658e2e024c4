"""How the time per frame grows with the triangles, and what a second thread is worth.

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
THREADS_MESH = "82000"


def frame_milliseconds(scene: tt.SceneData) -> float:
    """Median of the normal view, whole frame, after those that compile."""
    call = frame(scene, RESOLUTION)
    seconds = []
    for i in range(RUNS + 3):
        time.sleep(REST)
        start = time.perf_counter()
        call()
        if i >= 3:
            seconds.append(time.perf_counter() - start)
    return statistics.median(seconds) * 1e3


def by_triangles(meshes: dict) -> str:
    """A markdown table: the same picture of more and more triangles."""
    lines = [f"\n**normal view, {RESOLUTION}²**\n", "| | ms per frame | relative to the first |", "|---|--:|--:|"]
    medians = {name: frame_milliseconds(tt.scene_from_mesh(*mesh)) for name, mesh in meshes.items()}
    first = next(iter(medians.values()))
    lines += [f"| {name} | {ms:.3g} | {ms / first:.2f} |" for name, ms in medians.items()]
    return "\n".join(lines) + "\n"


def by_threads(name: str, mesh: tuple) -> str:
    """A markdown table: one thread and two, in turns; each time Taichi starts anew."""
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
