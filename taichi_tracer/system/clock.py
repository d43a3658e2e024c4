"""How long ago this process was started: what a user has waited since the key press, loading of Python included."""

import os
import sys
import time

_IMPORTED = time.perf_counter()
FILETIME_PER_SECOND = 1e7  # Windows counts time in units of 100 ns
# Of /proc/self/stat after the name of the program: page faults of children that have ended; the start, in ticks since
# the machine was booted.
FAULTS_OF_CHILDREN, START_FIELD = 8, 19
LONG = 2.0  # seconds: no start of Python takes so long, unless the machine is busy


def seconds_since_start() -> float:
    """Seconds since the system started this process; on macOS, since the package was imported."""
    return time.perf_counter() - _IMPORTED + _BEFORE


def started_at() -> float:
    """The value that ``time.perf_counter`` had when the system started this process."""
    return time.perf_counter() - seconds_since_start()


def _since_start() -> float:
    """The same at the moment; 0 where the system does not tell it."""
    try:
        if sys.platform.startswith("linux"):
            return _since_start_on_linux()
        if sys.platform == "win32":
            return _since_start_on_windows()
    except (OSError, ValueError, AttributeError, IndexError):
        pass
    return 0.0


def _since_start_on_linux() -> float:
    """A shell may become its last command: then the process is as old as the shell, which had children before.

    When it became Python, the system does not tell; the seconds of the processor are what Python needed at least.
    """
    with open("/proc/self/stat", encoding="utf-8") as file:
        fields = file.read().rpartition(")")[2].split()
    start = int(fields[START_FIELD]) / os.sysconf("SC_CLK_TCK")
    seconds = time.clock_gettime(time.CLOCK_BOOTTIME) - start
    was_shell = int(fields[FAULTS_OF_CHILDREN]) > 0 and seconds > LONG
    return time.process_time() if was_shell else seconds


def _since_start_on_windows() -> float:
    import ctypes

    created, *others = (ctypes.c_uint64() for _ in range(4))
    kernel, now = ctypes.windll.kernel32, ctypes.c_uint64()  # type: ignore[attr-defined,unused-ignore]
    kernel.GetProcessTimes(ctypes.c_void_p(-1), *(ctypes.byref(t) for t in (created, *others)))
    kernel.GetSystemTimeAsFileTime(ctypes.byref(now))
    return (now.value - created.value) / FILETIME_PER_SECOND


_BEFORE = _since_start()  # seconds, until this file was imported
