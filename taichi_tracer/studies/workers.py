"""Who renders a study: processes on this machine or on others, or the process of the caller.

Nothing here imports Taichi: the first process of a study starts while its parent still reads its own modules.
"""

from concurrent.futures import Future
from typing import TYPE_CHECKING, Any

from taichi_tracer.system.processes import Worker, WorkerProcess, serve

if TYPE_CHECKING:
    pass


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
