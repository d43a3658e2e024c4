"""A study of accuracy on a cluster: every time is measured on one worker, and all of them render the reference.

Seconds of different machines cannot be compared, and two processes on one machine disturb each other. Therefore the
variants are rendered by one worker, one at a time, as a study without a cluster does it. The reference is a picture
like any other: its samples come from all workers, and add up exactly.
"""

import contextlib
import math
import threading
import time
from argparse import Namespace
from collections.abc import Callable
from functools import cached_property
from itertools import count
from typing import Any

from taichi_tracer.apps.accuracy import source_of
from taichi_tracer.cluster import worker
from taichi_tracer.cluster.helpers import Helpers
from taichi_tracer.cluster.members import FIRST_LOOK, LOOK, Cluster, Member, last_line, later
from taichi_tracer.cluster.parcel import Parcel, pack
from taichi_tracer.files.disk import noting_reads
from taichi_tracer.files.shipped import shipped_environments
from taichi_tracer.scene_data_loader import name_of, shipped_scenes
from taichi_tracer.studies.variants import Variant
from taichi_tracer.system import runtime
from taichi_tracer.system.errors import IncompleteError, InputError
from taichi_tracer.system.processes import Worker, WorkerDied

WAIT_FOR_WORKER = 2.0  # seconds in which a worker may come before the study waits for it beside other things
FETCH = 60.0  # seconds in which an answer has to come after it is there


class Distant(Worker):
    """A ``Bench`` on a worker of a cluster.

    Args:
        number: of the process among those of this study.
        measures: whether it is on the worker that measures.
    """

    def __init__(self, machines: "ClusterMachines", number: int, member: Member | None) -> None:
        self.machines, self.number, self.member = machines, number, member
        super().__init__()

    def answer(self, method: str, words: tuple, options: dict) -> Any:
        """What the process on the worker gives."""
        try:
            if self.member is None:
                self.member = self.machines.first_member()
            return self.machines.ask(self.member, self.number, method, words, options)
        except IncompleteError as error:
            raise WorkerDied(str(error)) from None

    def close(self) -> None:
        """Let the process on the worker end, without waiting for it."""
        super().close()
        if self.member is not None:
            self.machines.dismiss(self.member, self.number)


