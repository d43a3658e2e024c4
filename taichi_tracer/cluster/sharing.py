"""One picture, shared among workers: ranges of samples go out, sums come back in a tree, and nothing counts twice.

The picture has the same bits for any number of workers, any order of the ranges and any retries, because the sum of a
pixel does not depend on the order of its samples (``picture.film``), and because the book counts every range once.
"""

import math
import time
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

from taichi_tracer.cluster import worker
from taichi_tracer.cluster.child import facts_of, samples_of
from taichi_tracer.cluster.members import Cluster, Given, Member, last_line, later
from taichi_tracer.cluster.parcel import Parcel
from taichi_tracer.cluster.ranges import FIRST, LATE, LEAST, Ledger, Range, size_of
from taichi_tracer.picture.adaptive import adapt
from taichi_tracer.picture.progress import Progress, Target
from taichi_tracer.system.errors import IncompleteError, InputError

DEPTH = 2  # ranges that a worker has: one that it renders, and one that waits, so that it never does
DIRECT = 4  # parts that come here one by one: for so few, the workers need not add up
FAN_IN = 8  # parts that one step of the tree adds up
COLLECT_EVERY = 1.0  # seconds between two collections of what is done, at least
COST_OF_COLLECTING = 0.05  # the fraction of the time that collecting may take
WAIT = 0.1  # seconds between two looks at the workers, unless one of them ends something
TRIES = 5  # how often the same thing may fail before the rendering ends
PATIENCE = 10.0  # seconds in which sums have to come, before somebody is suspected to hang
FAREWELL = 20.0  # seconds in which what is done may come after an interruption
BEGIN = 0.25  # seconds that the first range of a worker takes, about: its time was measured on one sample


@dataclass
class Statistics:
    """What a picture cost, for reports.

    Attributes:
        start: seconds until the first worker could render. seconds: after that, until the end.
        ranges, repeated, twice: that were done, that were given again, and results that came twice and did not count.
        collections: sums that came to this machine.
        sizes: samples of each range.
        rendering: seconds that the workers spent on the ranges that count, added up. processors: the same, as seconds
            of processors, which other programs on the machine do not change.
        bytes_sent: of files, to all workers. bytes_received: of results, by this machine.
        workers: address → what is known of it.
    """

    start: float = math.nan
    seconds: float = math.nan
    ranges: int = 0
    repeated: int = 0
    twice: int = 0
    rendering: float = 0.0
    processors: float = 0.0
    bytes_sent: int = 0
    bytes_received: int = 0
    collections: int = 0
    sizes: list[int] = field(default_factory=list)
    workers: dict[str, dict] = field(default_factory=dict)


def passes(spp: int, mean: float) -> int:
    """How many passes over all pixels give them so many samples on average, if one pass gives them ``mean``.

    It counts as one process does, whose sum of the means is rounded in every pass.
    """
    count, samples = 0, 0.0
    while samples < spp:
        count, samples = count + 1, samples + mean
    return count


def check_adaptive(is_adaptive: bool, sampler: Any, has_own_shares: bool = False) -> None:
    """Raise an InputError for an adaptive picture whose error could not be estimated from ranges of samples.

    Args:
        has_own_shares: whether the renderer loaded samples of a picture that had become adaptive by itself.
    """
    if has_own_shares:
        raise InputError("pixels of this checkpoint have different numbers of samples: go on without a cluster")
    if is_adaptive and sampler.doubles:
        raise InputError(
            f"--adaptive with --sampler {sampler.name} on a cluster: its error is estimated from doublings, and pixels "
            "of an adaptive picture double at different times: leave --sampler out"
        )


