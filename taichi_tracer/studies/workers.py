"""Who renders a study: processes on this machine or on others, or the process of the caller.

Nothing here imports Taichi: the first process of a study starts while its parent still reads its own modules.
"""

from collections.abc import Callable
from concurrent.futures import Future
from typing import TYPE_CHECKING, Any, Protocol

from taichi_tracer.system.processes import Worker, WorkerProcess, serve

if TYPE_CHECKING:
    from taichi_tracer.studies.variants import Variant

LEAST = 8  # samples of a range that another machine renders


class StudyWorker(WorkerProcess):
    """A ``Bench`` in a process of its own."""

    program = "from taichi_tracer.studies.workers import work; work()"
    task = "the study"


def work() -> None:
    """What the process of a ``StudyWorker`` does until its input ends."""
    from taichi_tracer.studies.bench import Bench  # while the parent still reads its own modules

    serve(Bench)


class InThisProcess:
    """A ``Bench`` in this process, for scenes and parts of the caller that no other process has."""

    pid = 0
    bench: Any = None

    def ask(self, method: str, *words) -> Future:
        """Call a method of the bench now; "open" makes the bench."""
        from taichi_tracer.studies.bench import Bench

        future: Future = Future()
        try:
            if method == "open":
                self.bench, result = Bench(*words), None
            else:
                result = getattr(self.bench, method)(*words)
            future.set_result(result)
        except Exception as error:
            future.set_exception(error)
        return future

    def close(self) -> None:
        """Forget the scenes."""
        self.bench = None


class OtherMachines(Protocol):
    """Other machines that render a study: one measures, and the others help with the reference.

    Attributes:
        processors: how many the machine has on which everything is measured; 1 as long as that is not known.
    """

    processors: int

    def start_worker(self) -> Worker:
        """One more process on the machine that measures."""

    def helpers(self) -> list[Worker]:
        """A process on each other machine, for a part of the reference."""

    def told(self) -> str:
        """A sentence on whose seconds the study tells."""


class Helpers:
    """Workers that render ranges of the reference's samples; there may be none. Nothing is measured on them.

    Their ranges are added up without rounding. After a range that does not come, the first machine goes on: the samples
    of the reference are always a range without gaps.

    Args:
        bench: the arguments of their ``Bench``.
        variant, size: of the reference, which they compile while the first machine compiles, too.
    """

    def __init__(self, workers: list[Worker], bench: tuple, variant: "Variant", size: tuple[int, int]) -> None:
        self.variant, self.size = variant, size
        for worker in workers:
            worker.ask("open", *bench)
        self.prepared = {worker: worker.ask("prepare", variant, size) for worker in workers}
        self.samples = dict.fromkeys(workers, 0)  # of each worker, that were added to the reference

    def begin(self, seed: int, first: int, seconds: float) -> list[tuple[Worker, int, Future]]:
        """(worker, samples, call) of ranges that follow each other from ``first``, of about so many seconds each."""
        ranges = []
        for worker, prepared in self.prepared.items():
            if prepared.done() and prepared.exception() is None:
                per_sample = max(prepared.result().seconds_per_sample, 1e-6)
                count = max(LEAST, int(seconds / per_sample) // LEAST * LEAST)
                ranges.append((worker, count, worker.ask("take", self.variant, self.size, seed, first, count)))
                first += count
        return ranges

    def parts(self, ranges: list[tuple[Worker, int, Future]], wait_for: Callable) -> list[tuple[int, dict]]:
        """(samples, arrays) of the ranges that came, up to the first that did not; its worker gets no more."""
        found: list[tuple[int, dict]] = []
        for worker, count, future in ranges:
            try:
                found.append((count, wait_for(future, "rendering the reference")))
            except RuntimeError:  # its machine has gone, or its process has ended
                del self.prepared[worker]
                break
            self.samples[worker] += count
        return found

    def told(self) -> str:
        """A sentence on what they did."""
        helped = [samples for samples in self.samples.values() if samples > 0]
        if not helped:
            return "It rendered the reference, too."
        many = f"{len(helped)} other worker{'s' * (len(helped) > 1)}"
        return f"{many} rendered {sum(helped):,} samples per pixel of the reference."

    def close(self) -> None:
        """Let their processes end."""
        for worker in self.samples:
            worker.close()
        self.prepared.clear()
