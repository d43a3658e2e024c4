"""What a cluster gains and costs: efficiency with local workers, bytes, memory, overhead; and a simulation of many.

python -m benchmarks.cluster                 measure with 1 and 2 workers on this machine
python -m benchmarks.cluster --simulate      1, 10, 100 and 1,000 workers, with times and sizes that were measured
"""

import argparse
import heapq
import json
import math
import os
import subprocess
import sys
import tempfile
import time
from dataclasses import dataclass
from pathlib import Path

from benchmarks.measure import describe_machine
from taichi_tracer.cluster import ranges, sharing

SCENE = {"estimator": "path", "size": (512, 512), "arch": "cpu"}
NAME, SECONDS = "cornell_box", 60.0
TASKS = 300  # that do nothing, to learn what handing out takes
ALONE = """
import json, sys, time, taichi_tracer as tt
tt.init("cpu", threads=int(sys.argv[1]))
renderer = tt.A4Renderer(tt.load_scene_data("cornell_box"), 512, 512).use("path")
renderer.render(2)
start, cpu = time.perf_counter(), time.process_time()
renderer.render(time=float(sys.argv[2]))
print(json.dumps([renderer.samples - 2, time.perf_counter() - start, time.process_time() - cpu]))
"""


def alone(processes: int, threads: int, seconds: float) -> tuple[float, float]:
    """The ideal: some processes that render at the same time without a cluster.

    Returns:
        Samples per second, and seconds of processors per sample.
    """
    with tempfile.TemporaryDirectory() as folder:
        program = Path(folder) / "alone.py"  # kernels need their source in a file
        program.write_text(ALONE, encoding="utf-8")
        command = [sys.executable, str(program), str(threads), str(seconds)]
        variables = os.environ | {"PYTHONPATH": str(Path(__file__).parents[1])}
        running = [
            subprocess.Popen(command, stdout=subprocess.PIPE, text=True, env=variables) for _ in range(processes)
        ]
        found = [json.loads(process.communicate()[0].splitlines()[-1]) for process in running]
    return sum(n / taken for n, taken, _ in found), sum(cpu for *_, cpu in found) / sum(n for n, *_ in found)


