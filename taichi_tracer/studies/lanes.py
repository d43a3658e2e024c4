"""The processes of a study on the machine that measures, and which variants each of them compiles."""

from concurrent.futures import FIRST_COMPLETED, Future, wait
from dataclasses import dataclass

from taichi_tracer.studies import machine
from taichi_tracer.studies.bench import Prepared
from taichi_tracer.studies.budget import POLL, Budget
from taichi_tracer.studies.convergence import Curve
from taichi_tracer.studies.crew import Crew, Here, StudyWorker
from taichi_tracer.studies.source import Order
from taichi_tracer.studies.variants import Variant, by_priority, process_of
from taichi_tracer.system.processes import Clerk

# Shares of the budget: until when variants begin to compile, and until when further processes are waited for. A variant
# of cornell_box compiles for 1 to 5 s, so that at 45 s about half of the budget is left to measure.
COMPILE_SHARE, ABANDON_SHARE = 0.4, 0.6
SHORT = 20.0  # seconds: with a smaller budget, nothing is compiled beside the first variant


@dataclass
class Lane:
    """A process.

    Attributes:
        waiting: the variants that it has still to compile, in this order. pending: what it does at the moment.
    """

    waiting: list[Variant]
    worker: Clerk | Here | None = None
    pending: Future | None = None


class Lanes:
    """All processes.

    Args:
        first: a worker that was started before; None starts one, or uses this process for a scene of the caller.
        crew: who renders on other machines; None renders here.

    Attributes:
        first: the process that reads the scene, and begins with the first variant.
        of: the process of each variant that is compiled. curves: of these variants; nothing is measured yet.
        kernels_made: how many kernels were compiled anew.
    """

    def __init__(self, order: Order, budget: Budget, first: Clerk | None, crew: Crew | None) -> None:
        self.order, self.budget, self.crew, self.started = order, budget, crew, first
        self.first = Lane([])
        self.lanes = [self.first]
        self.of: dict[Variant, Lane] = {}
        self.curves: list[Curve] = []
        self.kernels_made = 0

    def hire(self, lane: Lane) -> Future:
        """Give a lane a process, or this one, and let it open its bench."""
        if self.order.source.here:
            lane.worker = Here()
        elif self.crew is not None:
            lane.worker = self.crew.hire()
        else:
            lane.worker, self.started = self.started or StudyWorker(is_heard=lane is self.first), None
        lane.pending = lane.worker.ask("open", *self.order.bench)
        return lane.pending

    def compile(self, variants: list[Variant]) -> None:
        """Compile variants, the most important ones first, in as many processes at a time as there are processors.

        Those that were not begun in time are left out. A process that still compiles much later is not waited for, and
        cannot measure. It finishes its kernel, which is kept for the next run.
        """
        by_process: dict[tuple, list[Variant]] = {}
        for variant in by_priority(variants):
            key = () if self.order.source.here else process_of(variant, variants[0])
            by_process.setdefault(key, []).append(variant)
        self.first.waiting, *others = by_process.values()
        self.lanes += [Lane(own) for own in others]
        while busy := [lane for lane in self.lanes if self.is_busy(lane)]:
            wait([lane.pending for lane in busy], timeout=POLL, return_when=FIRST_COMPLETED)
            self.budget.say(f"compiling {'; '.join(lane.waiting[0].label for lane in busy)}")
            if self.budget.share > ABANDON_SHARE:
                for lane in busy:
                    if lane is not self.first and not lane.pending.done():
                        self.abandon(lane)

    def is_busy(self, lane: Lane) -> bool:
        """Take what a process has compiled, let it begin with the next variant, and tell whether it works now."""
        if lane.pending is not None and lane.pending.done():
            result, lane.pending = lane.pending.result(), None
            if result is not None:  # the answer of a process that was opened is None
                self.take(lane, result)
        has_time = not self.curves or self.budget.share < COMPILE_SHARE
        if lane.pending is None and lane.waiting and has_time:
            if lane.worker is not None:
                lane.pending = lane.worker.ask("prepare", lane.waiting[0], self.order.size)
            elif self.is_processor_free:
                self.hire(lane)
        return lane.pending is not None

    @property
    def is_processor_free(self) -> bool:
        """Whether one more process may work beside those that do."""
        processors = machine.processors() if self.crew is None else self.crew.processors
        is_early = self.budget.seconds < SHORT and not self.curves
        return not is_early and sum(lane.pending is not None for lane in self.lanes) < processors

    def take(self, lane: Lane, result: Prepared) -> None:
        """Take what a process has compiled."""
        variant = lane.waiting.pop(0)
        self.budget.variant_is_ready()
        self.kernels_made += result.new_kernels
        self.curves.append(Curve(variant, result.compile_seconds, result.trial, result.seconds_to_save))
        self.of[variant] = lane

    def abandon(self, lane: Lane) -> None:
        """Wait no longer for a process, and forget what it has compiled."""
        lane.worker.close()
        self.lanes.remove(lane)
        self.of = {variant: own for variant, own in self.of.items() if own is not lane}
        self.curves = [curve for curve in self.curves if curve.variant in self.of]

    @property
    def pids(self) -> list[int]:
        """The processes on this machine."""
        return [lane.worker.pid for lane in self.lanes if lane.worker is not None and lane.worker.pid]

    def close(self) -> None:
        """Let all processes end."""
        for worker in (self.started, *(lane.worker for lane in self.lanes)):
            if worker is not None:
                worker.close()
