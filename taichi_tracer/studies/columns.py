"""Tables for a terminal, and the machine on which their numbers were measured."""

import os
import platform
from collections.abc import Sequence

import taichi as ti

from taichi_tracer.system import runtime


def in_columns(rows: Sequence[dict[str, str]]) -> list[str]:
    """Rows as lines in which each column has the same width, below the names of the columns; nothing for no rows."""
    lines = [*map(list, rows[:1]), *(list(row.values()) for row in rows)]
    widths = [max(map(len, column)) for column in zip(*lines, strict=True)]
    return ["  ".join(word.ljust(width) for word, width in zip(line, widths, strict=True)).rstrip() for line in lines]


# ── the machine ──


def describe_machine() -> str:
    """Versions, backend and processors, in one line."""
    taichi, system = ".".join(map(str, ti.__version__)), f"{platform.system()} {platform.machine()}"
    return (
        f"python {platform.python_version()}, taichi {taichi}, system {system}, backend {runtime.ensure().arch}, "
        f"processors {os.cpu_count()}"
    )
