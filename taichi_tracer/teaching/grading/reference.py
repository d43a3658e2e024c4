"""What a class is compared with: the inputs of every part, and the solution's answers to them.

The solution runs in a process of its own, so that Taichi never runs in the grader's. Its answers depend on the
assignment, the package and the seed alone. They are computed once and kept in the user's cache, beside the compiled
kernels, of which every submission gets a copy.
"""

import contextlib
import hashlib
import threading
from functools import cached_property
from pathlib import Path

import taichi_tracer
from taichi_tracer.system.errors import InputError
from taichi_tracer.teaching.base import Arrays, Assignment, Part
from taichi_tracer.teaching.cache import arrays_in, cache_folder, joined, keep_arrays, parted
from taichi_tracer.teaching.grading.isolate import SECONDS_TO_LOAD, IsolationLevel, SubmissionProcess, WorkerEnded
from taichi_tracer.teaching.student_import import OK

SECONDS_TO_FIND = 600.0  # after which the search for mistakes is given up
TRUSTED = IsolationLevel("limits")


class Reference(contextlib.AbstractContextManager):
    """The right answers for one class. Several threads may ask it.

    Args:
        assignment: what is graded. seed: decides the inputs.

    Attributes:
        kernels: the folder with the compiled kernels of the solution.
        running: the processes of hand-ins. is_stopped: whether these are ended, and no marks are kept.
    """

    def __init__(self, assignment: Assignment, seed: int) -> None:
        self.assignment, self.seed = assignment, seed
        self.folder = cache_folder() / "classes" / f"{assignment.name}-{fingerprint(assignment)[:16]}"
        self.kernels = self.folder / "cache"
        self.inputs = {part.name: assignment.inputs(part, seed) for part in assignment.parts}
        self._child: SubmissionProcess | None = None
        self._lock = threading.Lock()
        self.running: set[SubmissionProcess] = set()
        self.is_stopped = False

    def __exit__(self, *_error) -> None:
        with self._lock:
            self._end()

    def stop(self) -> None:
        """End the processes of hand-ins; those that are started from now on end at once."""
        self.is_stopped = True
        for child in list(self.running):
            child.hurry()

    @cached_property
    def expected(self) -> dict[str, Arrays]:
        """Part → the solution's answers.

        Raises:
            InputError: the solution does not run.
        """
        path = self.folder / f"expected-{self.seed}.npz"
        found = parted(arrays_in(path) or {})
        if found.keys() != self.inputs.keys():
            with self._lock:
                found = {part.name: self._answer(part) for part in self.assignment.parts}
                self._end()  # so that its kernels are written
            keep_arrays(path, joined(found))
        return found

    def find(self, part: Part, answers: Arrays) -> tuple[dict, ...]:
        """What is probably wrong with the answers to a part; see ``PartResult.findings``."""
        arrays = joined({"answers": answers, "expected": self.expected[part.name]})
        request = {"do": "find", "part": part.name, "seed": self.seed}
        with self._lock:
            try:
                reply, _ = self._trusted().ask(request, arrays, SECONDS_TO_FIND)
            except WorkerEnded:  # the marks do not depend on it
                self._child = None
                return ()
        return tuple(reply["findings"])

    def _answer(self, part: Part) -> Arrays:
        try:
            reply, arrays = self._trusted().ask({"do": "run", "part": part.name}, self.inputs[part.name])
        except WorkerEnded as error:
            self._child = None
            raise InputError(f"the solution of {part.name} ends its process: {error}") from None
        if reply["status"] != OK:
            where = f"assignment {self.assignment.name}: the solution of {part.name}"
            raise InputError(f"{where} is {reply['status']}: {reply['message']}")
        return arrays

    def _trusted(self) -> SubmissionProcess:
        """The process of the solution, which is started when it is first needed."""
        if self._child is None:
            self.folder.mkdir(parents=True, exist_ok=True)
            child = SubmissionProcess(None, TRUSTED, None, keep=self.folder)
            try:
                child.ask({"do": "load", "assignment": str(self.assignment.folder)}, wall=SECONDS_TO_LOAD)
            except WorkerEnded as error:
                child.end()
                name = self.assignment.name
                raise InputError(
                    f"assignment {name}: the solution cannot be run: {error} {child.output[-300:]}"
                ) from None
            self._child = child
        return self._child

    def _end(self) -> None:
        if self._child is not None:
            self._child.end()
            self._child = None


def fingerprint(assignment: Assignment) -> str:
    """A hash of everything that marks and hints depend on."""
    digest = hashlib.sha256(taichi_tracer.__version__.encode())
    for root in (assignment.folder, *Path(__file__).parents[:2]):
        for path in sorted(root.glob("*.py")) + sorted((root / "solution").glob("*.py")):
            digest.update(path.name.encode() + path.read_bytes())
    return digest.hexdigest()
