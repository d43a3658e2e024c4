"""Medians of runs that take turns, so that the noise of the machine affects all candidates equally."""

import atexit
import datetime
import importlib.metadata
import os
import platform
import statistics
import time
from collections.abc import Callable
from pathlib import Path

from taichi_tracer.system import processors

RUNS = 7
LOOK = 0.5  # seconds over which the share of other programs is measured
VECTORS = {"avx512f": "AVX-512", "avx2": "AVX2"}  # of the processor, on which ratios depend; the widest first
REST = 0.05  # seconds before each call, because threads of some libraries stay busy for a while after their work


IDLE = 3, 4  # fields of the line "cpu" of /proc/stat: idle, and waiting for a disk
BUSY_FIELDS = 8  # further fields count the time of guests again


def busy_seconds() -> float | None:
    """Processor seconds that all programs have used since the machine was started; None where only Linux would know."""
    try:
        with open("/proc/stat", encoding="utf-8") as file:
            fields = [int(word) for word in file.readline().split()[1 : 1 + BUSY_FIELDS]]
    except (OSError, ValueError):
        return None
    return (sum(fields) - sum(fields[i] for i in IDLE)) / os.sysconf("SC_CLK_TCK")


def interleaved(candidates: dict[str, Callable[[], object]], runs: int = RUNS) -> dict[str, float]:
    """Name → median time of a call in seconds. The candidates take turns, after two calls that compile and warm up."""
    for call in candidates.values():
        call()
        call()
    seconds: dict[str, list[float]] = {name: [] for name in candidates}
    for _ in range(runs):
        for name, call in candidates.items():
            time.sleep(REST)
            start = time.perf_counter()
            call()
            seconds[name].append(time.perf_counter() - start)
    return {name: statistics.median(values) for name, values in seconds.items()}


def ratio_table(title: str, medians: dict[str, float], base: str, unit: str, per_second: float | None = None) -> str:
    """A markdown table: for each candidate, its median and its speed relative to ``base``.

    Args:
        unit: the unit of the figures: "ms", or for example "million rays/s".
        per_second: the number of rays, for example, in one call; None shows the time of a call.
    """
    lines = [f"\n**{title}**\n", f"| | {unit} | speed relative to {base} |", "|---|--:|--:|"]
    for name, seconds in medians.items():
        figure = seconds * 1e3 if per_second is None else per_second / seconds / 1e6
        lines.append(f"| {name} | {figure:.3g} | {medians[base] / seconds:.2f} |")
    return "\n".join(lines) + "\n"


def describe_machine() -> str:
    """The time, the processor, the number of threads, and the versions of the libraries; see ``note_others``, too."""
    model = platform.processor() or platform.machine()
    cpuinfo = Path("/proc/cpuinfo")
    if cpuinfo.exists():
        lines = [line.partition(":") for line in cpuinfo.read_text().splitlines()]
        facts = {name.strip(): value.strip() for name, _, value in lines}  # of the last processor
        flags = facts.get("flags", "").split()
        widest = next((f" with {name}" for flag, name in VECTORS.items() if flag in flags), "")
        model = facts.get("model name", model) + widest
    versions = ", ".join(f"{name} {_version(name)}" for name in ("taichi", "numpy", "mitsuba", "embreex", "trimesh"))
    now = f"{datetime.datetime.now(datetime.timezone.utc):%Y-%m-%d %H:%M} UTC"
    note_others()
    return f"{now}; {model}, {processors.usable()} threads; Python {platform.python_version()}, {versions}\n"


def note_others() -> None:
    """At the end of this process, print how busy other programs kept the processors: before, during and after it."""
    if busy_seconds() is not None:
        before, since = busy_share_of_others(LOOK), moment()

        def tell() -> None:
            during, after = share_of_others(since, moment()), busy_share_of_others(LOOK)
            shares = f"{before:.0%} before, {during:.0%} during, {after:.0%} after"
            print(f"\nOther programs kept the processors busy: {shares}.")

        atexit.register(tell)


def busy_share_of_others(seconds: float) -> float:
    """The share of all processors that other programs take, over some seconds in which this process rests."""
    since = moment()
    time.sleep(seconds)
    return share_of_others(since, moment())


def share_of_others(since: tuple[float, float, float], until: tuple[float, float, float]) -> float:
    """The share of all processors that other programs took between two ``moment``s, from 0 to 1."""
    clock, busy, own = (b - a for a, b in zip(since, until, strict=True))
    return min(1.0, max(0.0, (busy - own) / (clock * (os.cpu_count() or 1))))


def moment() -> tuple[float, float, float]:
    """(seconds of the clock, of all processors, of this process and the processes that it has started and awaited)."""
    times = os.times()
    own = times.user + times.system + times.children_user + times.children_system
    return time.perf_counter(), busy_seconds() or 0.0, own


def _version(name: str) -> str:
    try:
        return importlib.metadata.version(name)
    except importlib.metadata.PackageNotFoundError:
        return "absent"
