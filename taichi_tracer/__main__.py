"""The program: ``taichi-tracer``, or ``python -m taichi_tracer``."""

import gc
import os
import sys

# New objects after which Python looks for cycles that nothing needs. With its usual 700, the search takes a tenth of
# the time until the first picture, because modules and the syntax trees of kernels are many objects that stay.
OBJECTS_BETWEEN_COLLECTIONS = 200_000
COUNTS_AT_THE_END = "OpenImageIO"  # a library that prints a page about each of its objects that is left over


def main() -> int:
    """Run the command line; signals are handled before anything large is imported."""
    from taichi_tracer.apps.running import leave_at_once

    leave_at_once()
    gc.set_threshold(OBJECTS_BETWEEN_COLLECTIONS)
    # numpy's library for matrix products starts one thread per CPU, which wait for work in a loop that keeps the CPUs
    # busy for a while. Nothing here multiplies large matrices.
    os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
    from taichi_tracer.apps.cli import main as run

    code = run()
    if COUNTS_AT_THE_END not in sys.modules:
        gc.freeze()  # the process ends: cycles need no search, which would take as long as many imports
    return code


if __name__ == "__main__":
    raise SystemExit(main())
