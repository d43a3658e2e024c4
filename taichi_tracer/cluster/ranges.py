"""The book of sample ranges: which of them are given to whom, which are done, and how large the next one is.

Nothing here knows Dask or Taichi. A range is (first, end): the samples of index first to end − 1, of every pixel.
"""

from typing import Any

Range = tuple[int, int]

SECONDS = 5.0  # that a range should take: longer than the overhead by far, and short enough to be done again
LEAST, MOST = 2.0, 10.0  # seconds between which a range lies where its time is known
FIRST = 2  # samples of the first range of a worker, whose time is unknown; it compiles the kernels
GROWTH = 4  # a range has at most so many times the samples of the one before it: its time was measured on fewer
SHARES = 2  # near the end, a range is at most what is left / (SHARES workers), so that all end at about the same time
LATE = 4.0  # times the expected seconds after which a range is given to another worker too


def size_of(seconds_per_sample: float | None, last: int, left: int | None, workers: int, seconds: float | None) -> int:
    """How many samples the next range of a worker has.

    Args:
        seconds_per_sample: as measured on this worker; None before its first range is done.
        last: the samples of its last range; 0 if it has none.
        left: samples that nobody has yet; None without a limit.
        workers: how many share what is left.
        seconds: that are left until the rendering ends; None without a limit.
    """
    if seconds_per_sample is None:
        size = FIRST
    else:
        wanted = SECONDS if seconds is None else min(SECONDS, max(seconds, 0.0))
        size = min(max(1, round(wanted / seconds_per_sample)), max(FIRST, GROWTH * last))
    if left is not None:
        size = min(size, max(1, -(-left // (SHARES * workers))))
        if seconds_per_sample is not None and left * seconds_per_sample < LEAST:
            size = max(size, min(left, -(-left // workers)))
    return size


class Ledger:
    """Every sample of one picture: nobody's yet, given, done, or on the film. Each counts once.

    Samples go onto the film in their order, so that what is there is always a range without gaps: it can be kept as an
    ordinary checkpoint, and is the picture that one process would have after so many samples.

    Args:
        first: the index of the first sample that is not on the film.
        end: where the picture ends; None if time or error end it.
        zero: the index at which the picture began.
        doubles: whether no range may go over zero + a power of two, because the sampler's error is estimated from
            doublings.
    """

    def __init__(self, first: int, end: int | None, zero: int = 0, doubles: bool = False) -> None:
        self.collected, self.end, self.zero, self.doubles = first, end, zero, doubles
        self.following = first  # the first sample that nobody ever had
        self.again: list[Range] = []  # ranges that came back
        self.given: dict[Range, set[str]] = {}  # range → the workers that have it now
        self.done: dict[Range, Any] = {}  # range → its result

    @property
    def left(self) -> int | None:
        """Samples that nobody has; None without a limit."""
        if self.end is None:
            return None
        return max(0, self.end - self.following) + sum(end - first for first, end in self.again)

    @property
    def is_given(self) -> bool:
        """Whether nothing is left to give."""
        return not self.again and self.end is not None and self.following >= self.end

    def take(self, worker: str, size: int) -> Range | None:
        """Give a worker the next range, of at most ``size`` samples, or one that came back as it was; None if none."""
        if self.again:
            taken = min(self.again)
            self.again.remove(taken)
        else:
            end = self.following + size if self.end is None else min(self.end, self.following + size)
            if self.doubles:
                end = min(end, self.zero + next_power_of_two(self.following - self.zero))
            if end <= self.following:
                return None
            taken = self.following, end
            self.following = end
        self.given.setdefault(taken, set()).add(worker)
        return taken

    def take_also(self, worker: str, late: Range) -> None:
        """Give a range to one more worker, because the first one is slow."""
        self.given[late].add(worker)

    def lose(self, one: Range, worker: str) -> None:
        """Note that a worker did not do a range. It is given again, unless another worker has it."""
        workers = self.given.get(one)
        if workers is None:
            return
        workers.discard(worker)
        if not workers:
            del self.given[one]
            self.again.append(one)

    def finish(self, one: Range, result: Any) -> bool:
        """Note that a range is done. False if it was done before: then this result does not count."""
        if one not in self.given:
            return False
        del self.given[one]
        self.done[one] = result
        return True

    def undo(self, one: Range) -> None:
        """Note that the result of a range was lost before it was on the film: the range is given again."""
        if self.done.pop(one, None) is not None:
            self.again.append(one)

    def ready(self) -> list[Range]:
        """The done ranges that follow what is on the film without a gap, in their order."""
        found, end = [], self.collected
        for one in sorted(self.done):
            if one[0] != end:
                break
            found.append(one)
            end = one[1]
        return found

    def collect(self, ranges: list[Range]) -> None:
        """Note that these ranges, the first ones of ``ready``, are on the film."""
        for one in ranges:
            if one[0] != self.collected:
                raise ValueError(f"samples from {one[0]} on do not follow those up to {self.collected}")
            self.collected = one[1]
            del self.done[one]


def next_power_of_two(n: int) -> int:
    """The smallest power of two that is more than n."""
    return 1 << n.bit_length()
