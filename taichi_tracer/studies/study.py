"""Error against seconds: every variant of a study is rendered for the same time, over several seeds.

1. Every variant is compiled, in a process for each way in which Taichi runs. The budget begins afterwards.
2. A reference is rendered for a fifth of the budget.
3. In each **round**, every estimator renders one picture with a new seed, all for the same time. It is compared with
   the reference after 1/64, 1/32, … of this time. Other knobs, which are turned alone, get a quarter of the time. So
   whatever else the machine does affects all variants alike.

The error of a picture is the root of the mean square difference of **all** of its pixels to the reference, as a
fraction of the reference's mean; the reference's own error is subtracted. Errors below twice that of the reference
cannot be separated from it, and are left out.

An interval is that of Student's t over the logarithms of the rounds: in 95 of 100 studies it has the true value.
"""

import math
import statistics
import time
from collections.abc import Callable, Sequence
from concurrent.futures import Future, wait
from concurrent.futures.process import BrokenProcessPool
from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np

from taichi_tracer.picture.adaptive import PILOT
from taichi_tracer.picture.metrics import shift_of
from taichi_tracer.studies.variants import Bench, SceneFacts, Shot, Variant, Worker, reference_variant
from taichi_tracer.system.errors import InputError

TARGETS = (0.05, 0.02, 0.01)  # relative RMSE
REFERENCE_SHARE = 0.2  # of the budget: with the usual variants, the reference is three times better than the best one
FURTHER_SHARE = 0.05  # of the budget: each reference of another look-up
KNOB_SHARE = 0.25  # of the time of an estimator: what a variant gets in which another knob is turned
TRIAL_SHARE = 0.05  # of the budget: what all variants render together in the short round that is not counted
HALVINGS = 6  # a picture is compared after 1/2^6 of its time, and whenever that has doubled
REFERENCE_SEED, FIRST_SEED = 1_000_003, 1
FIRST_SAMPLES = 16  # of a reference: they show how long a sample takes
CHUNK = 0.5  # seconds of one call at most
POLL = 0.1  # seconds between two looks at the clock and at the user
STUDENT = (
    math.inf,
    12.71,
    4.30,
    3.18,
    2.78,
    2.57,
    2.45,
    2.36,
    2.31,
    2.26,
)  # 97.5 % of Student's t, by degrees of freedom
SURE_BIAS = 4.0  # z-score: more is no chance

Tell = Callable[[str, float], None]  # is called with what is done, and with the share of the budget that has passed


class Interval(NamedTuple):
    """A positive number, and the ends of its 95 % interval; NaN where it is not known."""

    value: float
    low: float
    high: float


def interval(values: Sequence[float]) -> Interval:
    """The geometric mean of values that were measured independently."""
    if len(values) == 0 or not all(0 < v < math.inf for v in values):
        return Interval(math.nan, math.nan, math.nan)
    logarithms = [math.log(v) for v in values]
    middle, n = statistics.fmean(logarithms), len(values)
    factor = math.inf
    if n > 1:
        factor = math.exp(STUDENT[min(n, len(STUDENT)) - 1] * statistics.stdev(logarithms) / math.sqrt(n))
    value = math.exp(middle)
    return Interval(value, value / factor, value * factor)


class Point(NamedTuple):
    """A picture of one round that was compared: the seconds until then, and its error; NaN where it is too small."""

    samples: int
    seconds: float
    error: float


