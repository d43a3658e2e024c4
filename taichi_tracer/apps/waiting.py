"""What a terminal says while a kernel is compiled that takes long."""

import sys

from taichi_tracer.system import compiling

LONG_READING = 0.15  # seconds: if a kernel took longer to read, its translation may take more than a second
CLEAR = "\r\033[K"  # goes back, and forgets the line


class CompilingLine:
    """A line on stderr that names the kernel, and that is gone afterwards.

    It is written before, because nothing else of the program runs meanwhile.
    """

    def __init__(self) -> None:
        self.is_shown = False

    def begins(self, kernel: compiling.Kernel) -> None:
        """Show the line if this kernel may take long."""
        if kernel.reading > LONG_READING:
            print(f"{CLEAR}compiling {kernel.name} ...", end="", file=sys.stderr, flush=True)
            self.is_shown = True

    def ends(self) -> None:
        """Take it away."""
        if self.is_shown:
            print(CLEAR, end="", file=sys.stderr, flush=True)
            self.is_shown = False
