"""Other processes that work for this one: each has a Taichi of its own, and the caller's is never touched.

A worker is another Python that runs ``serve``. It reads calls from its standard input and writes answers to its
standard output, both pickled. It ends when its input does. If it is compiling a kernel then, it finishes this kernel
first and keeps it, so that the next run finds it.

Nothing here imports Taichi: a worker starts while its parent still reads its own modules.
"""

import os
import pickle
import signal
import subprocess
import sys
import traceback
from abc import ABC, abstractmethod
from collections.abc import Callable
from concurrent.futures import Future
from pathlib import Path
from queue import SimpleQueue
from threading import Thread
from typing import IO, Any, cast

from taichi_tracer.system.errors import InputError

PACKAGES = str(Path(__file__).resolve().parents[2])  # a worker finds this package, wherever it was started
PATIENCE = 0.3  # seconds that a worker gets to end: one that still compiles goes on alone


class WorkerDied(RuntimeError):
    """A worker ended in the middle of a call."""


class Worker(ABC):
    """An object that is somewhere else: its methods are called by name, one after the other, in a thread of ours."""

    pid = 0  # of the process, if it is on this machine

    def __init__(self) -> None:
        self.calls: SimpleQueue = SimpleQueue()
        # A daemon, because the program may end while somebody still compiles.
        Thread(target=self._serve, daemon=True).start()

    @abstractmethod
    def answer(self, method: str, words: tuple, options: dict) -> Any:
        """What a call gives; it may raise an error. WorkerDied: nobody answers any more."""

    def ask(self, method: str, *words, **options) -> Future:
        """Call a method later, after those that were asked for before; "open" makes the object."""
        future: Future = Future()
        self.calls.put((future, (method, words, options)))
        return future

    def _serve(self) -> None:
        while (call := self.calls.get()) is not None:
            future, content = call
            if not future.set_running_or_notify_cancel():
                continue
            try:
                future.set_result(self.answer(*content))
            except Exception as error:
                future.set_exception(error)

    def close(self) -> None:
        """Answer no more calls."""
        self.calls.put(None)


class WorkerProcess(Worker):
    """An object in a process of its own.

    Args:
        is_heard: whether what the worker writes to stderr is shown.

    Attributes:
        program: what the process runs; it ends in ``serve``. task: what it belongs to, for messages.
    """

    program: str
    task: str

    def __init__(self, is_heard: bool = True) -> None:
        self.process = subprocess.Popen(
            [sys.executable, "-c", self.program],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=None if is_heard else subprocess.DEVNULL,
            start_new_session=True,  # Ctrl-C is for the parent, which then writes what is done
            env=os.environ | {"PYTHONPATH": os.pathsep.join([PACKAGES, *filter(None, [os.environ.get("PYTHONPATH")])])},
        )
        self.input, self.output = cast(IO[bytes], self.process.stdin), cast(IO[bytes], self.process.stdout)
        self.pid = self.process.pid
        super().__init__()

    def answer(self, method: str, words: tuple, options: dict) -> Any:
        """What the process sends back."""
        try:
            pickle.dump((method, words, options), self.input)
            self.input.flush()
            is_good, answer = pickle.load(self.output)
        except (OSError, EOFError, ValueError) as error:
            raise WorkerDied(f"a process of {self.task} ended in {method}: {error}") from None
        if not is_good:
            raise answer
        return answer

    def close(self) -> None:
        """Let it end. Nobody waits for a worker that is compiling: it finishes the kernel first."""
        super().close()
        try:
            self.input.close()
            self.process.wait(PATIENCE)
        except (OSError, ValueError, subprocess.TimeoutExpired):
            pass


def serve(make: Callable[..., Any]) -> None:
    """Answer calls until the input ends: "open" calls ``make``, and every other name a method of what it made."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    calls, answers = sys.stdin.buffer, os.fdopen(os.dup(1), "wb")
    os.dup2(2, 1)  # whatever else prints, Taichi or a part of the user, must not come between the answers
    made: Any = None
    while True:
        try:
            method, words, options = pickle.load(calls)
        except EOFError:
            return
        try:
            if method == "open":
                made, answer = make(*words, **options), None
            else:
                answer = getattr(made, method)(*words, **options)
            content = True, answer
        except InputError as error:
            content = False, error
        except Exception:
            content = False, RuntimeError(traceback.format_exc())
        try:
            pickle.dump(content, answers)
            answers.flush()
        except OSError:
            return
