"""A study within its budget: what is compiled, what is rendered for how long, and what is left out.

1. **Compiling** (``lanes``). The first process reads the scene and compiles the first variant; others compile the rest
   beside it. A variant is left out, and named, if compiling it would take the time of the measurement.
2. **A round for each seed**, with an equal time for every variant. Pictures are compared with the reference at 4, 8,
   16, … samples. Variants that differ in one knob take turns, so that their times can be compared.
3. **More rounds of those that may still win**, each with at least twice as many samples as the one before, until they
   have reached the errors that are asked for. What is left then goes to those that have the fewest pictures.
"""

import math
import os
from collections.abc import Callable, Sequence

import numpy as np

from taichi_tracer.picture.adaptive import PILOT
from taichi_tracer.picture.metrics import flip, rel_mse
from taichi_tracer.studies import machine
from taichi_tracer.studies.bench import Shot
from taichi_tracer.studies.budget import Budget, Stopped
from taichi_tracer.studies.convergence import MIDDLE, TARGETS, Block, Curve, Shown, Study, Truth, error_of, scaled
from taichi_tracer.studies.crew import Assistants, Crew
from taichi_tracer.studies.lanes import Lane, Lanes
from taichi_tracer.studies.source import Order, SceneFacts, comparable
from taichi_tracer.studies.variants import Variant, by_priority, is_of_the_chart, reference_variant
from taichi_tracer.system.errors import InputError
from taichi_tracer.system.processes import Clerk, WorkerDied

REFERENCE_SEED, PICTURE_SEED = 1_000_003, 2_000_003  # no round comes so far
# Shares of the budget: what the first reference takes at most, every other one (few variants need it), and all pictures
# at equal time.
REFERENCE_SHARE, FURTHER_SHARE, PICTURES_SHARE = 0.08, 0.02, 0.05
# Of the time of the rounds: what those of all variants get. On cube, with 20 and with 60 s, each variant then has 2 or
# 3 pictures of at least 16 samples, and the fastest one reaches 2 % in the rest.
EVERYBODY = 0.4
GOOD_REFERENCE = 0.2 * TARGETS[-1]  # a reference need not be better
FIRST_SAMPLES, FLOOR, MOST_SAMPLES = 4, 16, 1 << 17  # per pixel: of the first picture, of every variant, of any
TIMED = 8  # samples: shorter blocks say little about time
LEADING = 3.0  # times the seconds of the best: who is predicted to need no more may still win
MARGIN = 1.15  # times the samples that a target probably needs are rendered, so that few rounds miss it
CHUNK = 0.4  # seconds of one call at most: by so much may a study overrun
ALIKE = {"precision", "fast_math", "triangle_test", "intersector", "plain"}  # knobs that change nothing to be seen


