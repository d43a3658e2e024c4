"""Who renders a study: processes on this machine or on others, or the process of the caller.

Nothing here imports Taichi: the first process of a study starts while its parent still reads its own modules.
"""

from collections.abc import Callable
from concurrent.futures import Future
from typing import TYPE_CHECKING, Any, Protocol

from taichi_tracer.system.processes import Worker, WorkerProcess, serve

if TYPE_CHECKING:
    from taichi_tracer.studies.variants import Variant


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


AnyWorker = Worker | InThisProcess


class OtherMachines(Protocol):
    """Other machines that render a study: everything is measured on one, and the others help with the reference.

    Attributes:
        processors: how many the machine has that measures; 1 as long as that is not known.
    """

    processors: int

    def start_worker(self) -> Worker:
        """One more process on the machine that measures."""

    def get_ready(self, bench: tuple, variant: "Variant", size: tuple[int, int]) -> None:
        """Let the others compile the reference, while the first one compiles, too."""

    def begin(self, seed: int, first: int, seconds: float) -> None:
        """Let the others render samples of the reference that follow ``first``, for about so many seconds."""

    def parts(self, wait_for: Callable) -> list[tuple[int, dict]]:
        """(samples, arrays) of what the others have rendered since ``begin``, without gaps."""

    def end_helping(self) -> None:
        """Let the processes of the others end."""

    def told(self) -> str:
        """What was measured where, in a sentence, and who rendered the reference, in another."""
