"""One thread at a time uses Taichi: it has one state for all threads, and ends the process where two change it."""

import functools
import os
import threading
from collections.abc import Callable
from pathlib import Path
from typing import Any, TypeVar

from taichi.lang import impl

Function = TypeVar("Function", bound=Callable)
LOCK = threading.RLock()
starter = threading.main_thread().ident  # the thread that has started Taichi: Taichi's own trees of fields are its
_user: int | None = None  # the thread that has the lock
OWN = 11, 15  # fields of /proc/<pid>/stat after the name: user, system, and both of the children that have ended


def one_at_a_time(function: Function) -> Function:
    """The function, which waits until no other thread is in one that is decorated like this."""

    @functools.wraps(function)
    def called(*arguments: Any, **named: Any) -> Any:
        global _user
        with LOCK:
            former, _user = _user, threading.get_ident()
            try:
                return function(*arguments, **named)
            finally:
                _user = former

    return called  # type: ignore[return-value]


def inside_kernel() -> bool:
    """Whether this thread reads a kernel; another one may read one meanwhile."""
    return impl.inside_kernel() and _user in (None, threading.get_ident())


def note_start() -> None:
    """Note that this thread starts Taichi."""
    global starter
    starter = threading.get_ident()


def is_starter() -> bool:
    """Whether this thread has started Taichi."""
    return starter == threading.get_ident()


def usable_processors() -> int:
    """How many processors this process may use."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


def own_seconds(pid: int) -> float:
    """Processor seconds of a process, and of its children that have ended; 0 if the process has ended."""
    try:
        fields = Path(f"/proc/{pid}/stat").read_text("utf-8").rpartition(")")[2].split()
    except OSError:
        return 0.0
    return sum(int(word) for word in fields[OWN[0] : OWN[1]]) / os.sysconf("SC_CLK_TCK")