class Sharing:
    """The rendering of one picture.

    Args:
        renderer: of this machine; its film takes what comes, and its progress is updated.
        parcel, which: the same picture for the workers.
        target: when to stop.
    """

    def __init__(self, cluster: Cluster, renderer: Any, parcel: Parcel, which: tuple, target: Target) -> None:
        check_adaptive(bool(renderer.adaptive), renderer.sampler, renderer.own_shares.is_on)
        self.cluster, self.renderer, self.parcel, self.which = cluster, renderer, parcel, which
        pilot = None
        if not renderer.is_current():
            renderer.begin()
            if renderer.adaptive:
                pilot = adapt(renderer)
        renderer.progress = self.progress = Progress(target, pilot=pilot)
        self.facts = facts_of(renderer)
        first = renderer.first_sample + renderer.film.samples
        end = None if target.spp is None else first + passes(target.spp, renderer.shares.mean)
        self.book = Ledger(first, end, renderer.first_sample, renderer.film.doubles)
        self.spare: Any = None
        self.collection: list[tuple[list[Range], Any]] = []
        self.asked_at = 0.0  # when the collection began
        self.coming: Any = None  # the first sum of the collection, on its way to this machine
        self.began_at = time.perf_counter()
        self.started_at: float | None = None
        self.collected_at, self.cost, self.failures = self.began_at, 0.0, 0
        self.statistics = Statistics()

    def run(self, watch: Callable[[Progress], Any] | None = None) -> Statistics:
        """Render until a target is reached.

        Args:
            watch: called with the progress several times a second; whatever it raises ends the rendering, after what is
                done has come.

        Raises:
            IncompleteError: the cluster was lost, or no worker can be used. What came is on the film.
        """
        try:
            while not self.is_over:
                for member in self.cluster.look():
                    self.lose(member)
                self.take_answers()
                self.give()
                self.collect()
                self.get_ready()
                if watch is not None:
                    watch(self.progress)
                if not self.is_over:
                    self.cluster.wait(WAIT)
        except (IncompleteError, InputError):
            raise
        except BaseException as error:
            if isinstance(error, Exception) and self.cluster.is_lost:  # Dask raises many kinds of errors then
                self.cluster.check()
            self.fetch_what_is_done()
            raise
        finally:
            self.end()
        return self.statistics

    def get_ready(self) -> None:
        """Compile what this machine needs for sums, once, while the workers load the scene."""
        self.progress.place = f"{sum(bool(m.has) for m in self.cluster.members.values())} workers"
        if self.spare is None and any(member.asked for member in self.cluster.members.values()):
            self.spare = self.renderer.film.alike()
            self.spare.from_arrays(self.spare.to_arrays(), 0)
            self.renderer.film.merge(self.spare)
            self.renderer.film.error()

    @property
    def is_over(self) -> bool:
        """Whether a target is reached."""
        return self.progress.has_reached_error or (self.book.end is not None and self.book.collected >= self.book.end)

    @property
    def seconds_left(self) -> float | None:
        """Seconds until the time that was asked for is over; None if no time was asked for."""
        if self.progress.target.time is None:
            return None
        passed = 0.0 if self.started_at is None else time.perf_counter() - self.started_at
        return self.progress.target.time - passed

    # ── ranges go out ──

    def give(self) -> None:
        """Give every worker that has the scene what to do."""
        left = self.seconds_left
        if left is not None and left <= 0:
            self.book.end = self.book.following  # what is given is still waited for: it was to end by now
        members = self.cluster.ready(self.parcel, self.which, self.facts)
        if members and self.started_at is None:
            self.started_at = self.collected_at = time.perf_counter()
            self.progress.took(self.started_at - self.began_at, 0, compiles=True)
        late = self.late_ranges()
        for member in members:
            if late and late[0][1] != member.address and len(member.given) < DEPTH:
                one, _ = late.pop(0)
                self.book.take_also(member.address, one)
                self.statistics.repeated += 1
                self.send(member, one)
            while len(member.given) < DEPTH and not self.is_stuck(member):
                taken = self.book.take(member.address, self.size_for(member, len(members)))
                if taken is None:
                    break
                self.send(member, taken)

    def size_for(self, member: Member, workers: int) -> int:
        """How many samples the next range of a worker has."""
        seconds = member.seconds_per_sample
        last = member.last or (FIRST if seconds is None else max(FIRST, int(BEGIN / max(seconds, 1e-9))))
        left = self.seconds_left
        if left is not None and seconds is not None:  # what it has already is to end first
            left -= seconds * sum(end - first for first, end in member.given)
        return size_of(seconds, last, self.book.left, workers, left)

    def send(self, member: Member, taken: Range) -> None:
        """Let a worker render a range."""
        first, end = taken
        words = self.cluster.session, self.parcel.id, list(self.which), first, end - first
        given = Given(self.cluster.submit(worker.samples, *words, at=[member.address]), time.perf_counter())
        given.future.add_done_callback(lambda _: setattr(given, "done_at", time.perf_counter()))
        member.given[taken] = given
        member.last = end - first

    def late_ranges(self) -> list[tuple[Range, str]]:
        """(range, worker) of what takes too long and nobody else has yet."""
        stuck = [member for member in self.cluster.members.values() if self.is_stuck(member)]
        return [(one, m.address) for m in stuck for one in m.given if self.book.given.get(one) == {m.address}]

    def is_stuck(self, member: Member) -> bool:
        """Whether a worker takes much longer for its range than its samples took before."""
        if not member.given or member.seconds_per_sample is None:
            return False
        (first, end), given = next(iter(member.given.items()))
        if given.done_at is not None:
            return False
        expected = max(LEAST, (end - first) * member.seconds_per_sample)
        return time.perf_counter() - max(given.given_at, member.free_since) > LATE * expected

    # ── answers come back ──

    def take_answers(self) -> None:
        """Write into the book what is done, and what failed."""
        for member in list(self.cluster.members.values()):
            for taken, given in list(member.given.items()):
                if not given.future.done():
                    continue
                del member.given[taken]
                if given.future.status == "finished":
                    self.take_answer(member, taken, given)
                else:
                    self.book.lose(taken, member.address)
                    self.statistics.repeated += 1
                    if member.state == "ready":  # else it is being started again, because of the range before
                        self.cluster.failed(member, given.future)
                    self.fail(given.future)

    def take_answer(self, member: Member, taken: Range, given: Given) -> None:
        """Note that a range is done. It counts, unless another worker has done the same range before."""
        done_at = given.done_at or time.perf_counter()
        seconds = done_at - max(given.given_at, member.free_since)
        member.free_since, member.done, member.failures = done_at, member.done + 1, 0
        member.seconds_per_sample = max(seconds, 1e-9) / (taken[1] - taken[0])
        if self.book.finish(taken, (given.future, member.address)):
            self.statistics.ranges += 1
            self.statistics.sizes.append(taken[1] - taken[0])
        else:
            self.statistics.twice += 1

    def fail(self, future: Any) -> None:
        """Count a failure; too many of them in a row end the rendering."""
        self.failures += 1
        if self.failures > TRIES * max(1, len(self.cluster.members)):
            error = future.exception() if future.status == "error" else None
            reason = "" if error is None else f": {last_line(error)}"
            raise IncompleteError(f"the workers of {self.cluster.where} failed {self.failures} times{reason}")

    def lose(self, member: Member) -> None:
        """Give the ranges of a worker that has gone again, also those that it had done but nobody had fetched."""
        lost = list(member.given)
        for taken in lost:
            self.book.lose(taken, member.address)
        gone = [one for one, (_, address) in self.book.done.items() if address == member.address]
        for one in gone:
            self.book.undo(one)
        self.statistics.repeated += len(lost) + len(gone)
        self.collection, self.coming = [], None
        self.cluster.tell(f"worker {member.address} has gone: {len(lost) + len(gone)} of its ranges are given again")

    # ── sums are collected ──

    def collect(self) -> None:
        """Let the workers add up what is done, and take the sums that are there."""
        self.take_sums()
        if self.collection:
            self.give_up_if_late()
            return
        ready = self.book.ready()
        is_last = self.book.is_given and not self.book.given
        due = max(COLLECT_EVERY, self.cost / COST_OF_COLLECTING)
        members = self.cluster.ready(self.parcel, self.which, self.facts)
        if ready and members and (is_last or time.perf_counter() - self.collected_at > due):
            is_direct = self.book.doubles or len(ready) <= DIRECT
            groups = [[one] for one in ready] if is_direct else [ready]
            at = [member.address for member in members if not self.is_stuck(member)]
            at = at or [member.address for member in members]
            self.asked_at = time.perf_counter()
            self.collection = [(group, self.tree(group, at)) for group in groups]
            self.take_sums()

    def give_up_if_late(self) -> None:
        """Let other workers do again what a worker has done that hangs: it keeps its sums to itself.

        If nobody seems to hang, all that was to be added up is done again, after a longer time.
        """
        passed = time.perf_counter() - self.asked_at
        patience = max(PATIENCE, LATE * FAN_IN * self.cost)
        if passed < patience:
            return
        stuck = {member.address for member in self.cluster.members.values() if self.is_stuck(member)}
        wanted = [one for group, _ in self.collection for one in group]
        lost = [one for one in wanted if self.book.done[one][1] in stuck]
        if not lost and passed > LATE * patience:
            lost = wanted
        if lost:
            self.collection, self.coming = [], None
            self.statistics.repeated += len(lost)
            for one in lost:
                self.book.undo(one)

    def tree(self, ranges: list[Range], at: list[str]) -> Any:
        """The future of the sum of ranges that follow each other; the workers at these addresses add up."""
        futures = [self.book.done[one][0] for one in ranges]
        words = self.cluster.session, self.parcel.id, list(self.which)
        while len(futures) > 1:
            groups = [futures[i : i + FAN_IN] for i in range(0, len(futures), FAN_IN)]
            futures = [
                self.cluster.submit(worker.merged, *words, *group, at=at, priority=10) if len(group) > 1 else group[0]
                for group in groups
            ]
        return futures[0]

    def take_sums(self) -> None:
        """Put the sums that are there onto the film, in their order."""
        while self.collection and self.collection[0][1].done():
            ranges, future = self.collection[0]
            if future.status != "finished":
                self.collection, self.coming = [], None
                self.fail(future)
            elif self.coming is None:
                self.coming = later(future.result)
                self.coming.add_done_callback(lambda _: self.cluster.wake.set())
            elif not self.coming.done():
                return
            elif self.coming.exception() is not None:
                self.collection, self.coming = [], None
                self.fail(future)
            else:
                part, self.coming = self.coming.result(), None
                del self.collection[0]
                self.put(ranges, part)

    def put(self, ranges: list[Range], part: dict) -> None:
        """Put a sum onto the film."""
        start = time.perf_counter()
        if part["ranges"] != [[ranges[0][0], ranges[-1][1]]]:
            raise RuntimeError(f"the samples {part['ranges']} came in place of {ranges}")
        if self.spare is None:
            self.spare = self.renderer.film.alike()
        self.spare.from_arrays(part["arrays"], samples_of(part))
        self.renderer.film.merge(self.spare)
        self.book.collect(ranges)
        self.failures = 0
        self.statistics.collections += 1
        self.statistics.rendering += part["seconds"]
        self.statistics.processors += part["cpu"]
        now = time.perf_counter()
        self.progress.took(now - self.collected_at, samples_of(part) * self.renderer.shares.mean)
        self.progress.look(self.renderer.error)
        self.collected_at = time.perf_counter()
        if self.statistics.bytes_received > 0:  # the first sum compiles kernels, which later ones do not
            self.cost = self.collected_at - start
        self.statistics.bytes_received += sum(array.nbytes for array in part["arrays"].values())

    def fetch_what_is_done(self) -> None:
        """Take what was done before an interruption and follows without a gap, as far as it comes in time."""
        until = time.perf_counter() + FAREWELL
        self.collection, self.coming = [], None
        try:
            self.take_answers()
            for one in self.book.ready():
                left = until - time.perf_counter()
                if left <= 0:
                    break
                future, _ = self.book.done[one]
                self.put([one], later(future.result).result(left))
        except Exception as error:  # the picture is written without what did not come
            self.cluster.tell(f"some samples did not come: {last_line(error)}")

    def end(self) -> None:
        """Forget the futures, so that workers forget their results."""
        now = time.perf_counter()
        self.statistics.start = (self.started_at or now) - self.began_at
        self.statistics.seconds = now - (self.started_at or now)
        self.statistics.bytes_sent = self.cluster.bytes_sent
        for member in self.cluster.members.values():
            self.statistics.workers[member.address] = {"ranges": member.done, **member.facts}
            member.given.clear()
        self.book.done.clear()
        self.collection, self.coming = [], None
