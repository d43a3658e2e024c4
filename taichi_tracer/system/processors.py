"""The processors of this machine: how many this process may use, and what other programs take of them meanwhile."""

import os
import time
from collections.abc import Iterable
from dataclasses import dataclass, field

NOTICED = 0.15  # of all processors: what others take beyond this share is told; less changes no result
IDLE = 3, 4  # fields of the line "cpu" of /proc/stat: idle, and waiting for a disk
BUSY_FIELDS = 8  # further fields count the time of guests again, which is in the first ones
OWN = 11, 15  # fields of /proc/<pid>/stat after the name: user, system, and both of the children that have ended


def usable() -> int:
    """How many processors this process may use."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


def busy_seconds() -> float | None:
    """Processor seconds that all programs have used since the machine was started; None where only Linux would know."""
    try:
        with open("/proc/stat", encoding="utf-8") as file:
            fields = [int(word) for word in file.readline().split()[1 : 1 + BUSY_FIELDS]]
    except (OSError, ValueError):
        return None
    return (sum(fields) - sum(fields[i] for i in IDLE)) / os.sysconf("SC_CLK_TCK")


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


@dataclass
class Others:
    """What other programs use of the processors while a study measures.

    Attributes:
        looks: (moment, busy processor seconds of others) at each look.
    """

    looks: list[tuple[float, float]] = field(default_factory=list)

    def look(self, pids: Iterable[int]) -> None:
        """Look once more; the processes are those that belong to the study."""
        busy = busy_seconds()
        if busy is not None:
            self.looks.append((time.perf_counter(), busy - own_seconds(pids)))

    def told(self) -> str | None:
        """A sentence on what they took, from the first look to the last; None if that was too little to matter."""
        pairs = [(self.looks[0], self.looks[-1]), *zip(self.looks, self.looks[1:], strict=False)] if self.looks else []
        used = [max(0.0, (b1 - b0) / (t1 - t0)) for (t0, b0), (t1, b1) in pairs if t1 > t0]
        count = os.cpu_count() or 1
        if not used or max(used[1:]) < NOTICED * count:
            return None
        return (
            f"Other programs used {used[0]:.1f} of the {count} processors on average, and {max(used[1:]):.1f} at most: "
            "on an idle machine all seconds would be smaller, and ratios of times are less certain than without them."
        )
