"""How long ago this process was started: what a user has waited since the key press, loading of Python included."""

import os
import sys
import time

_IMPORTED = time.perf_counter()  # stands in for the start where the system does not tell it
FILETIME_PER_SECOND = 1e7  # Windows counts time in units of 100 ns
START_FIELD = 19  # of /proc/self/stat after the name of the program: the start, in ticks since the machine was booted


def seconds_since_start() -> float:
    """Seconds since the system started this process; on macOS, since the package was imported."""
    try:
        if sys.platform.startswith("linux"):
            return _since_start_on_linux()
        if sys.platform == "win32":
            return _since_start_on_windows()
    except (OSError, ValueError, AttributeError, IndexError):
        pass
    return time.perf_counter() - _IMPORTED


def started_at() -> float:
    """The value that ``time.perf_counter`` had when the system started this process."""
    return time.perf_counter() - seconds_since_start()


def _since_start_on_linux() -> float:
    with open("/proc/self/stat", encoding="utf-8") as file:
        fields = file.read().rpartition(")")[2].split()
    start = int(fields[START_FIELD]) / os.sysconf("SC_CLK_TCK")
    return time.clock_gettime(time.CLOCK_BOOTTIME) - start


def _since_start_on_windows() -> float:
    import ctypes

    created, *others = (ctypes.c_uint64() for _ in range(4))
    kernel, now = ctypes.windll.kernel32, ctypes.c_uint64()  # type: ignore[attr-defined,unused-ignore]
    kernel.GetProcessTimes(ctypes.c_void_p(-1), *(ctypes.byref(t) for t in (created, *others)))
    kernel.GetSystemTimeAsFileTime(ctypes.byref(now))
    return (now.value - created.value) / FILETIME_PER_SECOND
