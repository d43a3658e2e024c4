"""A study within its budget: what is compiled, what is rendered for how long, and what is left out.

1. **Compiling.** The first process reads the scene and compiles the first variant; others compile the rest beside it.
   What would take the time of the measurement is left out, and named.
2. **Rounds of all variants.** In each, every variant renders one picture with a new seed and twice as many samples as
   in the round before; a few samples, once that takes too long and seeds are missing. Pictures are compared with the
   reference at 4, 8, 16, … samples.
3. **Rounds of the better half.** When a round would take too much of the time that is left, the worse half of the
   variants drops out, until one is left.
4. **The leader.** A third of the budget is kept for the variant that is ahead, because it answers the question of the
   study. What is left then goes to those that have the fewest pictures.
"""

import math
import os
from collections.abc import Callable, Sequence
from concurrent.futures import FIRST_COMPLETED, Future, wait

import numpy as np

from taichi_tracer.picture.adaptive import PILOT
from taichi_tracer.picture.metrics import flip, rel_mse
from taichi_tracer.studies.bench import Shot
from taichi_tracer.studies.budget import POLL, Budget, Stopped
from taichi_tracer.studies.convergence import TARGETS, Block, Curve, Shown, Study, Truth, error_of, leading, scaled
from taichi_tracer.studies.source import Order, SceneFacts, comparable
from taichi_tracer.studies.variants import Variant, by_priority, is_of_the_chart, process_of, reference_variant
from taichi_tracer.studies.workers import AnyWorker, InThisProcess, StudyWorker
from taichi_tracer.system import processors
from taichi_tracer.system.errors import InputError
from taichi_tracer.system.processes import Worker, WorkerDied

REFERENCE_SEED, PICTURE_SEED = 1_000_003, 2_000_003  # no round comes so far
# Shares of the budget: until when variants begin to compile, and those that are only another estimator; and until when
# they are waited for. A variant of cornell_box compiles for 1 to 5 s. References, pictures and closing take a quarter.
COMPILE_SHARE, ESTIMATORS_SHARE, WAIT_SHARE = 0.2, 0.28, 0.34
LEADER_SHARE = 0.37  # of the budget: how long the leader is rendered at least; a little more than 20 s of 60 s
COMPARING = 1.12  # times the seconds of rendering: with what is done to compare the pictures
# What the first reference takes at most, every other one (few variants need it), and all pictures at equal time.
REFERENCE_SHARE, FURTHER_SHARE, PICTURES_SHARE = 0.08, 0.02, 0.05
EVERYBODY = 0.25  # of the time that is left: what a round of all variants takes at most
GOOD_REFERENCE = 0.2 * TARGETS[-1]  # a reference need not be better
FIRST_SAMPLES, FLOOR = 4, 16  # per pixel: of the first comparison, and of every picture at least
TIMED = 8  # samples: shorter blocks say little about time
CHUNK = 0.4  # seconds of one call at most: by so much may a study overrun
ALIKE = {"precision", "fast_math", "triangle_test", "intersector"}  # knobs that change nothing to be seen


class NothingMeasured(InputError):
    """The study ended before the first picture."""


