"""What happens around the reading and the translating of a kernel: it is counted.

``Program.create_kernel`` lets Python read a kernel. ``Program.compile_kernel`` translates it, or finds and loads what
was translated before; Taichi asks it at each launch.
"""

import functools
import re
from collections.abc import Callable
from time import perf_counter
from typing import Any

import taichi as ti

from taichi_tracer.system import compiling
from taichi_tracer.system.errors import CannotCompileError
from taichi_tracer.system.stopwatch import KERNELS_MADE, KERNELS_READ, stage
from taichi_tracer.system.threads import one_at_a_time as one_at_a_time

_NUMBERS = re.compile(r"_c\d+_\d+$")  # what Taichi adds to the name of a kernel


def counting_reading(create: Callable) -> Callable:
    """``Program.create_kernel``, which reports each kernel to ``compiling``."""

    @functools.wraps(create)
    def created(program: Any, build: Any, name: str, *words: Any) -> Any:
        start = perf_counter()
        with stage(KERNELS_READ):
            made = create(program, build, name, *words)
        compiling.note_reading(made, _NUMBERS.sub("", name), start, perf_counter() - start)
        return made

    return created


def counting_translating(compile_it: Callable) -> Callable:
    """``Program.compile_kernel``, which reports each kernel to ``compiling``.

    What a GPU's backend cannot compile gives a message of one line, with what works instead.
    """

    @functools.wraps(compile_it)
    def compiled(*words: Any) -> Any:
        try:
            with stage(KERNELS_MADE), compiling.translating(words[-1]):
                return compile_it(*words)
        except RuntimeError as error:
            arch = getattr(words[-3], "arch", None)  # of the configuration, behind the program
            if arch in (None, ti.x64, ti.arm64):
                raise
            lines = str(error).strip().splitlines() or [type(error).__name__]
            raise CannotCompileError(f"{arch.name} cannot compile a kernel ({lines[0]})") from error

    return compiled