def measure(seconds: float) -> str:
    """With 1 and 2 local workers, beside as many processes without a cluster: what is reached of the ideal.

    Where other programs use the machine, samples per second vary. What of the ideal is reached is therefore the
    fraction of the time in which workers render, times the ratio of the processors' seconds per sample.
    """
    import taichi_tracer as tt

    cores, rows = os.cpu_count() or 1, []
    for count in (1, 2):
        threads = max(1, cores // count)
        rate, cpu = alone(count, threads, seconds / 2)
        load = os.getloadavg()[0] if hasattr(os, "getloadavg") else float("nan")
        result = tt.cluster.render(NAME, cluster=f"local:{count}", time=seconds, **SCENE)
        told = result.statistics
        memory = max(worker.get("memory", 0) for worker in told.workers.values())
        busy, ratio = told.rendering / (count * told.seconds), cpu * result.samples / told.processors
        overhead = (count * told.seconds - told.rendering) / max(1, told.ranges)
        rows.append(
            f"| {count} | {rate:.2f} | {result.samples / told.seconds:.2f} "
            f"| {busy:.1%} | {ratio:.1%} | {busy * ratio:.1%} "
            f"| {told.start:.1f} | {told.ranges} | {1e3 * overhead:.0f} | {told.bytes_sent / 1e6:.1f} "
            f"| {told.bytes_received / 1e6:.1f} | {memory / 1e6:.0f} | {load:.1f} |"
        )
    head = (
        "| workers | ideal, samples/s | cluster, samples/s | workers render | processors per sample, ideal / cluster "
        "| of ideal | start, s | ranges | overhead per range, ms "
        "| sent, MB | received, MB | memory of a worker, MB | load |"
    )
    return "\n".join([head, "|" + "--:|" * 13, *rows])


def costs() -> "Model":
    """What the simulation needs to know, measured here."""
    import taichi_tracer as tt
    from taichi_tracer.cluster import parcels_of, worker
    from taichi_tracer.cluster.child import Desk

    with tt.cluster.connect("local:1", print) as connection:
        while not connection.members:
            connection.looked_at = -1.0
            connection.look()
        (address,) = connection.members
        start = time.perf_counter()
        for future in [connection.submit(worker.introduce, at=[address]) for _ in range(TASKS)]:
            future.result()
        overhead = (time.perf_counter() - start) / TASKS
    (parcel,), _ = parcels_of([{"scene": NAME, **SCENE}])
    desk = Desk(None, None)
    desk.receive(parcel.message(), {})
    which = (0, 0, None)
    parts = [desk.render(parcel.id, which, first, 2) for first in range(0, 16, 2)]
    desk.merge(parcel.id, which, parts)
    start = time.perf_counter()
    desk.merge(parcel.id, which, parts)
    merge = (time.perf_counter() - start) / len(parts)
    renderer = desk.renderer_of(parcel.id, which)
    renderer.error()
    start = time.perf_counter()
    renderer.error()
    put = merge + time.perf_counter() - start
    desk.close()
    size = sum(array.nbytes for array in parts[0]["arrays"].values())
    return Model(overhead=overhead, merge=merge, put=put, part=size)


# ── the simulation ──


@dataclass(frozen=True)
class Model:
    """What the simulation knows of a cluster; seconds and bytes.

    Attributes:
        range_seconds: of a range. overhead: of handing it out, at the scheduler and this machine, one after the other.
        part: bytes of a film. merge: seconds in which a worker adds two films. put: seconds in which this machine
            takes a film and estimates the error. network: bytes per second of one connection.
        fan_in: films that one step of the tree adds up. share: of the time, for collecting.
        scene: bytes of the files of a large scene.
    """

    overhead: float
    part: float
    merge: float
    put: float
    range_seconds: float = ranges.SECONDS
    network: float = 118e6
    fan_in: int = sharing.FAN_IN
    share: float = sharing.COST_OF_COLLECTING
    scene: float = 500e6


# What was measured on two threads of a Xeon, with 1 Gbit/s and a scene of 500 MB; see RESULTS.md.
MEASURED = Model(overhead=0.005, part=14680268, merge=0.037, put=0.071)


@dataclass(frozen=True)
class Simulated:
    """What so many workers did: the fraction of their time in which they rendered, and what was busy meanwhile."""

    workers: int
    efficiency: float
    scheduler_busy: float
    root_busy: float
    interval: float
    memory: float
    start: float


def simulate(workers: int, model: Model, seconds: float = 600.0) -> Simulated:
    """Ranges event by event: handed out one after the other, of equal length, with one more waiting at each.

    What the tree takes of the workers' time is spread over them evenly: a worker sends and adds up what it has, and
    does its part of the inner nodes. A scene goes from each worker that has it to another one.
    """
    depth, width = 0, workers
    while width > 1:
        width, depth = -(-width // model.fan_in), depth + 1
    hop = model.fan_in * model.part / model.network + (model.fan_in - 1) * model.merge
    last = model.part / model.network + model.put
    interval = max(1.0, last / model.share, depth * hop)
    free_at = 0.0  # when the one that hands out is free
    rendered = handed = 0.0
    ready = [(0.0, i) for i in range(workers)]
    heapq.heapify(ready)
    # Every collection lets each worker add up what it has since the last one, and its share of the tree's inner nodes.
    per_collection = (interval / model.range_seconds + 1 / (model.fan_in - 1)) * (
        model.merge + model.part / model.network
    )
    stretch = 1 + per_collection / interval
    while ready:
        now, i = heapq.heappop(ready)
        if now >= seconds:
            continue
        free_at = max(free_at, now) + model.overhead
        handed += model.overhead
        start = max(now, free_at - model.range_seconds)  # a second range waits at each worker
        rendered += model.range_seconds
        heapq.heappush(ready, (start + model.range_seconds * stretch, i))
    memory = model.part * (interval / model.range_seconds + model.fan_in)
    root = last / interval
    start = math.ceil(math.log2(workers + 1)) * model.scene / model.network
    return Simulated(workers, rendered / (workers * seconds), handed / seconds, root, interval, memory, start)


def simulation(model: Model) -> str:
    """The table of 1, 10, 100, 1,000 and 10,000 workers."""
    lines = [
        "| workers | efficiency | who hands out is busy | this machine is busy with sums | seconds between sums "
        "| films in a worker's memory, MB | seconds until all have the scene |",
        "|--:|--:|--:|--:|--:|--:|--:|",
    ]
    for workers in (1, 10, 100, 1_000, 10_000):
        one = simulate(workers, model)
        lines.append(
            f"| {workers:,} | {min(1.0, one.efficiency):.1%} | {one.scheduler_busy:.1%} | {one.root_busy:.1%} "
            f"| {one.interval:.1f} | {one.memory / 1e6:.0f} | {one.start:.0f} |"
        )
    return "\n".join(lines)


def main() -> None:
    """Print a section of RESULTS.md."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--simulate", action="store_true", help="simulate many workers")
    parser.add_argument("--seconds", type=float, default=SECONDS, help="of each measurement (default: %(default)s)")
    for name, default in vars(MEASURED).items():
        parser.add_argument(f"--{name.replace('_', '-')}", type=type(default), default=default, help="%(default)s")
    args = parser.parse_args()
    print(describe_machine(), end="\n\n")
    if args.simulate:
        model = Model(**{name: getattr(args, name) for name in vars(MEASURED)})
    else:
        print("**1 and 2 local workers, paths in the Cornell box at 512²**\n")
        print(measure(args.seconds), end="\n\n")
        model = costs()
    told = " ".join(f"--{name.replace('_', '-')} {value:.3g}" for name, value in vars(model).items())
    print(f"**many workers, simulated: {told}**\n")
    print(simulation(model))


if __name__ == "__main__":
    main()
