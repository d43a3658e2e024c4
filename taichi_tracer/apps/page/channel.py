"""What goes between the threads of a live picture: events, functions and frames.

One thread renders, because Taichi's kernels must not be launched from several threads. The others ``post`` events and
wait for frames.
"""

import threading
import time
from collections import deque
from collections.abc import Callable
from typing import Any

from taichi_tracer.apps.page.events import checked
from taichi_tracer.apps.page.frames import Frame

MOST_EVENTS = 2000  # that wait; when there are more, the oldest ones are dropped
FORGOTTEN = 10.0  # seconds without anybody who waits for a frame: then nothing is rendered
Event = tuple[str, dict[str, Any]]  # its type and its members


class Channel:
    """Events and functions that wait for the thread that renders, and the newest frame for those that wait for one.

    Args:
        now: the clock, in seconds.
    """

    def __init__(self, now: Callable[[], float]) -> None:
        self.now = now
        self.is_over = False
        self._events: deque[Event] = deque()
        self._tasks: deque[Callable[[], object]] = deque()
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
        with self._lock:
            if len(self._events) >= MOST_EVENTS:
                self._events.popleft()
            self._events.append((kind, members))
            self._lock.notify_all()

    def later(self, task: Callable[[], object]) -> None:
        """Let the session's own thread call a function, which may use the renderer and must not raise."""
        with self._lock:
            self._tasks.append(task)
            self._lock.notify_all()

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
            self._lock.notify_all()

    def take_post(self) -> tuple[list[Event], int]:
        """The events that have come since the last time, and how many functions of other threads were called."""
        with self._lock:
            events, tasks = list(self._events), list(self._tasks)
            self._events.clear()
            self._tasks.clear()
        for task in tasks:
            task()
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
