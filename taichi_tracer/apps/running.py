"""What commands share while they run: Ctrl-C and SIGTERM, a line while a kernel compiles, and files on a full disk.

A signal ends the program at once if nothing is lost, else after the picture is kept.

Nothing here imports anything large: this is what the program does first.
"""

import contextlib
import os
import signal
import sys
import tempfile
import threading
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

from taichi_tracer.system import compiling, new_folders
from taichi_tracer.system.errors import InputError

SIGNALS = {signal.SIGINT: "interrupted", signal.SIGTERM: "terminated"}
EXIT_CODE = 128  # and the number of the signal: the exit code of a program that a signal ended
LONG_READING = 0.1  # seconds: if Python took longer to read a kernel, its translation may take more than a second
CLEAR = "\r\033[K"  # goes back, and forgets the line
SAME = 1.0  # seconds: a signal that comes so soon after another one asks for nothing new
moved: list[Path] = []  # files of this command that were written into the temporary folder


def leave_at_once() -> None:
    """From now on, end the process when a signal comes.

    An exception would not do it: while modules are imported and kernels compiled, it can be swallowed, or come out as
    another error.
    """
    Interruption(lambda: False).__enter__()
    compiling.around = while_compiling


class Interruption:
    """Makes a signal wait until the picture is kept; it ends the process at once where nothing is lost by that.

    Args:
        has_come: whether something would be lost if the process ended now.

    Attributes:
        number: of the signal that came; None while none has.
    """

    def __init__(self, has_come: Callable[[], bool] = lambda: True) -> None:
        self.has_come = has_come
        self.number: int | None = None
        self._since = 0.0
        self._former: dict[int, Any] = {}

    def __enter__(self):
        if threading.current_thread() is threading.main_thread():  # no other one may ask for signals
            for number in SIGNALS:
                if signal.getsignal(number) is not signal.SIG_IGN:
                    self._former[number] = signal.signal(number, self._note)
        return self

    def _note(self, number: int, _frame) -> None:
        if self.number is None and self.has_come():
            self.number, self._since = number, time.monotonic()
        elif self.number is None or time.monotonic() - self._since > SAME:
            with contextlib.suppress(Exception):  # stdout may be the one that is being written to
                sys.stdout.flush()
            new_folders.remove_empty()
            os.write(2, f"taichi-tracer: {SIGNALS[number]}\n".encode())
            os._exit(EXIT_CODE + number)

    def __exit__(self, *_error) -> None:
        for number, former in self._former.items():
            signal.signal(number, signal.SIG_DFL if former is None else former)

    @property
    def word(self) -> str:
        """What the signal did, in a word."""
        return SIGNALS[self.number]

    @property
    def exit_code(self) -> int:
        """The exit code of a program that the signal ended."""
        return EXIT_CODE + self.number


@contextlib.contextmanager
def while_compiling(kernel: compiling.Kernel) -> Iterator[None]:
    """While Taichi translates a large kernel, Python sees no signal for seconds: the system ends the process then.

    It does so only if nothing is lost by that. A terminal shows the name of the kernel meanwhile.
    """
    if threading.current_thread() is not threading.main_thread() or kernel.reading < LONG_READING:
        yield
        return
    former = {}
    for number in SIGNALS:
        interruption = getattr(signal.getsignal(number), "__self__", None)
        if isinstance(interruption, Interruption) and not interruption.has_come():
            former[number] = signal.signal(number, signal.SIG_DFL)
    show(f"{CLEAR}compiling {kernel.name} ...")
    try:
        yield
    finally:
        show(CLEAR)
        for number, handler in former.items():
            signal.signal(number, handler)


def show(text: str) -> None:
    """Write on the terminal, if there is one."""
    if sys.stderr.isatty():
        print(text, end="", file=sys.stderr, flush=True)


def written(path: Path, write: Callable[[Path], None]) -> Path:
    """The place that ``write(place)`` wrote: ``path``, or one in the temporary folder where the disk is full, say.

    Raises:
        InputError: neither could be written; it says what was wrong with ``path``.
    """
    try:
        write(path)
        return path
    except (InputError, OSError) as error:
        with contextlib.suppress(InputError, OSError):
            place = Path(tempfile.mkdtemp(prefix="taichi_tracer_", dir=tempfile.gettempdir())) / path.name
            write(place)
            moved.append(place)
            print(f"taichi-tracer: error: {error}: it is in {place} instead", file=sys.stderr)
            return place
        raise


def written_bytes(path: Path, content: bytes) -> Path:
    """Where a file was written."""
    from taichi_tracer.files.disk import replace_file

    return written(path, lambda place: replace_file(place, content))
