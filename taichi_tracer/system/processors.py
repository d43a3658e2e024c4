"""The processors of this machine: how many this process may use, and how long other processes have used them."""

import os
from collections.abc import Iterable

OWN = 11, 15  # fields of /proc/<pid>/stat after the name: user, system, and both of the children that have ended


def usable() -> int:
    """How many processors this process may use."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


def own_seconds(pids: Iterable[int]) -> float:
    """Processor seconds of some processes, and of their children that have ended; a process that has ended counts 0."""
    total = 0.0
    for pid in pids:
        try:
            with open(f"/proc/{pid}/stat", encoding="utf-8") as file:
                fields = file.read().rpartition(")")[2].split()
        except OSError:
            continue
        total += sum(int(word) for word in fields[OWN[0] : OWN[1]]) / os.sysconf("SC_CLK_TCK")
    return total
