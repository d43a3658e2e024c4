"""What the numbers of a study were measured on."""

import os
import platform

import taichi as ti

from taichi_tracer.system import runtime


def machine_facts() -> dict[str, str]:
    """Versions, backend and processors, by name."""
    return {
        "python": platform.python_version(),
        "taichi": ".".join(str(part) for part in ti.__version__),
        "system": f"{platform.system()} {platform.machine()}",
        "backend": runtime.ensure().arch,
        "processors": str(os.cpu_count()),
    }


def describe_machine() -> str:
    """The facts in one line."""
    return ", ".join(f"{name} {value}" for name, value in machine_facts().items())
