"""Workers of a cluster that help with the reference of a study, while one of them measures."""

from collections.abc import Callable
from concurrent.futures import Future

from taichi_tracer.studies.variants import Variant
from taichi_tracer.system.processes import Worker

LEAST = 8  # samples of a range


class Helpers:
    """Workers that render ranges of the reference's samples; there may be none. Nothing is measured on them.

    Their ranges are added up without rounding. After a range that does not come, the first machine goes on: the samples
    of the reference are always a range without gaps.

    Args:
        bench: the arguments of their ``Bench``.
        variant, size: of the reference, which they compile while the first machine compiles, too.
    """

    def __init__(self, workers: list[Worker], bench: tuple, variant: Variant, size: tuple[int, int]) -> None:
        self.variant, self.size = variant, size
        for worker in workers:
            worker.ask("open", *bench)
        self.ranges: list[tuple[Worker, int, Future]] = []  # (worker, samples, call)
        self.prepared = {worker: worker.ask("prepare", variant, size) for worker in workers}
        self.samples = dict.fromkeys(workers, 0)  # of each worker, that were added to the reference

    def begin(self, seed: int, first: int, seconds: float) -> None:
        """Let everybody who has compiled render a range of about so many seconds; the first one begins at ``first``."""
        self.ranges = []
        for worker, prepared in self.prepared.items():
            if prepared.done() and prepared.exception() is None:
                per_sample = max(prepared.result().seconds_per_sample, 1e-6)
                count = max(LEAST, int(seconds / per_sample) // LEAST * LEAST)
                self.ranges.append((worker, count, worker.ask("take", self.variant, self.size, seed, first, count)))
                first += count

    def parts(self, wait_for: Callable) -> list[tuple[int, dict]]:
        """(samples, arrays) of the ranges that came, up to the first that did not; its worker gets no more."""
        found: list[tuple[int, dict]] = []
        for worker, count, future in self.ranges:
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
