"""Medians of runs that take turns, so that the noise of the machine affects all candidates equally."""

import datetime
import importlib.metadata
import os
import platform
import statistics
import time
from collections.abc import Callable
from pathlib import Path

RUNS = 7
REST = 0.05  # seconds before each call, because threads of some libraries stay busy for a while after their work


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
    """The date, the processor, the number of threads, and the versions of the libraries."""
    model = platform.processor() or platform.machine()
    cpuinfo = Path("/proc/cpuinfo")
    if cpuinfo.exists():
        names = [line.split(":", 1)[1].strip() for line in cpuinfo.read_text().splitlines() if "model name" in line]
        model = names[0] if names else model
    versions = ", ".join(f"{name} {_version(name)}" for name in ("taichi", "numpy", "mitsuba", "embreex", "trimesh"))
    threads = len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count()
    today = datetime.date.today().isoformat()
    return f"{today}; {model}, {threads} threads; Python {platform.python_version()}, {versions}\n"


def _version(name: str) -> str:
    try:
        return importlib.metadata.version(name)
    except importlib.metadata.PackageNotFoundError:
        return "absent"
