"""A study within its budget: what is compiled, what is rendered for how long, and what is left out.

1. **Compiling.** The first process reads the scene and compiles the first variant; others compile the rest beside it. A
   variant is left out, and named, if compiling it would take the time of the measurement.
2. **A round for each seed**, with an equal time for every variant. Pictures are compared with the reference at 2, 4,
   8, … samples. Variants that differ in one knob take turns, so that their times can be compared.
3. **More rounds of those that may still win**, each with at least twice as many samples as the one before, until they
   have reached the errors that are asked for. What is left then goes to those that have the fewest pictures.
"""

import math
import os
import time
from collections.abc import Callable, Sequence
from concurrent.futures import FIRST_COMPLETED, Future, wait
from dataclasses import dataclass

import numpy as np

from taichi_tracer.picture.adaptive import PILOT
from taichi_tracer.picture.metrics import flip, rel_mse
from taichi_tracer.studies import machine
from taichi_tracer.studies.bench import Prepared, SceneFacts, Shot
from taichi_tracer.studies.convergence import MIDDLE, TARGETS, Block, Curve, Shown, Study, Truth, error_of, scaled
from taichi_tracer.studies.crew import Assistants, Crew, Here, StudyWorker
from taichi_tracer.studies.variants import (
    Source,
    Variant,
    by_priority,
    comparable,
    is_of_the_chart,
    process_of,
    reference_variant,
)
from taichi_tracer.system.errors import InputError
from taichi_tracer.system.processes import Clerk, WorkerDied

REFERENCE_SEED, PICTURE_SEED = 1_000_003, 2_000_003  # no round comes so far
# Shares of the budget: until when variants begin to compile, and until when further processes are waited for; what the
# first reference takes at most, every other one (few variants need it), and all pictures at equal time. Somewhat less
# than half is left for the rounds.
COMPILE_SHARE, ABANDON_SHARE, REFERENCE_SHARE, FURTHER_SHARE, PICTURES_SHARE = 0.42, 0.6, 0.08, 0.02, 0.05
EVERYBODY = 0.4  # of the time of the rounds: those of all variants; those who may win get the rest
GOOD_REFERENCE = 0.2 * TARGETS[-1]  # a reference need not be better
FIRST_SAMPLES, FLOOR, MOST_SAMPLES = 2, 16, 1 << 17  # per pixel: of the first picture, of every variant, of any
TIMED = 8  # samples: shorter blocks say little about time
LEADING = 3.0  # times the seconds of the best: who is predicted to need no more may still win
MARGIN = 1.15  # times the samples that a target probably needs are rendered, so that few rounds miss it
CHUNK = 0.4  # seconds of one call at most: by so much may a study overrun
POLL = 0.1  # seconds between two looks at what the processes do
SHORTEST = 0.5  # seconds: in less, nothing can be measured
MOST_OVERRUN = 1.1  # times the budget: later than that, no study ends
SHORT = 20.0  # seconds: with a smaller budget, nothing is compiled beside the first variant
CLOSING = 0.01, 0.4  # of the budget, and seconds: to end the processes and to make the tables
# Of the budget, and seconds: what the caller gets afterwards is at most the larger one, because a slow start of a busy
# moment does not mean that the files take as long.
MOST_RESERVE = 0.2, 1.8
ALIKE = {"precision", "fast_math", "triangle_test", "intersector", "plain"}  # knobs that change nothing to be seen


class NothingMeasured(InputError):
    """The study ended before the first picture."""


class Stopped(Exception):
    """The user has interrupted the study, or its time is over."""


@dataclass(frozen=True)
class Order:
    """What is to be measured.

    Attributes:
        source: the scene. variants: the ways to render it; all others are compared with the first one.
        size: width and height.
        budget: seconds in all. spent: of these, what was spent before.
        seeds: renderings of every variant, as far as the budget allows.
        keep: what the caller needs of the budget afterwards, as a multiple of what starting a process takes.
        arch: as for ``runtime.init``. parts: files that register parts of the user.
    """

    source: Source
    variants: Sequence[Variant]
    size: tuple[int, int]
    budget: float
    seeds: int
    spent: float = 0.0
    keep: float = 0.0
    arch: str = "auto"
    parts: tuple[str, ...] = ()


@dataclass
class Lane:
    """A process.

    Attributes:
        waiting: the variants that it has still to compile, in this order. pending: what it does at the moment.
    """

    waiting: list[Variant]
    worker: Clerk | Here | None = None
    pending: Future | None = None


