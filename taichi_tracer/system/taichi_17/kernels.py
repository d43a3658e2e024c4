"""What happens around the reading, the translating and the launch of a kernel.

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
from taichi_tracer.system.compile_time import one_at_a_time
from taichi_tracer.system.errors import CannotCompileError, StaleSceneError
from taichi_tracer.system.stopwatch import KERNELS_MADE, KERNELS_READ, stage
from taichi_tracer.system.taichi_17.arguments import LAUNCHES

_NUMBERS = re.compile(r"_c\d+_\d+$")  # what Taichi adds to the name of a kernel


def launching(call: Callable) -> Callable:
    """``Kernel.__call__``, one after the other; it reads a kernel again whose objects have other fields by now."""

    @one_at_a_time
    @functools.wraps(call)
    def called(self: Any, *arguments: Any, **named: Any) -> Any:
        try:
            return call(self, *arguments, **named)
        except StaleSceneError:
            launches = {key: LAUNCHES.get(kernel) for key, kernel in self.compiled_kernels.items()}
            dead = [key for key, launch in launches.items() if launch is not None and not launch.is_alive()]
            if not dead:
                raise
            for key in dead:
                del self.compiled_kernels[key]
            return call(self, *arguments, **named)

    return called


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
