"""How long Taichi has made machine code of kernels: which kernels, and what a second run need not do again.

The first call of a kernel has two parts. Python reads the source of the kernel and builds Taichi's own program, in
every process. Then Taichi translates this program into machine code, which it keeps in a folder, so that another
process finds it there. Only the second part is what a second run is spared.
"""

import math
import re
from dataclasses import dataclass
from time import perf_counter, thread_time
from typing import Any

from taichi._lib import core

from taichi_tracer.system.stopwatch import KERNELS_MADE, KERNELS_READ, part

FOUND = 0.04  # seconds: a kernel that took less was found in the folder, or is so small that it does not matter
# Seconds of the processor: a kernel that took less was found. That of direct light takes 0.02 s to load, and the
# smallest kernel of the package takes 0.04 s to translate.
LOADED = 0.03
# Of the seconds in which Python read the kernel: a large one takes 0.05 of them to load, and 1.5 to translate.
LOADED_SHARE = 0.1
_NUMBERS = re.compile(r"_c\d+_\d+$")  # what Taichi adds to the name of a kernel
_spent: list[float] = []  # seconds of every translation that took longer
_is_watched = False


@dataclass
class Kernel:
    """A kernel of this process.

    Attributes:
        name: the name of its function, such as "Film._clear".
        read_at: the value of ``time.perf_counter`` when Python began to read it.
        reading: the seconds in which Python read it.
        translating: the seconds in which Taichi translated it, or found and loaded what it had kept.
        processor: the seconds of the processor of the same, which other programs do not make longer.
    """

    name: str
    read_at: float = 0.0
    reading: float = 0.0
    translating: float = 0.0
    processor: float = 0.0

    @property
    def is_new(self) -> bool:
        """Whether it took so long that it was not found in the folder."""
        return self.processor > max(LOADED, LOADED_SHARE * self.reading)


_kernels: list[Kernel] = []
_by_id: dict[int, Kernel] = {}


def watch() -> None:
    """Count from now on, in this process."""
    global _is_watched
    original = getattr(core.Program, "compile_kernel", None)
    if _is_watched or original is None:
        return

    def compile_kernel(*words: Any):
        start, processor = perf_counter(), thread_time()
        try:
            with part(KERNELS_MADE):
                return original(*words)
        finally:
            seconds = perf_counter() - start
            kernel = _by_id.pop(id(words[-1]), None)
            if kernel is not None:
                kernel.translating, kernel.processor = seconds, thread_time() - processor
            if seconds > FOUND:  # Taichi asks at each launch: most of them take microseconds
                _spent.append(seconds)

    core.Program.compile_kernel = compile_kernel
    _watch_reading()
    _is_watched = True


def _watch_reading() -> None:
    """Note each kernel that Python reads."""
    original = getattr(core.Program, "create_kernel", None)
    if original is None:
        return

    def create_kernel(program: Any, build: Any, name: str, *words: Any):
        start = perf_counter()
        with part(KERNELS_READ):
            made = original(program, build, name, *words)
        kernel = Kernel(_function_name(build, name), start, perf_counter() - start)
        _kernels.append(kernel)
        _by_id[id(made)] = kernel
        return made

    core.Program.create_kernel = create_kernel


def _function_name(build: Any, name: str) -> str:
    """The name of a kernel's function, with that of its class.

    Args:
        build: what Taichi calls to build the kernel; it refers to the kernel as "self".
        name: Taichi's own name of the kernel, which does not have the class.
    """
    try:
        held = dict(zip(build.__code__.co_freevars, build.__closure__, strict=True))
        return held["self"].cell_contents.func.__qualname__
    except (AttributeError, KeyError, TypeError, ValueError):
        return _NUMBERS.sub("", name)


def seconds_to_save() -> float:
    """The seconds that were spent on kernels that were not in the folder, so that another process is spared them."""
    return sum(_spent)


def kernels_made() -> int:
    """How many kernels were not in the folder."""
    return len(_spent)


def kernels(since: float = -math.inf) -> list[Kernel]:
    """Every kernel that was used in this process since ``watch``, in the order of their first calls.

    Args:
        since: a value of ``time.perf_counter``: only kernels that were first called later.
    """
    return [kernel for kernel in _kernels if kernel.read_at >= since]
