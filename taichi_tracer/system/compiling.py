"""How long Taichi has translated kernels into machine code: what a second run need not do again.

The first call of a kernel has two parts. Python reads the source of the kernel and builds Taichi's own program, in
every process. Then Taichi translates this program into machine code, which it keeps in a folder, so that another
process finds it there. Only the second part is counted here.
"""

from time import perf_counter

from taichi._lib import core

FOUND = 0.04  # seconds: a kernel that took less was found in the folder, or is so small that it does not matter
_spent: list[float] = []  # seconds of every translation that took longer
_is_watched = False


def watch() -> None:
    """Count from now on, in this process."""
    global _is_watched
    original = getattr(core.Program, "compile_kernel", None)
    if _is_watched or original is None:
        return

    def compile_kernel(*words):
        start = perf_counter()
        try:
            return original(*words)
        finally:
            seconds = perf_counter() - start
            if seconds > FOUND:  # Taichi asks at each launch: most of them take microseconds
                _spent.append(seconds)

    core.Program.compile_kernel = compile_kernel
    _is_watched = True


def seconds_to_save() -> float:
    """The seconds that were spent on kernels that were not in the folder, so that another process is spared them."""
    return sum(_spent)


def kernels_made() -> int:
    """How many kernels were not in the folder."""
    return len(_spent)