class ClusterMachines:
    """The workers of a cluster, as the machines that render a study; see ``studies.workers.OtherMachines``.

    Args:
        args: the command line of ``accuracy``.
    """

    def __init__(self, cluster: Cluster, args: Namespace) -> None:
        self.cluster, self.args = cluster, args
        self.lock, self.numbers = threading.Lock(), count()
        self.measures: Member | None = None
        self.threads: dict[str, int] = {}
        self.helpers = Helpers([], (), Variant(), (0, 0))

    @cached_property
    def parcel(self) -> Parcel:
        """The scene with its files, which are found by loading it here once; shipped ones travel by name."""
        shipped = self.args.scene in shipped_scenes() or name_of(self.args.scene) in shipped_scenes()
        if shipped and self.args.environment in (None, "none", *shipped_environments()):
            return pack(self.args, ())
        with noting_reads() as paths:
            runtime.ensure()
            source_of(self.args).load(Variant()).destroy()
        return pack(self.args, paths)

    # ── what the schedule asks for ──

    @property
    def processors(self) -> int:
        """How many processors the worker uses that measures."""
        return 1 if self.measures is None else self.threads.get(self.measures.address, 1)

    def start_worker(self) -> Distant:
        """A process on the worker that measures; the thread in which Taichi may run here asks first."""
        self.parcel  # noqa: B018 (loaded before other threads ask for it)
        with contextlib.suppress(IncompleteError):  # the first call tells it
            self.first_member(WAIT_FOR_WORKER)
        return Distant(self, next(self.numbers), self.measures)

    def get_ready(self, bench: tuple, variant: Variant, size: tuple[int, int]) -> None:
        """Let a process on each of the other workers that are there compile the reference."""
        with self.lock:
            others = [m for m in self.cluster.members.values() if m.state == "ready" and m is not self.measures]
        self.helpers = Helpers([Distant(self, next(self.numbers), one) for one in others], bench, variant, size)

    def begin(self, seed: int, first: int, seconds: float) -> None:
        """Let the others render samples of the reference; see ``Helpers``."""
        self.helpers.begin(seed, first, seconds)

    def parts(self, wait_for: Callable) -> list[tuple[int, dict]]:
        """What the others have rendered; see ``Helpers``."""
        return self.helpers.parts(wait_for)

    def end_helping(self) -> None:
        """Let the processes of the others end."""
        self.helpers.close()

    def told(self) -> str:
        """The sentences of the report that say on which machine the times were measured, and who helped."""
        address = "" if self.measures is None else self.measures.address
        threads = "one thread" if self.processors == 1 else f"{self.processors} threads"
        return (
            f"Every time was measured on one worker, {address}, with {threads}: its seconds are those "
            f"of its machine, on which nobody has looked for other programs. {self.helpers.told()}"
        )

    # ── Dask ──

    def first_member(self, patience: float = math.inf) -> Member | None:
        """The worker that measures: of those that fit, the one with the most threads.

        Args:
            patience: seconds in which one has to come; else the answer is None.

        Raises:
            IncompleteError: the scheduler has gone, or no worker fits.
        """
        with self.lock:
            if self.measures is not None:
                return self.measures
            began = time.perf_counter()
            while True:
                passed = time.perf_counter() - began
                self.cluster.look()
                ready = [m for m in self.cluster.members.values() if m.state == "ready"]
                is_settled = all(m.state in ("ready", "refused") for m in self.cluster.members.values())
                if ready and (is_settled or passed > FIRST_LOOK):
                    break
                if passed > patience:
                    return None
                self.cluster.wait_for_answers()
            self.threads = dict(later(self.cluster.client.nthreads).result(FETCH))
            self.measures = max(ready, key=lambda m: self.threads.get(m.address, 0))
            return self.measures

    def ask(self, member: Member, number: int, method: str, words: tuple, options: dict) -> Any:
        """Call a method of a process on a worker.

        Raises:
            WorkerDied: the worker, or the process on it, has ended. InputError: what it was asked for cannot be done.
        """
        if method == "open":
            parcel = self.parcel
            with self.lock:
                pieces = self.cluster.pieces_for(member, parcel)
                sent = self.cluster.session, number, parcel.message(), list(parcel.hashes), not self.cluster.is_local
                future = self.cluster.submit(worker.open_study, *sent, *pieces, at=[member.address])
        else:
            with self.lock:
                sent = self.cluster.session, number, method, list(words), options
                future = self.cluster.submit(worker.study, *sent, at=[member.address])
        is_done = threading.Event()
        future.add_done_callback(lambda _: is_done.set())
        while not is_done.wait(LOOK) and not future.done():
            with self.lock:
                self.cluster.look()
                if member.address not in self.cluster.members:
                    raise WorkerDied(f"the worker {member.address} has gone")
        if future.status == "finished":
            return later(future.result).result(FETCH)
        error = future.exception() if future.status == "error" else None
        if isinstance(error, InputError):
            raise error
        if isinstance(error, worker.GoneError) or error is None:
            reason = "its answer was lost" if error is None else last_line(error)
            raise WorkerDied(f"on the worker {member.address}, {reason}")
        raise RuntimeError(f"worker {member.address}: {error}")

    def dismiss(self, member: Member, number: int) -> None:
        """Let a process on a worker end."""
        if member.address in self.cluster.members and not self.cluster.is_lost:
            words = worker.seat_name(self.cluster.session, number)
            at = {"workers": [member.address], "on_error": "ignore"}
            later(lambda: self.cluster.client.run(worker.leave, words, **at))
