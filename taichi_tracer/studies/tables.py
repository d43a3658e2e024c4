"""Tables for a terminal: columns, where the time of a picture goes, and the machine on which numbers were measured."""

import os
import platform
from collections.abc import Sequence

import taichi as ti

from taichi_tracer.system import runtime
from taichi_tracer.system.compiling import Kernel
from taichi_tracer.system.stopwatch import STAGES, Stopwatch


def in_columns(rows: Sequence[dict[str, str]]) -> list[str]:
    """Rows as lines in which each column has the same width, below the names of the columns; nothing for no rows."""
    lines = [*map(list, rows[:1]), *(list(row.values()) for row in rows)]
    widths = [max(map(len, column)) for column in zip(*lines, strict=True)]
    return ["  ".join(word.ljust(width) for word, width in zip(line, widths, strict=True)).rstrip() for line in lines]


def describe_machine() -> str:
    """Versions, backend and processors, in one line."""
    taichi, system = ".".join(map(str, ti.__version__)), f"{platform.system()} {platform.machine()}"
    return (
        f"python {platform.python_version()}, taichi {taichi}, system {system}, backend {runtime.ensure().arch}, "
        f"processors {os.cpu_count()}"
    )


def profile(stopwatch: Stopwatch, kernels: Sequence[Kernel]) -> list[str]:
    """The stages of a stopped stopwatch, whose seconds add up to the total, and the kernels in their order."""
    total = sum(stopwatch.seconds.values())
    rows = [(name, stopwatch.seconds[name]) for name in STAGES] + [("total", total)]
    wide = max(len(name) for name, _ in rows)
    lines = [f"{name:<{wide}}  {seconds:8.3f} s  {100 * seconds / total:5.1f} %" for name, seconds in rows]
    new = [kernel.translating for kernel in kernels if kernel.is_new]
    count = f"{len(kernels)} kernel{'s' * (len(kernels) != 1)}"
    lines.append(f"{count}, {len(new)} of them translated anew ({sum(new):.2f} s)")
    for kernel in kernels:
        how = "translated" if kernel.is_new else "loaded"
        lines.append(f"  {kernel.name}: read in {kernel.reading:.3f} s, {how} in {kernel.translating:.3f} s")
    return lines
