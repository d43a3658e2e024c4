"""Where the time of a picture goes: the stages of a stopwatch, and every kernel."""

from collections.abc import Sequence

from taichi_tracer.system.compiling import Kernel
from taichi_tracer.system.stopwatch import STAGES, Stopwatch


def described(stopwatch: Stopwatch, kernels: Sequence[Kernel]) -> str:
    """The stages of a stopped stopwatch, whose seconds add up to the total, and the kernels in their order."""
    total = sum(stopwatch.seconds.values())
    rows = [(name, stopwatch.seconds[name]) for name in STAGES] + [("total", total)]
    wide = max(len(name) for name, _ in rows)
    lines = [f"{name:<{wide}}  {seconds:8.3f} s  {100 * seconds / total:5.1f} %" for name, seconds in rows]
    new = [kernel.translating for kernel in kernels if kernel.is_new]
    lines.append(
        f"{len(kernels)} kernel{'s' * (len(kernels) != 1)}, {len(new)} of them translated anew ({sum(new):.2f} s)"
    )
    for kernel in kernels:
        how = "translated" if kernel.is_new else "loaded"
        lines.append(f"  {kernel.name}: read in {kernel.reading:.3f} s, {how} in {kernel.translating:.3f} s")
    return "\n".join(lines)
