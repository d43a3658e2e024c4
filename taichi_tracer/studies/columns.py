"""Tables for a terminal, and the machine on which their numbers were measured."""

import os
import platform
from collections.abc import Sequence

import taichi as ti

from taichi_tracer.system import runtime


def in_columns(rows: Sequence[dict[str, str]]) -> list[str]:
    """Rows as lines in which each column has the same width, below the names of the columns; nothing for no rows."""
    lines = [list(row.values()) for row in rows]
    if lines:
        lines.insert(0, list(rows[0]))
    widths = [max(map(len, column)) for column in zip(*lines, strict=True)]
    return ["  ".join(word.ljust(width) for word, width in zip(line, widths, strict=True)).rstrip() for line in lines]


# ── the machine ──


def describe_machine() -> str:
    """Versions, backend and processors, in one line."""
    facts = {
        "python": platform.python_version(),
        "taichi": ".".join(str(part) for part in ti.__version__),
        "system": f"{platform.system()} {platform.machine()}",
        "backend": runtime.ensure().arch,
        "processors": str(os.cpu_count()),
    }
    return ", ".join(f"{name} {value}" for name, value in facts.items())