class Schedule:
    """A study in progress; ``run`` does it.

    Args:
        first: a worker that was started before; None starts one, or uses this process for a scene of the caller.
        tell: called with what is done, and with the share of the budget that has passed.
        should_stop: asked all the time; the study then ends with what was measured.

    Attributes:
        workers: all that were started; the first one reads the scene, and renders the first variant.
        worker_of: the worker of each variant that is compiled. curves: what these have reached.
        truths: look-up → what pictures are compared with.
        overhead: how much longer a round takes than its samples alone.
    """

    def __init__(
        self,
        order: Order,
        first: Worker | None = None,
        tell: Callable[[str, float], None] = lambda what, done: None,
        should_stop: Callable[[], bool] = lambda: False,
    ) -> None:
        self.order = order
        self.budget = Budget(order, tell, should_stop)
        self.variants, self.base = list(order.variants), order.variants[0]
        self.workers: list[AnyWorker] = [] if first is None else [first]
        self.worker_of: dict[Variant, AnyWorker] = {}
        self.curves: list[Curve] = []
        self.truths: dict[str, Truth] = {}
        self.notes: list[str] = []
        self.others = processors.Others()
        self.kernels_made, self.rounds, self.equal_seconds, self.overhead = 0, 0, 0.0, 1.0

    def run(self) -> Study:
        """Measure.

        Raises:
            InputError: the scene has no light, or what is to be compared cannot be compared with it.
            NothingMeasured: the time was over, or the user had enough, before the first picture.
        """
        try:
            try:
                facts = self.read()
                self.compile()
                self.render_references()
                self.measure()
            except Stopped:
                pass
            except WorkerDied as error:
                if not any(curve.found for curve in self.curves):
                    raise NothingMeasured(f"accuracy: {error}, before anything was measured") from None
                self.notes.append(f"The study ended early, because {error}: this is what was measured until then.")
            self.look()
            if not any(curve.found for curve in self.curves):
                raise NothingMeasured(self.why_nothing())
            return self.study(facts)
        finally:
            for worker in self.workers:
                worker.close()

    def why_nothing(self) -> str:
        """What ended the study before its first picture."""
        if self.budget.should_stop():
            return "accuracy: interrupted before the first picture was measured"
        seconds = self.order.budget
        enough = math.ceil(3 * seconds / 5) * 5
        return (
            f"accuracy: --budget {seconds:g} was over before {self.base.label} was compiled, and nothing was "
            f"measured: give --budget {max(enough, 20)}, or run it again, which finds kernels that are compiled by then"
        )

    def look(self) -> None:
        """Look at what other programs take of this machine."""
        self.others.look([os.getpid(), *(worker.pid for worker in self.workers if worker.pid)])

    # ── reading and compiling ──

    def start_worker(self) -> AnyWorker:
        """One more worker on the machine that measures."""
        if self.order.source.here:
            worker = InThisProcess()
        else:
            worker = StudyWorker(is_heard=not self.workers)
        self.workers.append(worker)
        return worker

    def read(self) -> SceneFacts:
        """Start the first worker, read the scene, and leave out what cannot be compared."""
        first = self.workers[0] if self.workers else self.start_worker()
        self.budget.wait_for(first.ask("open", *self.order.bench), "starting")
        self.budget.process_is_ready()
        facts = self.budget.wait_for(first.ask("facts", self.base), "reading the scene")
        self.look()
        self.variants, self.notes = comparable(self.variants, facts)
        return facts

    def compile(self) -> None:
        """Compile variants, the most important ones first, in as many workers at a time as there are processors.

        Those that were not begun in time are left out. A worker that still compiles much later is not waited for, and
        cannot measure. It finishes its kernel, which is kept for the next run.
        """
        first, *others = self.by_process()
        waiting: list[tuple[AnyWorker | None, list[Variant]]]
        waiting = [(self.workers[0], first), *((None, variants) for variants in others)]
        busy: dict[Future, tuple[AnyWorker, list[Variant]]] = {}
        while waiting or busy:
            most = processors.usable()
            while waiting and len(busy) < most:
                worker, variants = waiting.pop(0)
                if worker is None:
                    worker = self.start_worker()
                    worker.ask("open", *self.order.bench)
                busy[worker.ask("prepare", variants[0], self.order.size)] = worker, variants
            self.budget.say(f"compiling {'; '.join(variants[0].label for _, variants in busy.values())}")
            for future in wait(busy, timeout=POLL, return_when=FIRST_COMPLETED).done:
                worker, variants = busy.pop(future)
                variant, made = variants.pop(0), future.result()
                self.kernels_made += made.new_kernels
                self.curves.append(Curve(variant, made.compile_seconds, made.seconds_per_sample, made.seconds_to_save))
                self.worker_of[variant] = worker
                if variants:
                    waiting.insert(0, (worker, variants))
            share = self.budget.elapsed / self.order.budget
            if self.curves and share > COMPILE_SHARE:
                left = [(w, [v for v in own if self.is_an_estimator(v)]) for w, own in waiting]
                waiting = [(w, own) for w, own in left if own and share <= ESTIMATORS_SHARE]
            if self.curves and share > WAIT_SHARE:
                break
        late = {worker for worker, _ in busy.values()} - {self.workers[0]}
        self.worker_of = {variant: worker for variant, worker in self.worker_of.items() if worker not in late}
        order = [variant for variant in by_priority(self.variants) if variant in self.worker_of]
        self.curves = sorted((c for c in self.curves if c.variant in order), key=lambda c: order.index(c.variant))

    def is_an_estimator(self, variant: Variant) -> bool:
        """Whether a variant is the first one, but for its estimator."""
        return set(variant.differences(self.base)) <= {"estimator"}

    def by_process(self) -> list[list[Variant]]:
        """The variants of each worker, the most important ones first."""
        found: dict[tuple, list[Variant]] = {}
        for variant in by_priority(self.variants):
            key = () if self.order.source.here else process_of(variant, self.base)
            found.setdefault(key, []).append(variant)
        return list(found.values())

    # ── the references ──

    def render_references(self) -> None:
        """The pictures with which all others are compared."""
        for variant in [curve.variant for curve in self.curves]:
            if variant.lookup not in self.truths:
                seconds = (FURTHER_SHARE if self.truths else REFERENCE_SHARE) * self.order.budget
                self.truths[variant.lookup] = self.reference_of(variant, min(seconds, 0.4 * self.budget.left))

    def reference_of(self, variant: Variant, seconds: float) -> Truth:
        """A picture by multiple importance sampling, for at most that many seconds, and how far it is off."""
        own, end, what = reference_variant(variant, self.variants), self.budget.elapsed + seconds, "the reference"
        worker = self.worker_of.get(own, self.worker_of[variant])
        shot = self.render(worker, own, TIMED, REFERENCE_SEED, "variance", what)
        per_sample = shot.seconds / TIMED
        while shot.error > GOOD_REFERENCE and self.budget.elapsed + CHUNK <= end:
            rest = min(2 * CHUNK, end - self.budget.elapsed)
            count = max(TIMED, int(rest / max(per_sample, 1e-6)) // TIMED * TIMED)
            shot = self.render(worker, own, count, None, "variance", what)
            per_sample = shot.seconds / count
        if math.isnan(shot.error):
            scene = self.order.source.scene
            raise InputError(f"accuracy: no light of {scene} reaches the camera, so that there is no error to measure")
        return Truth(shot.image.astype(np.float64), shot.error, np.nan_to_num(shot.variance), shot.samples)

    # ── measuring ──

    def measure(self) -> None:
        """Rounds of all variants, the pictures to be shown, rounds of the better half, and whoever has few pictures."""
        variants, samples = list(self.curves), FLOOR
        while len(variants) > 1 and not self.fits(variants, samples, EVERYBODY):
            variants.pop()
        self.round(variants, samples)
        while self.fits(variants, 2 * samples, EVERYBODY):
            samples *= 2
            self.round(variants, samples)
        while self.rounds < self.order.seeds and self.fits(variants, FLOOR, EVERYBODY / 2):
            self.round(variants, FLOOR)
        self.render_pictures()
        while len(variants := sorted(variants, key=self.rank)[: len(variants) // 2]) > 1:
            while self.fits(variants, 2 * samples, 0.5):
                samples *= 2
                self.round(variants, samples)
        while fitting := [curve for curve in self.curves if self.fits([curve], FLOOR, 1.0)]:
            leader = self.leader()
            is_behind = leader in fitting and leader.rendered < LEADER_SHARE * self.order.budget
            curve = leader if is_behind else min(fitting, key=lambda curve: len(curve.found))
            samples = max((1 + is_behind) * curve.most_samples, FLOOR)
            while samples > FLOOR and not self.fits([curve], samples, 1.0):
                samples //= 2
            self.round([curve], samples)

    def leader(self) -> Curve:
        """The variant that is ahead of the others of the chart; before the first round, the first one."""
        measured = [c for c in self.curves if c.found and is_of_the_chart(c.variant, self.base)]
        return leading(measured) if measured else self.curves[0]

    def fits(self, curves: Sequence[Curve], samples: int, share: float) -> bool:
        """Whether a round takes no more than a share of the time that is left, and spares what is kept for the leader.

        Nothing is kept from the first round, where compiling took so long that nothing else is left.
        """
        left, leader = self.budget.left, self.leader()
        kept = COMPARING * max(0.0, LEADER_SHARE * self.order.budget - leader.rendered)
        kept += PICTURES_SHARE * self.order.budget * (self.equal_seconds == 0)
        spared = left if list(curves) == [leader] else max(left - kept, EVERYBODY * left * (self.rounds == 0))
        return samples * self.overhead * seconds_of(curves) <= min(share * left, spared)

    def rank(self, curve: Curve) -> tuple[bool, float]:
        """Smaller for variants that stay longer: those of the chart, and of these the most efficient ones."""
        return not is_of_the_chart(curve.variant, self.base), curve.variance_times_time

    def round(self, curves: Sequence[Curve], samples: int) -> None:
        """One more picture of each variant, which is compared whenever its samples have doubled."""
        self.look()
        self.rounds += 1
        begun, expected = self.budget.elapsed, samples * seconds_of(curves)
        for curve in curves:
            seed, level = len(curve.found) + 1, PILOT if curve.variant.adaptive else FIRST_SAMPLES
            while level <= samples:
                self.advance(curve, seed, level)
                level *= 2
        self.overhead = max(1.0, (self.budget.elapsed - begun) / expected)

    def advance(self, curve: Curve, seed: int, level: int) -> None:
        """Bring a picture to so many samples, in calls that are short, and compare it."""
        begun = done = max(curve.found.get(seed, {}), default=0)
        seconds, chunk, worker = 0.0, max(1, int(CHUNK / curve.seconds_per_sample)), self.worker_of[curve.variant]
        while done < level:
            count = min(level - done, chunk)
            wants = "" if done + count < level else "variance" if level >= FLOOR else "image"
            new, what = seed if done == 0 else None, f"seed {seed}, {level} samples"
            shot = self.render(worker, curve.variant, count, new, wants, what)
            seconds, done = seconds + shot.seconds, done + count
            curve.rendered += shot.seconds + shot.pilot_seconds
            if shot.pilot_seconds > 0:
                curve.pilots.append(shot.pilot_seconds)
        if level - begun >= TIMED:
            curve.blocks.append(Block((self.rounds, level), level - begun, seconds))
        curve.found.setdefault(seed, {})[level] = error_of(shot.image, shot.error, self.truth_of(curve)), shot.error
        if shot.variance is not None:
            curve.finals[seed] = shot.image.astype(np.float64), shot.variance

    def render(
        self, worker: AnyWorker, variant: Variant, samples: int, seed: int | None, wants: str, what: str
    ) -> Shot:
        """Samples of a variant's picture; see ``Bench.render``."""
        call = worker.ask("render", variant, self.order.size, samples, seed, wants)
        return self.budget.wait_for(call, f"{variant.label}: {what}")

    def render_pictures(self) -> None:
        """A picture of each variant after the same time, at most as long as the best one takes to the second target."""
        own = [c for c in self.curves if not ALIKE & set(c.variant.differences(self.base)) and c.variant.scale == 1]
        share = min(PICTURES_SHARE * self.order.budget, max(0.0, self.budget.left) / 2) / max(1, len(own))
        reached = [c.seconds_to(TARGETS[1]) for c in own]
        self.equal_seconds = min([share, *(seconds for seconds in reached if seconds > 0)])
        for curve in own:
            least = PILOT if curve.variant.adaptive else FIRST_SAMPLES
            count = max(least, round(self.equal_seconds / curve.seconds_per_sample))
            worker, truth = self.worker_of[curve.variant], self.truth_of(curve)
            shot = self.render(worker, curve.variant, count, PICTURE_SEED, "image", "a picture")
            numbers = truth.error_of(shot.image), rel_mse(shot.image, truth.image), flip(shot.image, truth.image)[0]
            curve.shown = Shown(shot.image, shot.samples, *numbers)

    def truth_of(self, curve: Curve) -> Truth:
        """What the pictures of a variant are compared with."""
        return scaled(self.truths[curve.variant.lookup], curve.variant.scale)

    # ── what was found ──

    def study(self, facts: SceneFacts) -> Study:
        """Everything that was measured, and what is missing."""
        bounces = max(v.max_bounces for v in self.variants)
        curves = [curve for curve in self.curves if curve.found]
        curves.sort(key=lambda curve: self.variants.index(curve.variant))
        for curve in curves:
            curve.is_biased = curve.variant.is_path and curve.variant.max_bounces < bounces
            curve.judge(self.truth_of(curve))
        compiled, measured = set(self.worker_of), {curve.variant for curve in curves}
        for what, missing in ("compile", set(self.variants) - compiled), ("measure", compiled - measured):
            if missing:
                labels = "; ".join(v.label for v in by_priority(self.variants) if v in missing)
                self.notes.append(f"Not compared, because there was no time to {what} them: {labels}.")
        if self.budget.should_stop():
            self.notes.append("The study was interrupted: this is what was measured until then.")
        return Study(
            facts,
            self.order.size,
            self.order.budget,
            min(len(curve.found) for curve in curves),
            curves,
            {v.lookup: self.truths[v.lookup] for v in measured},
            equal_seconds=self.equal_seconds,
            reference_bounces=bounces if self.base.is_path else None,
            notes=self.notes,
            seconds=self.budget.elapsed,
            start_seconds=self.budget.start_seconds,
            kernels_made=self.kernels_made,
            others=self.others.told(),
        )


def seconds_of(curves: Sequence[Curve]) -> float:
    """Seconds of one sample of every variant."""
    return sum(curve.seconds_per_sample for curve in curves)


def measure(order: Order, **options) -> Study:
    """Render every variant within the budget; options as for ``Schedule``."""
    order.source.check(order.variants)
    return Schedule(order, **options).run()
