"""The seconds that a study may take: they begin at the key press, and include what the caller does afterwards."""

import math
import time
from collections.abc import Callable
from concurrent.futures import Future, wait

from taichi_tracer.studies.source import Order

POLL = 0.1  # seconds between two looks at the clock and at the user
CLOSING = 0.03, 0.6  # of the budget, and seconds: to end the processes and to make the tables
# Of the budget, and seconds: what the caller gets afterwards is at most the larger one, because a slow start of a busy
# moment does not mean that the files take as long.
MOST_RESERVE = 0.2, 1.8


class Stopped(Exception):
    """The user has interrupted the study, or its time is over."""


class Budget:
    """The clock of a study.

    Args:
        order: of which it needs the budget, what was spent before, and what to keep for the caller.
        tell: called with what is done, and with the share of the budget that has passed.
        should_stop: whether the user has had enough.

    Attributes:
        start_seconds: until the first process was ready; NaN before that.
    """

    def __init__(self, order: Order, tell: Callable[[str, float], None], should_stop: Callable[[], bool]) -> None:
        self.seconds, self.keep, self.tell, self.should_stop = order.budget, order.keep, tell, should_stop
        self.start_seconds = math.nan
        self.started = time.perf_counter() - order.spent
        share, least = CLOSING
        self.end = self.started + order.budget - max(share * order.budget, least)

    @property
    def elapsed(self) -> float:
        """Seconds that are spent."""
        return time.perf_counter() - self.started

    @property
    def left(self) -> float:
        """Seconds that may still be spent on measuring."""
        return self.end - time.perf_counter()

    def process_is_ready(self) -> None:
        """The first process has started: this tells how long the caller will take afterwards."""
        self.start_seconds = self.elapsed
        share, seconds = MOST_RESERVE
        self.end -= min(self.keep * self.start_seconds, max(share * self.seconds, seconds))

    def say(self, what: str) -> None:
        """Tell what is done.

        Raises:
            Stopped: the user wants to stop, or the time is over.
        """
        self.tell(what, self.elapsed / self.seconds)
        if self.should_stop() or self.left <= 0:
            raise Stopped

    def wait_for(self, future: Future, what: str):
        """The result of a call; meanwhile, look at the clock and at the user."""
        self.say(what)
        while not wait([future], timeout=POLL).done:
            self.say(what)
        return future.result()