class Schedule:
    """A study in progress; ``run`` does it.

    Args:
        first: a worker that was started before; None starts one, or uses this process for a scene of the caller.
        crew: who renders on other machines; None renders here.
        tell: called with what is done, and with the share of the budget that has passed.
        should_stop: asked after every block; the study then ends with what was measured.
    """

    def __init__(
        self,
        order: Order,
        first: Clerk | None = None,
        crew: Crew | None = None,
        tell: Callable[[str, float], None] = lambda what, done: None,
        should_stop: Callable[[], bool] = lambda: False,
    ) -> None:
        self.order, self.budget, self.first, self.crew = order, order.budget, first, crew
        self.tell, self.should_stop = tell, should_stop
        self.variants, self.base = list(order.variants), order.variants[0]
        share, least = CLOSING
        self.started = time.perf_counter() - order.spent
        self.end = self.started + self.budget - max(share * self.budget, least)
        self.start_seconds, self.equal_seconds = math.nan, 0.0
        self.turn = self.kernels_made = 0
        self.lanes: list[Lane] = []
        self.curves: list[Curve] = []
        self.lane_of: dict[Variant, Lane] = {}
        self.truths: dict[tuple[str, float], Truth] = {}  # by look-up and resolution
        self.notes: list[str] = []
        self.others = machine.Others()
        self.assistants = Assistants(crew, (order.source, order.arch, order.parts))

    # ── time ──

    @property
    def elapsed(self) -> float:
        """Seconds of the budget that are spent."""
        return time.perf_counter() - self.started

    @property
    def left(self) -> float:
        """Seconds that may still be spent on measuring."""
        return self.end - time.perf_counter()

    @property
    def is_over(self) -> bool:
        """Whether the time is over. Until a variant is compiled: whether nothing could be measured any more."""
        if self.curves:
            return self.left <= 0
        return self.elapsed + self.reserve() + SHORTEST > MOST_OVERRUN * self.budget

    def reserve(self) -> float:
        """Seconds that the caller needs afterwards."""
        share, seconds = MOST_RESERVE
        start = 0.0 if math.isnan(self.start_seconds) else self.start_seconds
        return min(self.order.keep * start, max(share * self.budget, seconds))

    def say(self, what: str) -> None:
        """Tell what is done, and stop where the user wants that, or where the time is over."""
        self.tell(what, self.elapsed / self.budget)
        if self.should_stop() or self.is_over:
            raise Stopped

    def wait_for(self, future: Future, what: str):
        """The result of a call; meanwhile, look at the clock and at the user."""
        while not wait([future], timeout=POLL).done:
            self.say(what)
        self.say(what)
        return future.result()

    def look(self) -> None:
        """Look at what other programs take of this machine."""
        workers = [lane.worker for lane in self.lanes if lane.worker is not None]
        self.others.look([os.getpid(), *(worker.pid for worker in workers if worker.pid)])

    # ── the whole ──

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
            self.assistants.close()
            for worker in (self.first, *(lane.worker for lane in self.lanes)):
                if worker is not None:
                    worker.close()

    def why_nothing(self) -> str:
        """What ended the study before its first picture."""
        if self.should_stop():
            return "accuracy: interrupted before the first picture was measured"
        enough = math.ceil(3 * self.budget / 5) * 5
        return (
            f"accuracy: --budget {self.budget:g} was over before {self.base.label} was compiled, and nothing was "
            f"measured: give --budget {max(enough, 20)}, or run it again, which finds kernels that are compiled by then"
        )

    def read(self) -> SceneFacts:
        """Start the first process, read the scene, and leave out what cannot be compared."""
        first = Lane([])
        self.lanes.append(first)
        self.hire(first)
        self.tell("starting", self.elapsed / self.budget)
        self.assistants.hire()
        self.wait_for(first.pending, "starting")
        self.assistants.hire()  # those that have come since
        self.start_seconds = self.elapsed
        self.end -= self.reserve()
        facts = self.wait_for(first.worker.ask("facts", self.base), "reading the scene")
        self.look()
        self.variants, self.notes = comparable(self.variants, facts)
        self.assistants.get_ready(reference_variant(self.base, self.variants), self.order.size)
        return facts

    def hire(self, lane: Lane) -> None:
        """Give a lane a process, or this one, which opens its bench."""
        if self.order.source.here:
            lane.worker = Here()
        elif self.crew is not None:
            lane.worker = self.crew.hire()
        else:
            lane.worker, self.first = self.first, None
            lane.worker = lane.worker or StudyWorker(is_heard=lane is self.lanes[0])
        lane.pending = lane.worker.ask("open", self.order.source, self.order.arch, self.order.parts)

    # ── compiling, and the references ──

    def compile(self) -> None:
        """Compile the variants, the most important ones first, in as many processes at a time as there are processors.

        Those that were not begun in time are left out. A process that still compiles much later is not waited for, and
        cannot measure. It finishes its kernel, which is kept for the next run.
        """
        by_process: dict[tuple, list[Variant]] = {}
        for variant in by_priority(self.variants):
            by_process.setdefault(() if self.order.source.here else process_of(variant, self.base), []).append(variant)
        self.lanes[0].waiting, *others = by_process.values()
        self.lanes += [Lane(variants) for variants in others]
        while busy := [lane for lane in self.lanes if self.is_busy(lane)]:
            wait([lane.pending for lane in busy], timeout=POLL, return_when=FIRST_COMPLETED)
            self.say(f"compiling {'; '.join(lane.waiting[0].label for lane in busy)}")
            for lane in busy[busy[0] is self.lanes[0] :]:
                if self.elapsed > ABANDON_SHARE * self.budget and not lane.pending.done():
                    lane.worker.close()
                    self.lanes.remove(lane)
                    self.curves = [curve for curve in self.curves if self.lane_of[curve.variant] is not lane]

    def is_busy(self, lane: Lane) -> bool:
        """Take what a process has compiled, let it begin with the next variant, and tell whether it works now."""
        if lane.pending is not None and lane.pending.done():
            result, lane.pending = lane.pending.result(), None
            if result is not None:  # the answer of a process that was opened is None
                self.take(lane, result)
        has_time = not self.curves or self.elapsed < COMPILE_SHARE * self.budget
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
        is_early = self.budget < SHORT and not self.curves
        return not is_early and sum(lane.pending is not None for lane in self.lanes) < processors

    def take(self, lane: Lane, result: Prepared) -> None:
        """Take what a process has compiled."""
        variant = lane.waiting.pop(0)
        self.kernels_made += result.new_kernels
        if not self.curves:
            self.end = max(self.end, time.perf_counter() + SHORTEST)
        self.curves.append(Curve(variant, result.compile_seconds, result.trial, result.seconds_to_save))
        self.lane_of[variant] = lane

    def render_references(self) -> None:
        """The pictures with which all others are compared."""
        order = by_priority(self.variants)
        self.curves.sort(key=lambda curve: order.index(curve.variant))
        for variant in [curve.variant for curve in self.curves]:
            key = variant.lookup, 1.0
            if key not in self.truths:
                own = reference_variant(variant, self.variants)
                share = FURTHER_SHARE if self.truths else REFERENCE_SHARE
                seconds = min(share * self.budget, 0.4 * self.left)
                self.truths[key] = self.reference_of(self.lane_of.get(own, self.lane_of[variant]), own, seconds)
            self.truths[variant.lookup, variant.scale] = scaled(self.truths[key], variant.scale)
        self.assistants.close()  # so that nobody disturbs those that are measured

    def reference_of(self, lane: Lane, variant: Variant, seconds: float) -> Truth:
        """A picture by multiple importance sampling, for at most that many seconds, and how far it is off."""
        size, end = self.order.size, time.perf_counter() + seconds
        shot, per_sample, count = None, math.nan, TIMED
        while shot is None or (shot.error > GOOD_REFERENCE and time.perf_counter() + CHUNK <= end):
            if shot is not None:
                rest = min(2 * CHUNK, end - time.perf_counter())
                count = max(TIMED, int(rest / max(per_sample, 1e-6)) // TIMED * TIMED)
            ask = lane.worker.ask("render", variant, size, count, REFERENCE_SEED if shot is None else None, "variance")
            if not self.truths:
                first = count + (0 if shot is None else shot.samples)
                self.assistants.begin(variant, size, REFERENCE_SEED, first, 2 * CHUNK)
            shot = self.wait_for(ask, "rendering the reference")
            per_sample = shot.seconds / count
            if parts := self.assistants.parts(self.wait_for):
                shot = self.wait_for(lane.worker.ask("add", variant, size, parts), "adding up the reference")
        if math.isnan(shot.error):
            scene = self.order.source.scene
            raise InputError(f"accuracy: no light of {scene} reaches the camera, so that there is no error to measure")
        return Truth(shot.image.astype(np.float64), shot.error, np.nan_to_num(shot.variance), shot.samples)

    # ── measuring ──

    def measure(self) -> None:
        """A round of all variants for each seed, the pictures to be shown, and the rounds of those that may win."""
        while len(self.curves) > 1 and FLOOR * self.seconds_of_all > self.left / 4:
            self.curves.pop()
        seconds = EVERYBODY * self.left
        seeds = min(max(int(seconds / (FLOOR * self.seconds_of_all)), 1), self.order.seeds)
        share = seconds / seeds / len(self.curves)
        levels = {curve.variant: power_of_two(share / curve.seconds_per_sample) for curve in self.curves}
        for variant in (v for v in levels if not is_of_the_chart(v, self.base)):
            levels[variant] = min(levels[variant], levels[self.base])  # more could not be compared
        for seed in range(1, seeds + 1):
            self.look()
            for wave in waves(self.curves):
                self.round(wave, seed, levels)
        self.render_pictures()
        while found := self.next_of_the_race() or self.next_with_few():
            curve, samples = found
            seeds += 1
            self.round([curve], seeds, {curve.variant: samples})

    @property
    def seconds_of_all(self) -> float:
        """Seconds of one sample of every variant."""
        return sum(curve.seconds_per_sample for curve in self.curves)

    def round(self, curves: Sequence[Curve], seed: int, samples: dict[Variant, int]) -> None:
        """Render variants with one seed, which take turns; compare their pictures at each doubling."""
        levels = {curve.variant: levels_up_to(curve.variant, samples[curve.variant]) for curve in curves}
        for level in sorted({n for own in levels.values() for n in own}):
            self.turn += 1
            for curve in curves:
                if level in levels[curve.variant]:
                    self.advance(curve, seed, level)

    def advance(self, curve: Curve, seed: int, level: int) -> None:
        """Bring a picture to so many samples, in calls that are short, and compare it."""
        begun = done = max(curve.found.get(seed, {}), default=0)
        seconds, chunk = 0.0, max(1, int(CHUNK / max(curve.seconds_per_sample, 1e-9)))
        while done < level:
            count = min(level - done, chunk)
            wants = "" if done + count < level else "variance" if level >= FLOOR else "image"
            new = seed if done == 0 else None
            shot = self.render(curve.variant, count, new, wants, f"seed {seed}, {level} samples")
            seconds, done = seconds + shot.seconds, done + count
            if shot.pilot_seconds > 0:
                curve.pilots.append(shot.pilot_seconds)
        if level - begun >= TIMED:
            curve.blocks.append(Block(self.turn, level - begun, seconds))
        curve.found.setdefault(seed, {})[level] = error_of(shot.image, shot.error, self.truth_of(curve)), shot.error
        if shot.variance is not None:
            curve.finals[seed] = shot.image.astype(np.float64), shot.variance

    def render(self, variant: Variant, samples: int, seed: int | None, wants: str, what: str) -> Shot:
        """Samples of a variant's picture; see ``Bench.render``."""
        worker = self.lane_of[variant].worker
        ask = worker.ask("render", variant, self.order.size, samples, seed, wants)
        return self.wait_for(ask, f"{variant.label}: {what}")

    def render_pictures(self) -> None:
        """A picture of each variant after the same time, as long as the best one takes to the second target."""
        own = [c for c in self.curves if not ALIKE & set(c.variant.differences(self.base)) and c.variant.scale == 1]
        share = min(PICTURES_SHARE * self.budget, max(0.0, self.left) / 2) / max(1, len(own))
        self.equal_seconds = min([share, *(c.samples_to(TARGETS[1]) * c.seconds_per_sample for c in own)])
        for curve in own:
            least = PILOT if curve.variant.adaptive else FIRST_SAMPLES
            count = max(least, round(self.equal_seconds / curve.seconds_per_sample))
            shot, truth = self.render(curve.variant, count, PICTURE_SEED, "image", "a picture"), self.truth_of(curve)
            numbers = truth.error_of(shot.image), rel_mse(shot.image, truth.image), flip(shot.image, truth.image)[0]
            curve.shown = Shown(shot.image, shot.samples, *numbers)

    def truth_of(self, curve: Curve) -> Truth:
        """What the pictures of a variant are compared with."""
        return self.truths[curve.variant.lookup, curve.variant.scale]

    def next_of_the_race(self) -> tuple[Curve, int] | None:
        """Who is rendered next, of those that may win, and up to how many samples; None if there is no time for any.

        All of them go to one target, the fastest first, before anyone goes to the next one.
        """
        forecast = {
            c.variant: c.samples_to(MIDDLE) * c.seconds_per_sample
            for c in self.curves
            if is_of_the_chart(c.variant, self.base)
        }
        most = LEADING * min(forecast.values(), default=math.inf)
        leading = [c for c in self.curves if forecast.get(c.variant, math.inf) <= most]
        for target in TARGETS[1:]:
            for curve in sorted(leading, key=lambda c: forecast[c.variant]):
                least, fits = 2 * curve.most_samples, min(self.left / curve.seconds_per_sample, MOST_SAMPLES)
                if math.isnan(curve.seconds_to(target)) and fits >= least:
                    return curve, int(min(max(MARGIN * curve.samples_to(target), least), fits)) // 2 * 2
        return None

    def next_with_few(self) -> tuple[Curve, int] | None:
        """Who gets another picture, as large as its largest or as time allows: whoever has the fewest."""
        for curve in sorted(self.curves, key=lambda c: (len(c.found), c.seconds_per_sample)):
            samples = power_of_two(min(curve.most_samples, self.left / curve.seconds_per_sample))
            if samples * curve.seconds_per_sample <= self.left:
                return curve, samples
        return None

    # ── what was found ──

    def study(self, facts: SceneFacts) -> Study:
        """Everything that was measured, and what is missing."""
        bounces = max(v.max_bounces for v in self.variants)
        curves = [curve for curve in self.curves if curve.found]
        curves.sort(key=lambda curve: self.variants.index(curve.variant))
        for curve in curves:
            curve.is_biased = curve.variant.is_path and curve.variant.max_bounces < bounces
            curve.judge(self.truth_of(curve))
        compiled, measured = set(self.lane_of), {curve.variant for curve in curves}
        missing = {
            "compile": [v for v in by_priority(self.variants) if v not in compiled],
            "measure": [v for v in by_priority(self.variants) if v in compiled - measured],
        }
        for what, variants in missing.items():
            if variants:
                labels = "; ".join(v.label for v in variants)
                self.notes.append(f"Not compared, because there was no time to {what} them: {labels}.")
        if self.crew is not None:
            self.notes.append(f"{self.crew.told()} {self.assistants.told()}")
        if self.should_stop():
            self.notes.append("The study was interrupted: this is what was measured until then.")
        return Study(
            facts,
            self.order.size,
            self.budget,
            min(len(curve.found) for curve in curves),
            curves,
            {v.lookup: self.truths[v.lookup, 1.0] for v in measured},
            equal_seconds=self.equal_seconds,
            reference_bounces=bounces if self.base.is_path else None,
            notes=self.notes,
            seconds=self.elapsed,
            start_seconds=self.start_seconds,
            kernels_made=self.kernels_made,
            others=self.others.told() if self.crew is None else None,
        )


def levels_up_to(variant: Variant, most: int) -> list[int]:
    """The numbers of samples at which pictures are compared: each twice the one before, but for the last."""
    first = PILOT if variant.adaptive else FIRST_SAMPLES
    levels = [first << k for k in range(MOST_SAMPLES.bit_length()) if first << k <= max(most, first)]
    return levels if most <= levels[-1] else [*levels, most]


def power_of_two(samples: float) -> int:
    """The largest power of two that is not more than a number, between ``FLOOR`` and ``MOST_SAMPLES``."""
    return 1 << int(min(max(samples, FLOOR), MOST_SAMPLES)).bit_length() - 1


def waves(curves: Sequence[Curve]) -> list[list[Curve]]:
    """Groups of variants that can take turns: no two of a group share a film."""
    found: list[dict[tuple, Curve]] = []
    for curve in curves:
        key = curve.variant.film
        wave = next((w for w in found if key not in w), None)
        if wave is None:
            wave = {}
            found.append(wave)
        wave[key] = curve
    return [list(wave.values()) for wave in found]


def measure(order: Order, **options) -> Study:
    """Render every variant within the budget; options as for ``Schedule``."""
    order.source.check(order.variants)
    return Schedule(order, **options).run()
