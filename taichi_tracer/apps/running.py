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
from collections.abc import Callable
from pathlib import Path
from typing import Any

from taichi_tracer.system import compiling, new_folders
from taichi_tracer.system.errors import InputError

SIGNALS = {signal.SIGINT: "interrupted", signal.SIGTERM: "terminated"}
EXIT_CODE = 128  # and the number of the signal: the exit code of a program that a signal ended
SHORT = 0.1  # seconds of reading: the translation of such a kernel takes less than a second
LONG_READING = 0.15  # seconds: if a kernel took longer to read, its translation may take more than a second
CLEAR = "\r\033[K"  # goes back, and forgets the line
SAME = 1.0  # seconds: a signal that comes so soon after another one asks for nothing new


def leave_at_once() -> None:
    """From now on, end the process when a signal comes.

    An exception would not do it: while modules are imported and kernels compiled, it can be swallowed, or come out as
    another error.
    """
    for number in SIGNALS:
        if signal.getsignal(number) is not signal.SIG_IGN:
            signal.signal(number, leave)
    compiling.watchers.append(WhileCompiling())


class WhileCompiling:
    """While Taichi translates a kernel, which may take seconds, the system ends the process: Python sees no signal.

    Only the handlers of this file are replaced.
    """

    def __init__(self) -> None:
        self._former: dict[int, Any] = {}
        self._is_keeping = False

    def begins(self, kernel: compiling.Kernel) -> None:
        """Leave the signals to the system, unless that takes no time: a kernel that is read at once is small."""
        is_main = threading.current_thread() is threading.main_thread()
        if not is_main or kernel.reading < SHORT or self._is_keeping:
            return
        handlers = {number: signal.getsignal(number) for number in SIGNALS}
        owners = {getattr(handler, "__self__", None) for handler in handlers.values()}
        self._is_keeping = True  # what is kept may have to compile a kernel itself
        try:
            let_go = {owner for owner in owners if isinstance(owner, Interruption) and owner.lets_go()}
        finally:
            self._is_keeping = False
        for number, handler in handlers.items():
            if handler is leave or getattr(handler, "__self__", None) in let_go:
                self._former[number] = signal.signal(number, signal.SIG_DFL)

    def ends(self) -> None:
        """Take them back."""
        while self._former:
            signal.signal(*self._former.popitem())


def ignore() -> None:
    """From now on, let no signal change how the process ends."""
    for number in SIGNALS:
        signal.signal(number, signal.SIG_IGN)


def leave(number: int, _frame=None) -> None:
    """End the process, with a line on stderr."""
    with contextlib.suppress(Exception):  # stdout may be the one that is being written to
        sys.stdout.flush()
    new_folders.remove_empty()
    os.write(2, f"taichi-tracer: {SIGNALS[number]}\n".encode())
    os._exit(EXIT_CODE + number)


class Interruption:
    """Makes a signal wait until the picture is kept.

    Attributes:
        number: of the signal that came; None while none has.
        is_rendering: whether a later signal may end a sample that takes long, by a KeyboardInterrupt.
        has_come: whether something would be lost if the process ended now. keep: writes it, and is called before a
            kernel is compiled, so that the system may end the process; None if that cannot be done.
    """

    def __init__(self, has_come: Callable[[], bool] = lambda: True) -> None:
        self.number: int | None = None
        self.is_rendering = False
        self.has_come = has_come
        self.keep: Callable[[], object] | None = None
        self._since = 0.0
        self._former: dict[int, object] = {}

    def __enter__(self):
        if threading.current_thread() is threading.main_thread():  # no other one may ask for signals
            for number in SIGNALS:
                if signal.getsignal(number) is not signal.SIG_IGN:
                    self._former[number] = signal.signal(number, self._note)
        return self

    def _note(self, number: int, _frame) -> None:
        if self.number is None:
            if not self.has_come():
                leave(number)
            self.number, self._since = number, time.monotonic()
        elif time.monotonic() - self._since > SAME:
            if self.is_rendering:
                raise KeyboardInterrupt
            leave(number)

    def lets_go(self) -> bool:
        """Whether the system may end the process, before a kernel is compiled: nothing is lost, or it is kept.

        Raises:
            KeyboardInterrupt: a signal has come, and something was rendered: this ends the rendering.
        """
        if not self.has_come():
            if self.number is not None:
                leave(self.number)
            return True
        if self.number is not None:
            raise KeyboardInterrupt
        if self.keep is not None:
            self.keep()
        return self.keep is not None

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


class CompilingLine:
    """A line on a terminal that names the kernel that is compiled, and that is gone afterwards.

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
            print(f"taichi-tracer: error: {error}: it is in {place} instead", file=sys.stderr)
            return place
        raise


def written_bytes(path: Path, content: bytes) -> Path:
    """Where a file was written."""
    from taichi_tracer.files.disk import replace_file

    return written(path, lambda place: replace_file(place, content))
