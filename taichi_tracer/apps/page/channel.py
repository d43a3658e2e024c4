"""What goes between the threads of a live picture: events, calls and frames.

One thread renders, because Taichi's kernels must not be launched from several threads. The others ``post`` events and
wait for frames.
"""

import threading
import time
from collections import deque
from collections.abc import Callable
from concurrent.futures import Future
from typing import Any

from taichi_tracer.apps.page.events import checked
from taichi_tracer.apps.page.frames import Frame

MOST_EVENTS = 2000  # that wait; when there are more, the oldest ones are dropped
FORGOTTEN = 10.0  # seconds without anybody who waits for a frame: then nothing is rendered

CANCEL = "cancel"  # the event that does not wait for the thread that renders, because that one is busy
Event = tuple[str, dict[str, Any]]  # its type and its members


class Channel:
    """Events and calls that wait for the thread that renders, and the newest frame for those that wait for one.

    Args:
        now: the clock, in seconds.
    """

    def __init__(self, now: Callable[[], float]) -> None:
        self.now = now
        self.is_over = False
        self.is_cancelled = False  # whether what was chosen last, and is compiled now, is not wanted any more
        self._events: deque[Event] = deque()
        self._tasks: deque[tuple[Callable[[], Any], Future]] = deque()
        self._lock = threading.Condition()
        self._frame: Frame | None = None
        self._waiting, self._polls = 0, False
        self._last_wait = self.now()

    def post(self, event: Any) -> None:
        """Take an event.

        Raises:
            InputError: it is malformed; see ``events.checked``.
        """
        kind, members = checked(event)
        if kind == CANCEL:
            self.is_cancelled = True
            return
        with self._lock:
            if len(self._events) >= MOST_EVENTS:
                self._events.popleft()
            self._events.append((kind, members))
            self._lock.notify_all()

    def call(self, function: Callable[[], Any], patience: float = 30.0) -> Any:
        """What a function returns that the session's own thread calls; it may use the renderer."""
        future: Future = Future()
        with self._lock:
            self._tasks.append((function, future))
            self._lock.notify_all()
        return future.result(patience)

    def wait_for_frame(self, since: int, patience: float) -> Frame | None:
        """The newest frame if it is newer than ``since``; None if none comes in time, or the session is over."""
        end = time.monotonic() + patience
        with self._lock:
            self._waiting += 1
            self._lock.notify_all()
            try:
                while not self.is_over:
                    self._last_wait = self.now()
                    if (found := self.newest(since)) is not None:
                        return found
                    left = end - time.monotonic()
                    if left <= 0:
                        return None
                    self._lock.wait(min(left, 1.0))
                return None
            finally:
                self._waiting -= 1
                self._last_wait = self.now()

    def newest(self, since: int) -> Frame | None:
        """The newest frame if it is newer than ``since``."""
        with self._lock:
            return self._frame if self._frame is not None and self._frame.number > since else None

    def watch(self) -> None:
        """Note that somebody watches, who does not wait for frames in a thread."""
        self._last_wait = self.now()

    def ask(self) -> None:
        """Note that somebody fetches the next frame, without a thread that waits for it."""
        self._polls = True

    def close(self) -> None:
        """Let every thread that waits go on."""
        with self._lock:
            self.is_over = True
            for _, future in self._tasks:
                future.cancel()
            self._tasks.clear()
            self._lock.notify_all()

    def take_post(self) -> tuple[list[Event], int]:
        """The events that have come since the last time, and how many calls of other threads were answered."""
        with self._lock:
            events, tasks = list(self._events), list(self._tasks)
            self._events.clear()
            self._tasks.clear()
        for function, future in tasks:
            answer(function, future)
        return events, len(tasks)

    def show(self, frame: Frame) -> None:
        """Give a frame to everybody who waits for one."""
        with self._lock:
            self._frame = frame
            self._polls = False
            self._lock.notify_all()

    @property
    def is_watched(self) -> bool:
        """Whether anybody has waited for a frame lately."""
        return self._waiting > 0 or self.now() - self._last_wait < FORGOTTEN

    @property
    def is_asked(self) -> bool:
        """Whether somebody takes a frame at once: otherwise none is made, so that no queue of old ones can arise."""
        return self._waiting > 0 or self._polls


def answer(function: Callable[[], Any], future: Future) -> None:
    """Call a function for another thread."""
    if not future.set_running_or_notify_cancel():
        return
    try:
        future.set_result(function())
    except Exception as error:
        future.set_exception(error)
