"""The seconds that a study may take: they begin at the key press, and include what the caller does afterwards."""

import math
import time
from collections.abc import Callable
from concurrent.futures import Future, wait

POLL = 0.1  # seconds between two looks at what the processes do
SHORTEST = 0.5  # seconds: in less, nothing can be measured
MOST_OVERRUN = 1.1  # times the budget: later than that, no study ends
CLOSING = 0.01, 0.4  # of the budget, and seconds: to end the processes and to make the tables
# Of the budget, and seconds: what the caller gets afterwards is at most the larger one, because a slow start of a busy
# moment does not mean that the files take as long.
MOST_RESERVE = 0.2, 1.8


class Stopped(Exception):
    """The user has interrupted the study, or its time is over."""


class Budget:
    """The clock of a study.

    Args:
        seconds: in all. spent: of these, what was spent before.
        keep: what the caller needs afterwards, as a multiple of what starting a process takes.
        tell: called with what is done, and with the share of the budget that has passed.
        should_stop: whether the user has had enough.

    Attributes:
        start_seconds: until the first process was ready; NaN before that.
    """

    def __init__(
        self,
        seconds: float,
        spent: float,
        keep: float,
        tell: Callable[[str, float], None],
        should_stop: Callable[[], bool],
    ) -> None:
        self.seconds, self.keep, self.tell, self.should_stop = seconds, keep, tell, should_stop
        share, least = CLOSING
        self.started = time.perf_counter() - spent
        self.end = self.started + seconds - max(share * seconds, least)
        self.start_seconds, self.can_measure = math.nan, False

    @property
    def elapsed(self) -> float:
        """Seconds that are spent."""
        return time.perf_counter() - self.started

    @property
    def share(self) -> float:
        """The share of the budget that is spent."""
        return self.elapsed / self.seconds

    @property
    def left(self) -> float:
        """Seconds that may still be spent on measuring."""
        return self.end - time.perf_counter()

    def process_is_ready(self) -> None:
        """The first process has started: this tells how long the caller will take afterwards."""
        self.start_seconds = self.elapsed
        share, seconds = MOST_RESERVE
        self.end -= min(self.keep * self.start_seconds, max(share * self.seconds, seconds))

    def variant_is_ready(self) -> None:
        """A variant is compiled: from now on something can be measured, for at least ``SHORTEST`` seconds."""
        if not self.can_measure:
            self.can_measure, self.end = True, max(self.end, time.perf_counter() + SHORTEST)

    @property
    def is_over(self) -> bool:
        """Whether no time is left; before a variant is compiled, whether it would be too late to measure anything."""
        late = 0.0 if self.can_measure else (MOST_OVERRUN - 1) * self.seconds - SHORTEST
        return self.left + late <= 0

    def say(self, what: str) -> None:
        """Tell what is done.

        Raises:
            Stopped: the user wants to stop, or the time is over.
        """
        self.tell(what, self.share)
        if self.should_stop() or self.is_over:
            raise Stopped

    def wait_for(self, future: Future, what: str):
        """The result of a call; meanwhile, look at the clock and at the user."""
        while True:
            self.say(what)
            done, _ = wait([future], timeout=POLL)
            if done:
                return future.result()
