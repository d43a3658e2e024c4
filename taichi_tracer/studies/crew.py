"""Who renders a study: processes on this machine or on others, or the process of the caller.

Nothing here imports Taichi: the first process of a study starts while its parent still reads its own modules.
"""

from collections.abc import Callable
from concurrent.futures import Future
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Protocol

from taichi_tracer.system.processes import Clerk, Worker, serve

if TYPE_CHECKING:
    from taichi_tracer.studies.bench import Bench, Prepared
    from taichi_tracer.studies.variants import Variant

LEAST = 8  # samples of a range that another machine renders


class StudyWorker(Worker):
    """A ``Bench`` in a process of its own."""

    program = "from taichi_tracer.studies.crew import work; work()"
    task = "the study"


def work() -> None:
    """What the process of a ``StudyWorker`` does until its input ends."""
    from taichi_tracer.studies.bench import Bench  # while the parent still reads its own modules

    serve(Bench)


class Here:
    """A ``Bench`` in this process, for scenes and parts of the caller that no other process has."""

    pid = 0

    def __init__(self) -> None:
        self.bench: Bench | None = None

    def ask(self, method: str, *words, **options) -> Future:
        """Call a method of the bench now; "open" makes the bench."""
        future: Future = Future()
        try:
            if method == "open":
                from taichi_tracer.studies.bench import Bench

                self.bench = Bench(*words, **options)
                future.set_result(None)
            else:
                future.set_result(getattr(self.bench, method)(*words, **options))
        except Exception as error:
            future.set_exception(error)
        return future

    def close(self) -> None:
        """Forget the scenes."""
        self.bench = None


class Crew(Protocol):
    """Who renders a study on other machines.

    Attributes:
        processors: how many the machine has on which everything is measured; 1 as long as that is not known.
    """

    processors: int

    def hire(self) -> Clerk:
        """One more process on the machine that measures."""

    def assistants(self) -> list[Clerk]:
        """A process on each other machine on which there is none yet, for a part of the reference."""

    def told(self) -> str:
        """A sentence on whose seconds the study tells."""


@dataclass
class Assistant:
    """Another machine, which renders ranges of the reference's samples.

    Attributes:
        prepared: what it knows of the reference; it gets ranges as soon as this is there, and none after it failed.
        samples: how many of its samples were added to the reference.
        range: what it renders now, and how many samples that are.
    """

    worker: Clerk
    prepared: "Future[Prepared] | None" = None
    samples: int = 0
    range: tuple[Future, int] | None = None


class Assistants:
    """All assistants; there may be none. Nothing is measured on them.

    Their ranges are added up without rounding. A range that does not come is rendered by the first machine, and what
    follows it too: the samples of the reference are always a range without gaps.

    Args:
        crew: where they are; None: there are none. bench: the arguments of their ``Bench``.
    """

    def __init__(self, crew: Crew | None, bench: tuple) -> None:
        self.crew, self.bench = crew, bench
        self.known: list[Assistant] = []

    def hire(self) -> None:
        """Let the machines start a process that are there and have none yet."""
        for worker in [] if self.crew is None else self.crew.assistants():
            self.known.append(Assistant(worker))
            worker.ask("open", *self.bench)

    def get_ready(self, variant: "Variant", size: tuple[int, int]) -> None:
        """Let them load the scene and compile, while the first machine does that too."""
        for one in self.known:
            one.prepared = one.worker.ask("prepare", variant, size)

    def begin(self, variant: "Variant", size: tuple[int, int], seed: int, first: int, seconds: float) -> None:
        """Give everybody who is ready a range of about so many seconds; the ranges follow each other from ``first``."""
        for one in self.known:
            ready = one.prepared
            if ready is not None and ready.done() and ready.exception() is None:
                count = max(LEAST, int(seconds / max(ready.result().trial.seconds, 1e-6)) // LEAST * LEAST)
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
                is_whole, one.prepared = False, None
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
        for one in self.known:
            one.worker.close()