@dataclass(eq=False)
class Curve:
    """What one variant reached.

    Attributes:
        knob: what differs from the first variant, "" for that one. is_main: whether it is compared over the whole time.
        compile_seconds: until everything was compiled, or loaded where an earlier run had compiled it.
        rounds: the points of each picture. finals: its last image and the variance of its pixels.
        unseen: what light that no sample of the last picture met may add, as a fraction of the mean.
        shift, shift_error, bias: how the mean of all pictures differs from the reference, see ``shift_of``.
    """

    variant: Variant
    label: str
    knob: str
    is_main: bool
    compile_seconds: float
    seconds_per_sample: float = math.nan
    rounds: list[list[Point]] = field(default_factory=list)
    finals: list[tuple[np.ndarray, np.ndarray]] = field(default_factory=list)
    unseen: float = 0.0
    shift: float = 0.0
    shift_error: float = 0.0
    bias: float = math.nan

    def levels(self) -> list[tuple[float, float, float, float]]:
        """(seconds, error, least and largest error of the rounds) wherever pictures were compared."""
        found = []
        for points in zip(*(reversed(one) for one in self.rounds), strict=False):
            errors = [point.error for point in points if point.error > 0]
            if errors:
                found.append(
                    (
                        statistics.median(p.seconds for p in points),
                        math.sqrt(np.square(errors).mean()),
                        min(errors),
                        max(errors),
                    )
                )
        return found[::-1]

    @property
    def samples(self) -> int:
        """Per pixel, of the last picture."""
        return self.rounds[-1][-1].samples

    @property
    def error(self) -> Interval:
        """The error of the last pictures, which all variants have after the same time; NaN if all are too small.

        Pictures whose error is too small to be judged are left out, so that the number is rather too large.
        """
        return interval([points[-1].error for points in self.rounds if points[-1].error > 0])

    @property
    def sample_seconds(self) -> Interval:
        """Seconds of one sample of every pixel."""
        return interval([points[-1].seconds / points[-1].samples for points in self.rounds])

    def seconds_to(self, target: float) -> Interval:
        """Seconds of rendering to a relative error; unknown if a round did not reach it."""
        return interval([crossing(points, target) for points in self.rounds])


def error_after(points: Sequence[Point], seconds: float) -> float:
    """The error of a picture after so many seconds, between two points or beyond the last by their slope."""
    known = [(math.log(p.seconds), math.log(p.error)) for p in points if p.error > 0]
    if len(known) < 2:
        return math.nan
    at = math.log(seconds)
    (x0, y0), (x1, y1) = next(
        (pair for pair in zip(known, known[1:], strict=False) if at <= pair[1][0]), (known[-2], known[-1])
    )
    return math.exp(y0 + (y1 - y0) * (at - x0) / (x1 - x0))


class Change(NamedTuple):
    """What turning a knob changes, as ratios to the first variant.

    Attributes:
        time: of the seconds of one sample. error: of the errors after the same seconds.
    """

    time: Interval
    error: Interval

    @property
    def verdict(self) -> str:
        """Whether that pays."""
        if not (self.error.low > 1 or self.error.high < 1):  # it contains 1, or is not known
            return "no clear difference"
        word = "pays" if self.error.value < 1 else "costs"
        return f"{word}: × {self.error.value**2:.2g} the time to the same error"


def change(base: Curve, other: Curve) -> Change:
    """What a variant changes: pictures of the same round are compared with each other."""
    pairs = list(zip(base.rounds, other.rounds, strict=False))
    times = [b[-1].seconds / b[-1].samples / (a[-1].seconds / a[-1].samples) for a, b in pairs]
    errors = [b[-1].error / error_after(a, b[-1].seconds) for a, b in pairs]
    return Change(interval(times), interval(errors))


def crossing(points: Sequence[Point], target: float) -> float:
    """Seconds until the error of a picture is no more than the target, and stays so; infinite if it is not reached."""
    known = [(math.log(p.error), math.log(p.seconds)) for p in reversed(points) if p.error > 0]
    if not known or known[0][0] > math.log(target):
        return math.inf
    errors, seconds = zip(*known, strict=True)
    return float(np.exp(np.interp(math.log(target), np.maximum.accumulate(errors), seconds)))