class NothingMeasured(InputError):
    """The study ended before the first picture."""


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
        self.order, self.crew = order, crew
        self.budget = Budget(order.budget, order.spent, order.keep, tell, should_stop)
        self.lanes, self.assistants = Lanes(order, self.budget, first, crew), Assistants(crew, order.bench)
        self.variants, self.base = list(order.variants), order.variants[0]
        self.curves: list[Curve] = []
        self.truths: dict[tuple[str, float], Truth] = {}  # by look-up and resolution
        self.notes: list[str] = []
        self.others = machine.Others()
        self.turn, self.equal_seconds = 0, 0.0

    def run(self) -> Study:
        """Measure.

        Raises:
            InputError: the scene has no light, or what is to be compared cannot be compared with it.
            NothingMeasured: the time was over, or the user had enough, before the first picture.
        """
        try:
            try:
                facts = self.read()
                self.lanes.compile(self.variants)
                order = by_priority(self.variants)
                self.curves = sorted(self.lanes.curves, key=lambda curve: order.index(curve.variant))
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
            self.lanes.close()

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
        self.others.look([os.getpid(), *self.lanes.pids])

    def read(self) -> SceneFacts:
        """Start the first process, read the scene, and leave out what cannot be compared."""
        opening = self.lanes.hire(self.lanes.first)
        self.assistants.hire()
        self.budget.wait_for(opening, "starting")
        self.assistants.hire()  # those that have come since
        self.budget.process_is_ready()
        asked = self.lanes.first.worker.ask("facts", self.base)
        facts = self.budget.wait_for(asked, "reading the scene")
        self.look()
        self.variants, self.notes = comparable(self.variants, facts)
        self.assistants.get_ready(reference_variant(self.base, self.variants), self.order.size)
        return facts

    # ── the references ──

    def render_references(self) -> None:
        """The pictures with which all others are compared."""
        for variant in [curve.variant for curve in self.curves]:
            key = variant.lookup, 1.0
            if key not in self.truths:
                own = reference_variant(variant, self.variants)
                share = FURTHER_SHARE if self.truths else REFERENCE_SHARE
                seconds = min(share * self.order.budget, 0.4 * self.budget.left)
                self.truths[key] = self.reference_of(self.lanes.of.get(own, self.lanes.of[variant]), own, seconds)
            self.truths[variant.lookup, variant.scale] = scaled(self.truths[key], variant.scale)
        self.assistants.close()  # so that nobody disturbs those that are measured

    def reference_of(self, lane: Lane, variant: Variant, seconds: float) -> Truth:
        """A picture by multiple importance sampling, for at most that many seconds, and how far it is off."""
        size, wait_for, end = self.order.size, self.budget.wait_for, self.budget.elapsed + seconds
        shot, per_sample, count = None, math.nan, TIMED
        while shot is None or (shot.error > GOOD_REFERENCE and self.budget.elapsed + CHUNK <= end):
            if shot is not None:
                rest = min(2 * CHUNK, end - self.budget.elapsed)
                count = max(TIMED, int(rest / max(per_sample, 1e-6)) // TIMED * TIMED)
            ask = lane.worker.ask("render", variant, size, count, REFERENCE_SEED if shot is None else None, "variance")
            if not self.truths:
                first = count + (0 if shot is None else shot.samples)
                self.assistants.begin(variant, size, REFERENCE_SEED, first, 2 * CHUNK)
            shot = wait_for(ask, "rendering the reference")
            per_sample = shot.seconds / count
            if parts := self.assistants.parts(wait_for):
                shot = wait_for(lane.worker.ask("add", variant, size, parts), "adding up the reference")
        if math.isnan(shot.error):
            scene = self.order.source.scene
            raise InputError(f"accuracy: no light of {scene} reaches the camera, so that there is no error to measure")
        return Truth(shot.image.astype(np.float64), shot.error, np.nan_to_num(shot.variance), shot.samples)

    # ── measuring ──

    def measure(self) -> None:
        """A round of all variants for each seed, the pictures to be shown, and the rounds of those that may win."""
        while len(self.curves) > 1 and FLOOR * self.seconds_of_all > self.budget.left / 4:
            self.curves.pop()
        begun, seconds = self.budget.elapsed, EVERYBODY * self.budget.left
        planned = min(max(int(seconds / (FLOOR * self.seconds_of_all)), 1), self.order.seeds)
        share = seconds / planned / len(self.curves)
        levels = {curve.variant: power_of_two(share / curve.seconds_per_sample) for curve in self.curves}
        for variant in (v for v in levels if not is_of_the_chart(v, self.base)):
            levels[variant] = min(levels[variant], levels[self.base])  # more could not be compared
        seeds, took = 0, 0.0
        while seeds < planned and took * (seeds + 1) <= seconds * max(seeds, 1):
            self.look()
            seeds += 1
            for wave in waves(self.curves):
                self.round(wave, seeds, levels, begun + seconds * seeds / planned)
            took = self.budget.elapsed - begun
        self.render_pictures()
        half = self.budget.elapsed + self.budget.left / 2
        while found := self.next_one(is_late=self.budget.elapsed > half):
            curve, samples = found
            seeds += 1
            self.round([curve], seeds, {curve.variant: samples})

    def next_one(self, is_late: bool) -> tuple[Curve, int] | None:
        """Who is rendered next, and up to how many samples; None if there is no time for anybody.

        Args:
            is_late: whether those come first that have fewer pictures than were ordered.
        """
        if is_late and any(len(curve.found) < self.order.seeds for curve in self.curves):
            return self.next_with_few()
        return self.next_of_the_race() or self.next_with_few()

    @property
    def seconds_of_all(self) -> float:
        """Seconds of one sample of every variant."""
        return sum(curve.seconds_per_sample for curve in self.curves)

    def round(self, curves: Sequence[Curve], seed: int, samples: dict[Variant, int], end: float = math.inf) -> None:
        """Render variants with one seed, which take turns; compare their pictures at each doubling.

        Args:
            end: seconds of the budget; later than that, no picture gets more than ``FLOOR`` samples.
        """
        levels = {curve.variant: levels_up_to(curve.variant, samples[curve.variant]) for curve in curves}
        for level in sorted({n for own in levels.values() for n in own}):
            if level > FLOOR and self.budget.elapsed > end:
                break
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
        worker = self.lanes.of[variant].worker
        ask = worker.ask("render", variant, self.order.size, samples, seed, wants)
        return self.budget.wait_for(ask, f"{variant.label}: {what}")

    def render_pictures(self) -> None:
        """A picture of each variant after the same time, as long as the best one takes to the second target."""
        own = [c for c in self.curves if not ALIKE & set(c.variant.differences(self.base)) and c.variant.scale == 1]
        share = min(PICTURES_SHARE * self.order.budget, max(0.0, self.budget.left) / 2) / max(1, len(own))
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
                least, fits = 2 * curve.most_samples, min(self.budget.left / curve.seconds_per_sample, MOST_SAMPLES)
                if math.isnan(curve.seconds_to(target)) and fits >= least:
                    return curve, int(min(max(MARGIN * curve.samples_to(target), least), fits)) // 2 * 2
        return None

    def next_with_few(self) -> tuple[Curve, int] | None:
        """Who gets another picture, as large as its largest or as time allows: whoever has the fewest."""
        for curve in sorted(self.curves, key=lambda c: (len(c.found), c.seconds_per_sample)):
            samples = power_of_two(min(curve.most_samples, self.budget.left / curve.seconds_per_sample))
            if samples * curve.seconds_per_sample <= self.budget.left:
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
        compiled, measured = set(self.lanes.of), {curve.variant for curve in curves}
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
        if self.budget.should_stop():
            self.notes.append("The study was interrupted: this is what was measured until then.")
        return Study(
            facts,
            self.order.size,
            self.order.budget,
            min(len(curve.found) for curve in curves),
            curves,
            {v.lookup: self.truths[v.lookup, 1.0] for v in measured},
            equal_seconds=self.equal_seconds,
            reference_bounces=bounces if self.base.is_path else None,
            notes=self.notes,
            seconds=self.budget.elapsed,
            start_seconds=self.budget.start_seconds,
            kernels_made=self.lanes.kernels_made,
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
