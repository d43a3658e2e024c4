"""Many small jobs, each done by one worker: pictures of a turntable or of a study, or submissions of a class."""

import time
from collections.abc import Callable, Sequence
from typing import Any

from taichi_tracer.cluster.members import Cluster, Given, Member, last_line, later
from taichi_tracer.cluster.ranges import LATE, Ledger
from taichi_tracer.system.errors import IncompleteError, InputError

DEPTH = 2  # jobs that a worker has: one that it does, and one that waits
TRIES = 3  # how often a job may fail
LEAST = 5.0  # seconds after which a job may be late
FETCH = 120.0  # seconds in which a result has to come
WAIT = 0.1  # seconds between two looks at the workers


class Sweep:
    """Jobs that workers do, each once; a job of a worker that has gone, or that is slow, is given again.

    Args:
        submit: (number of the job, worker) → the future of its result.
        count: how many jobs there are.
    """

    def __init__(self, cluster: Cluster, submit: Callable[[int, Member], Any], count: int) -> None:
        self.cluster, self.submit, self.count = cluster, submit, count
        self.book = Ledger(0, count)  # a job is a range of one
        self.results: dict[int, Any] = {}
        self.failures: dict[int, int] = {}
        self.seconds: list[float] = []

    def run(self, watch: Callable[[int, Any], Any] | None = None) -> list[Any]:
        """The results, in the order of the jobs.

        Args:
            watch: called with the number and the result of each job as soon as it is done.
        """
        try:
            while len(self.results) < self.count:
                for member in self.cluster.look():
                    for one in member.given:
                        self.book.lose(one, member.address)
                for member in self.cluster.members.values():
                    self.take(member, watch)
                    if member.state == "ready":
                        self.give(member)
                self.cluster.wait(WAIT)
        finally:
            for member in self.cluster.members.values():
                member.given.clear()
        return [self.results[i] for i in range(self.count)]

    def give(self, member: Member) -> None:
        """Give a worker jobs; near the end also a job that another worker does slowly."""
        while len(member.given) < DEPTH:
            one = self.book.take(member.address, 1)
            if one is None:
                one = self.late(member)
                if one is None:
                    return
                self.book.take_also(member.address, one)
            member.given[one] = Given(self.submit(one[0], member), time.perf_counter())

    def late(self, member: Member) -> tuple[int, int] | None:
        """A job that takes other workers too long; None if there is none."""
        usual = sorted(self.seconds)[len(self.seconds) // 2] if self.seconds else float("inf")
        for other in self.cluster.members.values():
            for one, given in other.given.items():
                is_alone = self.book.given.get(one) == {other.address}
                if is_alone and time.perf_counter() - given.given_at > LATE * max(LEAST, DEPTH * usual):
                    return None if other is member else one
        return None

    def take(self, member: Member, watch: Callable[[int, Any], Any] | None) -> None:
        """Take a worker's results."""
        for one, given in list(member.given.items()):
            if not given.future.done():
                continue
            del member.given[one]
            if given.future.status != "finished":
                self.fail(one, member, given.future)
            elif one in self.book.given:
                try:
                    result = later(given.future.result).result(FETCH)
                except Exception:  # its worker has gone since
                    self.fail(one, member, given.future)
                    continue
                self.book.finish(one, None)
                self.seconds.append(time.perf_counter() - given.given_at)
                self.results[one[0]] = result
                member.done += 1
                if watch is not None:
                    watch(one[0], self.results[one[0]])

    def fail(self, one: tuple[int, int], member: Member, future: Any) -> None:
        """Give a job that failed again, unless the job itself is to blame."""
        error = future.exception() if future.status == "error" else None
        self.book.lose(one, member.address)
        if isinstance(error, InputError):
            raise error
        self.failures[one[0]] = self.failures.get(one[0], 0) + 1
        if self.failures[one[0]] >= TRIES:
            reason = "it was lost" if error is None else last_line(error)
            raise IncompleteError(f"job {one[0]} failed {TRIES} times: {reason}")
        if member.state == "ready":
            self.cluster.failed(member, future)


def in_order(jobs: Sequence[Any]) -> list[Any]:
    """A list of jobs; an InputError if there are none."""
    if len(jobs) == 0:
        raise InputError("cluster: give at least one job")
    return list(jobs)
