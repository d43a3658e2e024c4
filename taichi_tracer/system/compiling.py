"""How long Taichi has made machine code of kernels: which kernels, and what a second run need not do again.

The first call of a kernel has two parts. Python reads the source of the kernel and builds Taichi's own program. Then
Taichi translates this program into machine code, which it keeps in a folder, so that another process finds it there.

``taichi_17.arguments`` notes both parts here. Without its patches, no kernel is known, and no seconds either.
"""

import contextlib
import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from time import perf_counter, thread_time
from typing import Any

# Seconds of the processor: a kernel that took less was found. That of direct light takes 0.02 s to load, and the
# smallest kernel of the package takes 0.04 s to translate.
LOADED = 0.03
# Of the seconds in which Python read the kernel: a large one takes 0.05 of them to load, and 1.5 to translate.
LOADED_SHARE = 0.1


@dataclass
class Kernel:
    """A kernel of this process.

    Attributes:
        name: the name of its function, such as "_take_samples".
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


# The context in which Taichi translates or loads a kernel: meanwhile Python sees no signal, and no other thread runs.
around: Callable[[Kernel], contextlib.AbstractContextManager] = contextlib.nullcontext
_kernels: list[Kernel] = []
_by_id: dict[int, Kernel] = {}
_machine_code: list[float] = []  # seconds in which it was made


def note_reading(made: Any, name: str, read_at: float, reading: float) -> None:
    """Python has read a kernel.

    Args:
        made: Taichi's object of the kernel. name: of its function.
        read_at: the value of ``time.perf_counter`` when it began. reading: the seconds that it took.
    """
    _by_id[id(made)] = Kernel(name, read_at, reading)
    _kernels.append(_by_id[id(made)])


@contextlib.contextmanager
def translating(made: Any) -> Iterator[None]:
    """The context in which Taichi translates or loads a kernel; nothing happens where it is only launched again.

    Args:
        made: Taichi's object of the kernel.
    """
    kernel = _by_id.pop(id(made), None)
    if kernel is None:
        yield
        return
    with around(kernel):
        start, processor = perf_counter(), thread_time()
        try:
            yield
        finally:
            kernel.translating, kernel.processor = perf_counter() - start, thread_time() - processor


@contextlib.contextmanager
def first_launch() -> Iterator[None]:
    """The context of a launch in which a kernel does nothing: LLVM makes its machine code, also where it was kept."""
    start, before = perf_counter(), seconds_spent()
    yield
    _machine_code.append(perf_counter() - start - (seconds_spent() - before))


def seconds_spent() -> float:
    """The seconds in which kernels were read, translated or loaded, and made machine code, in this process."""
    return sum(kernel.reading + kernel.translating for kernel in _kernels) + sum(_machine_code)


def kernels(since: float = -math.inf) -> list[Kernel]:
    """Every kernel that was used in this process since ``init``, in the order of their first calls.

    Args:
        since: a value of ``time.perf_counter``: only kernels that were first called later.
    """
    return [kernel for kernel in _kernels if kernel.read_at >= since]
