"""Medians of runs that take turns, so that a noisy machine is as noisy for all."""

import datetime
import importlib.metadata
import os
import platform
import statistics
import time
from collections.abc import Callable
from pathlib import Path

RUNS = 7
REST = 0.05  # seconds before each call: threads of some libraries keep a core busy for a while after their work


def interleaved(candidates: dict[str, Callable[[], object]], runs: int = RUNS) -> dict[str, float]:
    """Name → median seconds of calling each candidate, in turn, after two calls that compile and warm up."""
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
    """A markdown table: each candidate's median and its speed relative to ``base``.

    Args:
        unit: of the figure shown: "ms", or the thing counted when ``per_second`` says how many there are in a call.
    """
    lines = [f"\n**{title}**\n", f"| | {unit} | speed relative to {base} |", "|---|--:|--:|"]
    for name, seconds in medians.items():
        figure = seconds * 1e3 if per_second is None else per_second / seconds / 1e6
        lines.append(f"| {name} | {figure:.3g} | {medians[base] / seconds:.2f} |")
    return "\n".join(lines) + "\n"


def describe_machine() -> str:
    """Date, processor, threads and versions."""
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
