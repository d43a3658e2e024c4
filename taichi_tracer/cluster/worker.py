"""What runs inside a worker of Dask. It passes questions on to the process that renders, and the answers back.

These functions are sent by their names. Only dictionaries, texts, numbers and arrays travel beside them.
"""

import contextlib
import os
import subprocess
import threading
from collections.abc import Sequence
from typing import Any

from taichi_tracer.cluster.child import Child
from taichi_tracer.cluster.versions import installation
from taichi_tracer.system.processes import WorkerDied

IDLE = 900.0  # seconds after which a process that nobody asks for anything ends: its sender may be gone
ENDING = 5.0  # seconds that a process may take to end
SEATS = "taichi_tracer_seats"  # the attribute of Dask's worker that has them


class GoneError(RuntimeError):
    """The process that rendered has ended, with its scenes: they must be sent again."""


class Seat:
    """A process of one session on one worker; it is asked for one thing at a time.

    Args:
        folder: where it may write. threads: how many processors it may use.
        child: the process. more: what else it is opened with.
    """

    def __init__(self, folder: str, threads: int, child: Child, *more: Any) -> None:
        self.lock = threading.Lock()
        self.child = child
        self.timer: threading.Timer | None = None
        self.is_open = False
        self.words = folder, threads, *more

    def ask(self, method: str, *words: Any, **options: Any) -> Any:
        """The answer of the process.

        Raises:
            InputError: what it was asked for cannot be done. GoneError: it ended.
        """
        with self.lock:
            self.stop_timer()
            try:
                if not self.is_open:
                    self.child.ask("open", *self.words).result()
                    self.is_open, self.words = True, ()
                return self.child.ask(method, *words, **options).result()
            except WorkerDied:
                with contextlib.suppress(subprocess.TimeoutExpired):
                    self.child.process.wait(ENDING)
                code = self.child.process.returncode
                raise GoneError(f"the process that renders has ended (exit code {code})") from None
            finally:
                self.timer = threading.Timer(IDLE, self.child.close)
                self.timer.daemon = True
                self.timer.start()

    def stop_timer(self) -> None:
        """Let the process live on, because it is needed."""
        if self.timer is not None:
            self.timer.cancel()

    def close(self) -> None:
        """Let the process end."""
        self.stop_timer()
        self.child.end()


def introduce(dask_worker: Any = None) -> dict[str, str]:
    """What is installed on this worker."""
    return installation()


def seats_of(dask_worker: Any) -> dict[str, Seat]:
    """Session → its seat, of one of Dask's workers."""
    if not hasattr(dask_worker, SEATS):
        setattr(dask_worker, SEATS, {})
    return getattr(dask_worker, SEATS)


def seat_of(session: str) -> Seat:
    """The seat of a session on the worker that runs this task."""
    from distributed import get_worker

    seats = seats_of(get_worker())
    if session not in seats:
        raise GoneError("this worker has no process for this session")
    return seats[session]


def settle(session: str, settings: Sequence[Any], is_heard: bool) -> dict[str, str]:
    """Start the process of a session and its Taichi, unless it runs; says how Taichi runs."""
    from distributed import get_worker

    worker = get_worker()
    seats = seats_of(worker)
    seat = seats.get(session)
    if seat is None or seat.child.process.poll() is not None:
        seat = seats[session] = Seat(worker.local_directory, threads_of(worker), Child(is_heard))
    return seat.ask("settings", *settings)


def threads_of(dask_worker: Any) -> int:
    """How many processors a process on one of Dask's workers may use."""
    return min(dask_worker.state.nthreads, os.cpu_count() or 1)


def receive(session: str, message: dict, which: Sequence[Any], hashes: Sequence[str], *pieces: bytes) -> dict:
    """Load the scene of a parcel, and compile what a picture of it needs; returns what ``child.Desk.warm`` says."""
    seat = seat_of(session)
    seat.ask("receive", message, dict(zip(hashes, pieces, strict=True)))
    return seat.ask("warm", message["id"], tuple(which))


def samples(session: str, parcel: str, which: Sequence[Any], first: int, count: int) -> dict:
    """The samples of a range."""
    return seat_of(session).ask("render", parcel, tuple(which), first, count)


def merged(session: str, parcel: str, which: Sequence[Any], *parts: dict) -> dict:
    """The sum of parts that follow each other."""
    return seat_of(session).ask("merge", parcel, tuple(which), list(parts))


def picture(session: str, message: dict, targets: Sequence[Any], hashes: Sequence[str], *pieces: bytes) -> dict:
    """A whole picture, the first one of a parcel."""
    seat = seat_of(session)
    seat.ask("receive", message, dict(zip(hashes, pieces, strict=True)))
    return seat.ask("picture", message["id"], (0, 0, None), *targets)


def leave(session: str, dask_worker: Any = None) -> None:
    """End the processes of a session."""
    seats = seats_of(dask_worker)
    if session in seats:
        seats.pop(session).close()