class Study:
    """A study, which ``run`` measures.

    Args:
        bench: the scene. variants: the ways to render it; all others are compared with the first one.
        budget: seconds of measuring. seeds: rounds, at least.
        started: when the user pressed the key. tell: called with what is done. should_stop: whether the user ends it.

    Attributes:
        facts: the scene, and the machine. curves: of every variant, the first one first.
        references: look-up → reference. seconds: of measuring.
        start_seconds: until the first process was ready. compiling_seconds: of all variants together.
        notes: what was not compared, and why.
    """

    facts: SceneFacts
    start_seconds: float
    compiling_seconds: float

    def __init__(
        self,
        bench: Bench,
        variants: Sequence[Variant],
        budget: float,
        seeds: int,
        started: float | None = None,
        tell: Tell = lambda what, share: None,
        should_stop: Callable[[], bool] = lambda: False,
    ) -> None:
        bench.check(variants)
        self.bench, self.variants, self.budget, self.seeds = bench, list(variants), budget, seeds
        self.tell, self.should_stop = tell, should_stop
        self.key_pressed = time.perf_counter() if started is None else started
        self.begun, self.seconds = math.inf, 0.0
        self.workers: dict[tuple, Worker] = {}
        self.of_references: dict[str, Variant] = {}  # look-up → what its reference is rendered with
        self.curves: list[Curve] = []
        self.references: dict[str, Shot] = {}
        self.notes: list[str] = []

    @property
    def reference(self) -> Shot:
        """What the first variant is compared with."""
        return self.references[self.curves[0].variant.lookup]

    def reference_of(self, variant: Variant) -> Shot:
        """What the pictures of a variant are compared with."""
        return self.references[variant.lookup].scaled(variant.scale)

    @property
    def equal_seconds(self) -> float:
        """Of rendering, of the last picture of every estimator."""
        return statistics.median(points[-1].seconds for curve in self.main for points in curve.rounds)

    @property
    def main(self) -> list[Curve]:
        """The curves that were rendered for the whole time: of the estimators, or of the only knob that was turned."""
        return [curve for curve in self.curves if curve.is_main]

    def run(self) -> "Study":
        """Measure; if the user interrupts it, what was measured until then is kept.

        Raises:
            InputError: the scene has no light, what is to be compared cannot be compared with it, or nothing was
                measured before the user stopped.
        """
        try:
            self.start()
            self.compile()
            self.begun = time.perf_counter()
            self.render_references()
            self.render_rounds()
        except KeyboardInterrupt:
            self.notes.append("The study was interrupted: this is what was measured until then.")
        finally:
            for worker in self.workers.values():
                worker.close()
        self.seconds = self.elapsed
        self.curves = [curve for curve in self.curves if curve.rounds]
        if not self.curves:
            raise InputError("accuracy: interrupted before the first picture was measured")
        for curve in self.curves:
            reference = self.reference_of(curve.variant)
            truth = reference.image, reference.variance
            curve.shift, curve.shift_error, curve.bias = shift_of(curve.finals, truth, curve.unseen)
        return self

    @property
    def elapsed(self) -> float:
        """Seconds of the budget that are spent."""
        return max(0.0, time.perf_counter() - self.begun)

    def result(self, future: Future, what: str):
        """The result of a call; meanwhile, look at the user."""
        while True:
            self.tell(what, self.elapsed / self.budget)
            if self.should_stop():
                raise KeyboardInterrupt
            if wait([future], timeout=POLL).done:
                try:
                    return future.result()
                except BrokenProcessPool:
                    raise InputError(f"accuracy: a process of the study ended: {what}") from None

    # ── starting and compiling ──

    def start(self) -> None:
        """Start a worker for each way in which Taichi runs; the first one reads the scene."""
        for variant in self.variants:
            if variant.process not in self.workers:
                self.workers[variant.process] = Worker(self.bench)
        base = self.variants[0]
        first = self.workers[base.process]
        self.result(first.ready, "starting")
        self.start_seconds = time.perf_counter() - self.key_pressed
        self.facts = self.result(first.ask("facts", base), "reading the scene")
        if len({v.lamp_choice for v in self.variants}) > 1 and self.facts.lamps == 0:
            raise InputError("accuracy: the scene has no surface with Ke > 0, so that no lamp is chosen")
        if not self.facts.has_environment and len({v.lookup for v in self.variants}) > 1:
            self.variants = [v for v in self.variants if v.lookup == base.lookup]
            self.notes.append("The scene has no environment, so that its look-up was not compared.")

    def compile(self) -> None:
        """Compile every variant: in each worker one after the other."""
        begun, base = time.perf_counter(), self.variants[0]
        knobs = {v.difference(base) for v in self.variants}
        main = {"", "estimator"} if "estimator" in knobs else knobs
        for variant in self.variants:
            self.of_references.setdefault(variant.lookup, reference_variant(variant, self.variants))
        references = [self.workers[v.process].ask("prepare", v) for v in self.of_references.values()]
        calls = [self.workers[variant.process].ask("prepare", variant) for variant in self.variants]
        for call in references:
            self.result(call, "compiling the reference")
        for variant, call in zip(self.variants, calls, strict=True):
            found, knob = self.result(call, f"compiling {len(self.variants)} variants"), variant.difference(base)
            self.curves.append(Curve(variant, self.label(variant), knob, knob in main, found))
        self.compiling_seconds = time.perf_counter() - begun

    def label(self, variant: Variant) -> str:
        """The name of a variant; what "environment" samples are lamps where there is no environment."""
        base, label = self.variants[0], variant.label(self.variants[0])
        knobs = {v.difference(base) for v in self.variants} - {""}
        if variant == base and len(knobs) == 1 and "estimator" not in knobs:  # the knob that the study is about
            label = f"{label}, {base.value_in_words(*knobs)}"
        return label if self.facts.has_environment else label.replace("environment", "environment (lamps)")

    # ── measuring ──

    def render_references(self) -> None:
        """The pictures with which all others are compared: with one sample after the other until the time is over."""
        for lookup, variant in self.of_references.items():
            share = FURTHER_SHARE if self.references else REFERENCE_SHARE
            end = self.elapsed + share * self.budget
            shot = self.render(variant, FIRST_SAMPLES, REFERENCE_SEED, "the reference")
            per_sample = shot.seconds / FIRST_SAMPLES
            while self.elapsed < end:
                count = max(FIRST_SAMPLES, int(min(CHUNK, end - self.elapsed) / per_sample))
                shot = self.render(variant, count, None, "the reference")
            if math.isnan(shot.error):
                raise InputError(
                    f"accuracy: no light of {self.bench.scene} reaches the camera, so that there is no error to measure"
                )
            self.references[lookup] = shot

    def render_rounds(self) -> None:
        """Learn from a short round how long samples and comparisons take, then let all render for the same time."""
        trial, begun, spent = TRIAL_SHARE * self.budget / len(self.curves), self.elapsed, 0.0
        for curve in self.curves:
            shot = self.render(curve.variant, self.first_level(curve), 0, curve.label)
            curve.seconds_per_sample = shot.seconds / shot.samples
            points, _ = self.render_picture(curve, trial, 0)
            spent += shot.seconds + points[-1].seconds
        of_comparing = self.elapsed - begun - spent
        count = sum(1.0 if curve.is_main else KNOB_SHARE for curve in self.curves)
        seconds = max(trial, ((self.budget - self.elapsed) / self.seeds - of_comparing) / count)
        for seed in range(FIRST_SEED, FIRST_SEED + self.seeds):
            for curve in self.curves:
                own = seconds * (1.0 if curve.is_main else KNOB_SHARE)
                points, final = self.render_picture(curve, own, seed)
                curve.rounds.append(points)
                curve.finals.append(final)

    def first_level(self, curve: Curve) -> int:
        """The fewest samples of a picture."""
        return PILOT if curve.variant.adaptive else 1

    def render_picture(self, curve: Curve, seconds: float, seed: int) -> tuple[list[Point], tuple]:
        """One picture of a variant, rendered for so many seconds: compared whenever its time has doubled, and the last.

        How long a sample takes is known better afterwards.
        """
        least = self.first_level(curve)
        levels = {max(least, round(seconds / 2**k / curve.seconds_per_sample)) for k in range(HALVINGS + 1)}
        points, spent, done, reference = [], 0.0, 0, self.reference_of(curve.variant)
        for level in sorted(levels):
            while done < level:
                count = min(level - done, max(least, int(CHUNK / curve.seconds_per_sample)))
                shot = self.render(curve.variant, count, seed if done == 0 else None, f"{curve.label}, seed {seed}")
                done, spent = shot.samples, spent + shot.seconds
            points.append(Point(done, spent, reference.error_of(shot.image)))
        curve.seconds_per_sample = spent / done
        curve.unseen = math.hypot(shot.error.unseen, reference.error.unseen)
        return points, (shot.image.astype(np.float64), shot.variance)

    def render(self, variant: Variant, samples: int, seed: int | None, what: str) -> Shot:
        """Add samples to the picture of a variant; see ``Bench.render``."""
        return self.result(self.workers[variant.process].ask("render", variant, samples, seed), what)
