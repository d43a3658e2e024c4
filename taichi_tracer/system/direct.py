"""Whether Python reads and writes the memory of Taichi's fields itself: on a CPU, as long as ``taichi_17`` is there.

Otherwise kernels copy, as on a GPU.
"""

from typing import Any

from taichi_tracer.system.runtime import ensure

places: Any = None  # ``taichi_17.field_memory``, as soon as it is in use


def is_possible() -> bool:
    """Whether kernels and Python have the same memory, and Python knows where a field is in it."""
    return ensure().arch == "cpu" and places is not None
