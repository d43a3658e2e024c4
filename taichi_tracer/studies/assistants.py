"""Other machines that render a part of a study's reference: ranges of its samples, which are added up without rounding.

Nothing is measured on them. A range that does not come is rendered by the first machine, and what follows it too: the
samples of the reference are always a range without gaps.
"""

from collections.abc import Callable
from concurrent.futures import Future
from dataclasses import dataclass
from typing import Any

from taichi_tracer.studies.bench import Prepared
from taichi_tracer.studies.crew import Clerk, Crew
from taichi_tracer.studies.variants import Source, Variant

LEAST = 8  # samples of a range


@dataclass
class Assistant:
    """One machine.

    Attributes:
        prepared: what it knows of the reference; it gets ranges as soon as this is there.
        samples: that it has added. range: what it renders now, and how many samples that are.
        has_failed: whether a range of it did not come; then it gets no more.
    """

    worker: Clerk
    prepared: Future
    samples: int = 0
    range: tuple[Future, int] | None = None
    has_failed: bool = False

    @property
    def is_ready(self) -> bool:
        """Whether it has compiled what it needs."""
        return not self.has_failed and self.prepared.done() and self.prepared.exception() is None


class Assistants:
    """All of them; there may be none."""

    def __init__(self) -> None:
        self.workers: list[Clerk] = []
        self.known: list[Assistant] = []

    def hire(self, crew: Crew | None, source: Source, arch: str, parts: tuple[str, ...]) -> None:
        """Let the machines start a process that are there and have none yet; without a crew, there are none."""
        for worker in [] if crew is None else crew.assistants():
            self.workers.append(worker)
            worker.ask("open", source, arch, parts)

    def get_ready(self, variant: Variant, size: tuple[int, int]) -> None:
        """Let them load the scene and compile, while the first machine does that too."""
        self.known = [Assistant(worker, worker.ask("prepare", variant, size)) for worker in self.workers]

    def begin(self, variant: Variant, size: tuple[int, int], seed: int, first: int, seconds: float) -> None:
        """Give everybody who is ready a range of about so many seconds; they follow each other from ``first`` on."""
        for one in self.known:
            if one.is_ready:
                prepared: Prepared = one.prepared.result()
                count = max(LEAST, int(seconds / max(prepared.seconds, 1e-6)) // LEAST * LEAST)
                one.range = one.worker.ask("take", variant, size, seed, first, count), count
                first += count

    def parts(self, wait_for: Callable[[Future, str], Any]) -> list[tuple[int, dict]]:
        """(samples, arrays) of the ranges that came, up to the first that did not; whoever failed gets no more."""
        found: list[tuple[int, dict]] = []
        is_whole = True
        for one in self.known:
            if one.range is None:
                continue
            (future, count), one.range = one.range, None
            try:
                arrays = wait_for(future, "rendering the reference")
            except RuntimeError:  # its worker has gone, or its process has ended
                is_whole, one.has_failed = False, True
                continue
            if is_whole:
                found.append((count, arrays))
                one.samples += count
        return found

    def told(self) -> str:
        """A sentence on what they did."""
        helped = [one.samples for one in self.known if one.samples > 0]
        if not helped:
            return "It rendered the reference, too."
        many = f"{len(helped)} other worker{'s' * (len(helped) > 1)}"
        return f"{many} rendered {sum(helped):,} samples per pixel of the reference."

    def close(self) -> None:
        """Let their processes end."""
        for worker in self.workers:
            worker.close()
        self.workers = []
