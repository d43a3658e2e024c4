"""A study within its budget: what is compiled, what is measured for how long, and what is left out.

1. **Planning.** The first process reads the scene and compiles the first variant; others compile the rest beside it. A
   variant is left out, and named, if its compilation would take the time of the measurement. Each variant renders a
   short trial, from which the plan learns what one of its samples takes and how large its error is.
2. **Rounds.** Every variant is rendered once per seed, each picture with twice as many samples as the one before.
   Variants that differ in one knob take turns, block by block, so that their times can be compared.
3. **Legs.** What is left is spent where the answer is undecided: on the variants that lead, until they have reached the
   errors that are asked for. The first legs come directly after the first round, because they matter most.
"""

import math
import os
import time
from collections.abc import Callable, Iterable, Sequence
from concurrent.futures import FIRST_COMPLETED, Future, wait
from dataclasses import dataclass, field

import numpy as np

from taichi_tracer.picture.adaptive import PILOT
from taichi_tracer.picture.error_estimate import RelativeError
from taichi_tracer.studies import others
from taichi_tracer.studies.assistants import Assistants
from taichi_tracer.studies.bench import Prepared, SceneFacts, Shot, renderer_key
from taichi_tracer.studies.convergence import (
    MIDDLE,
    TARGETS,
    Block,
    Curve,
    Study,
    Truth,
    error_of,
    scaled,
    shift_of,
    unmet_light,
)
from taichi_tracer.studies.crew import Clerk, Crew, Here, Worker, WorkerDied
from taichi_tracer.studies.metrics import flip, rel_mse
from taichi_tracer.studies.variants import MOST_FOR_PLAIN, Source, Variant, comparable, of_questions, reference_variant
from taichi_tracer.system.errors import InputError

REFERENCE_SEED, PICTURE_SEED, LEG_SEEDS = 1_000_003, 2_000_003, 1000  # of legs: those above the last one
# Shares of the budget: until when variants may begin to compile, what the reference takes at most, what all pictures at
# equal time take, and what the rounds leave to the legs.
COMPILE_SHARE, REFERENCE_SHARE, PICTURES_SHARE, LEGS_SHARE = 0.45, 0.08, 0.05, 0.6
ABANDON_SHARE = 0.6  # of the budget: a further process that still compiles then is no longer waited for
NO_TIME_TO_COMPILE = "there was no time to compile them"
FIRST_LEGS = 0.5  # of the time that is left after the first round: for the leaders, until they have reached 2 %
LATER_LEGS = 0.1  # of what is left then: for the legs at the end; the rest is for knobs, whose times need many blocks
FURTHER_REFERENCE = 0.25  # of the time of the first: what every other one gets, since few variants need it
GOOD_REFERENCE = 0.2 * TARGETS[-1]  # a reference need not be better
COLD = 2.5  # times what starting a process takes is what compiling a variant takes, before that is known
FIRST_SAMPLES, FLOOR, MOST_SAMPLES = 2, 16, 1 << 17  # per pixel: of the first picture, of every variant, of any
TIMED = 8  # samples: shorter blocks say little about time
SHORTEST = 0.5  # seconds: in less, nothing can be measured
MOST_OVERRUN = 1.1  # times the budget: later than that, no study ends
SHORT = 20.0  # seconds: with a smaller budget, nothing is compiled beside the first variant
LATE = 1.5  # times its share of a round may pass before a variant that is slower than planned goes no farther
MOST_RESERVE = 0.2, 1.8  # of the budget, and seconds: what the caller gets afterwards is at most the larger one
CHUNK = 0.4  # seconds of one call: a study cannot end within it
KNOB_WEIGHT = 4.0  # a variant that turns a knob beside estimator and sampler gets one part in so many
LEADING = 3.0  # times the seconds of the best: who is predicted to need no more may still win
SURELY, MORE = 1.15, 1.4  # times the samples that a target probably needs; times those of before that are worth it
CLOSING = 0.01, 0.4  # of the budget, and seconds: to end the processes and to make the tables
POLL = 0.1  # seconds between two looks at what the processes do
TOGETHER = 3  # variants: fewer are not worth a second process of the same precision


class NothingMeasured(InputError):
    """The study ended before the first picture."""


class Stopped(Exception):
    """The user has interrupted the study, or its time is over."""


@dataclass
class Lane:
    """A process, and what it compiles, in this order.

    Attributes:
        pending: what it does at the moment.
        seconds: that its last compilation took; NaN before the first.
    """

    worker: Clerk | Here
    waiting: list[Variant]
    pending: Future | None = None
    current: Variant | None = None
    seconds: float = math.nan


@dataclass
class Run:
    """What is known of one variant so far."""

    variant: Variant
    lane: Lane
    prepared: Prepared
    blocks: list[Block] = field(default_factory=list)
    pilots: list[float] = field(default_factory=list)
    found: dict[int, dict[int, tuple[float, RelativeError]]] = field(default_factory=dict)  # seed → samples → errors
    finals: dict[int, tuple[np.ndarray, np.ndarray]] = field(default_factory=dict)  # seed → picture, its variance
    picture: Shot | None = None
    truth: Truth | None = None

    @property
    def per_sample(self) -> float:
        """Seconds of one sample of every pixel, as far as they are known."""
        return self.so_far().seconds_per_sample if self.blocks else self.prepared.seconds

    @property
    def samples(self) -> list[int]:
        """All numbers of samples at which a picture was compared."""
        return sorted({n for levels in self.found.values() for n in levels})

    def so_far(self) -> Curve:
        """The curve of what was measured."""
        samples = self.samples
        pairs = [
            [levels.get(n, (math.nan, math.nan)) for n in samples]
            for levels in (self.found[seed] for seed in sorted(self.found))
        ]
        table = np.array(pairs, float).reshape(len(self.found), len(samples), 2)
        return Curve(
            self.variant,
            self.prepared.compile_seconds,
            np.array(samples),
            table[..., 0],
            table[..., 1],
            self.blocks,
            pilot_seconds=float(np.median(self.pilots)) if self.pilots else 0.0,
            seconds_to_save=self.prepared.seconds_to_save,
        )

    def samples_to(self, target: float) -> float:
        """The number of samples that will probably reach a relative error; that of the next level if it was reached."""
        if not self.found or not self.so_far().mean_errors.size:
            n, error, power = self.prepared.samples, float(self.prepared.error), 0.5
        else:
            curve = self.so_far()
            n, error = int(curve.samples[-1]), float(curve.mean_errors[-1])
            power = min(max(-curve.slope, 0.5), 0.75) if not math.isnan(curve.slope) else 0.5
        if not error > 0:
            return math.inf
        return n * max(error / target, 1e-9) ** (1 / power)


def levels_up_to(variant: Variant, most: int) -> list[int]:
    """The numbers of samples at which pictures are compared: each twice the one before, but for the last."""
    first = PILOT if variant.adaptive else FIRST_SAMPLES
    levels = [first << k for k in range(MOST_SAMPLES.bit_length()) if first << k <= max(most, first)]
    return levels if most <= levels[-1] else [*levels, most]


def allot(runs: Sequence[Run], base: Variant, seconds: float) -> dict[Variant, int]:
    """The number of samples of each variant in a round of so many seconds.

    All begin with ``FLOOR``. Then the one that has taken the least time gets twice as many, as long as there is time
    left; knobs beside estimator and sampler count ``KNOB_WEIGHT`` times, and need no more samples than the first
    variant, with which they are compared. Nobody needs more than the last of the targets.
    """
    chosen = {run.variant: FLOOR for run in runs}
    left = seconds - sum(FLOOR * run.per_sample for run in runs)
    open_runs = list(runs)

    def cost(run: Run) -> float:
        is_main = is_of_the_chart(run.variant, base)
        return chosen[run.variant] * run.per_sample * (1.0 if is_main else KNOB_WEIGHT)

    while open_runs:
        run = min(open_runs, key=cost)
        now = chosen[run.variant]
        is_knob = not is_of_the_chart(run.variant, base)
        is_enough = now >= MOST_SAMPLES or now >= run.samples_to(TARGETS[-1] / 2)
        if now * run.per_sample > left or is_enough or (is_knob and now >= chosen.get(base, MOST_SAMPLES)):
            open_runs.remove(run)
            continue
        chosen[run.variant] = 2 * now
        left -= now * run.per_sample
    return chosen


def waves(runs: Iterable[Run]) -> list[list[Run]]:
    """Groups of variants that can take turns: no two of a group share a film."""
    found: list[list[Run]] = []
    for run in runs:
        key = renderer_key(run.variant)
        free = (w for w in found if all(renderer_key(r.variant) != key for r in w))
        wave = next(free, None)
        if wave is None:
            found.append([run])
        else:
            wave.append(run)
    return found


def is_of_the_chart(variant: Variant, base: Variant) -> bool:
    """Whether a variant differs from another one only in what the chart of curves compares."""
    return set(variant.differences(base)) <= {"estimator", "sampler", *of_questions()}


def by_priority(variants: Sequence[Variant]) -> list[Variant]:
    """The variants, the ones that a short study keeps first: the base, estimators, then knobs, then all samplers."""
    base = variants[0]

    def rank(variant: Variant) -> tuple[int, int]:
        changed = set(variant.differences(base))
        kinds = [set(), {"estimator"}, {"sampler"}, {"estimator", "sampler"}]
        group = (0, 1, 2, 4)[kinds.index(changed)] if changed in kinds else 3
        return 5 if variant.plain else group, variants.index(variant)

    return sorted(variants, key=rank)


class Schedule:
    """A study in progress; ``run`` does it.

    Args:
        spent: seconds of the budget that were spent before.
        keep: what the caller needs of the budget afterwards, as a multiple of what starting a process takes.
        first: a worker that was started before; None starts one, or uses this process for a scene of the caller.
        crew: who renders on other machines; None renders here.
        should_stop: asked after every block; the study then ends with what was measured.
    """

    def __init__(
        self,
        source: Source,
        variants: list[Variant],
        size: tuple[int, int],
        budget: float,
        seeds: int,
        arch: str = "auto",
        parts: tuple[str, ...] = (),
        spent: float = 0.0,
        keep: float = 0.0,
        first: Worker | None = None,
        crew: Crew | None = None,
        tell: Callable[[str, float], None] = lambda what, done: None,
        should_stop: Callable[[], bool] = lambda: False,
    ) -> None:
        self.source, self.arch, self.parts = source, arch, parts
        self.size, self.budget, self.seeds = size, budget, seeds
        self.started = time.perf_counter() - spent
        self.base = variants[0]
        self.variants = variants
        self.tell, self.should_stop = tell, should_stop
        share, least = CLOSING
        self.end, self.keep = self.started + budget - max(share * budget, least), keep
        self.lanes: list[Lane] = []
        self.to_come: dict[tuple, list[Variant]] = {}  # what a process → the variants that it will compile
        self.runs: list[Run] = []
        self.truths: dict[str, Truth] = {}
        self.dropped: dict[str, list[Variant]] = {}
        self.notes: list[str] = []
        self.others = others.Others()
        self.turn = 0
        self.rounds = 0
        self.equal_seconds = 0.0
        self.kernels_made = 0
        self.first, self.crew = first, crew
        self.assistants = Assistants()
        self.is_apart = not source.here
        self.start_seconds = math.nan

    # ── time ──

    @property
    def elapsed(self) -> float:
        """Seconds of the budget that are spent."""
        return time.perf_counter() - self.started

    @property
    def left(self) -> float:
        """Seconds that may still be spent on measuring."""
        return self.end - time.perf_counter()

    def say(self, what: str) -> None:
        """Tell what is done, and stop where the user wants that, or where the time is over."""
        self.tell(what, self.elapsed / self.budget)
        if self.should_stop() or (self.left <= 0 if self.runs else self.is_hopeless):
            raise Stopped

    @property
    def reserve(self) -> float:
        """Seconds that the caller needs afterwards; a slow start of a busy moment makes them no larger than a share."""
        share, seconds = MOST_RESERVE
        return min(self.keep * self.start_seconds, max(share * self.budget, seconds))

    @property
    def is_hopeless(self) -> bool:
        """Whether nothing could be measured and written any more, even if the first variant were compiled now."""
        reserve = 0.0 if math.isnan(self.start_seconds) else self.reserve
        return self.elapsed + reserve + SHORTEST > MOST_OVERRUN * self.budget

    def pids(self) -> list[int]:
        """The processes of the study, this one included."""
        return [os.getpid(), *(lane.worker.pid for lane in self.lanes if lane.worker.pid)]

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
                self.others.look(self.pids())
                self.measure()
            except Stopped:
                pass
            except WorkerDied as error:
                if not any(run.found for run in self.runs):
                    raise NothingMeasured(f"accuracy: {error}, before anything was measured") from None
                self.notes.append(f"The study ended early, because {error}: this is what was measured until then.")
            self.others.look(self.pids())
            if not any(run.found for run in self.runs):
                raise NothingMeasured(self.why_nothing())
            return self.study(facts)
        finally:
            self.assistants.close()
            for worker in (*(lane.worker for lane in self.lanes), *([] if self.first is None else [self.first])):
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
        worker = self.hire(self.base)
        self.tell("starting", self.elapsed / self.budget)
        opening = worker.ask("open", self.source, self.arch, self.parts)
        self.assistants.hire(self.crew, self.source, self.arch, self.parts)
        self.wait_for(opening, "starting")
        self.assistants.hire(self.crew, self.source, self.arch, self.parts)  # those that have come since
        self.start_seconds = self.elapsed
        self.end -= self.reserve
        facts = self.wait_for(worker.ask("facts", self.base), "reading the scene")
        self.others.look(self.pids())
        if facts.primitives > MOST_FOR_PLAIN:
            kept = [v for v in self.variants if not v.plain]
            if len(kept) < len(self.variants):
                self.notes.append(
                    f"The plain forms are left out, because the scene has more than {MOST_FOR_PLAIN:,} primitives."
                )
                self.variants = kept
        self.variants, notes = comparable(self.variants, facts.lamps, facts.has_environment, facts.source)
        self.notes += notes
        self.assistants.get_ready(self.reference, self.size)
        return facts

    @property
    def reference(self) -> Variant:
        """What the reference of the first variant is rendered with."""
        return reference_variant(self.base, self.variants)

    def wait_for(self, future: Future, what: str):
        """The result of a call; meanwhile, look at the clock and at the user."""
        while True:
            self.say(what)
            done, _ = wait([future], timeout=POLL)
            if done:
                return future.result()

    def hire(self, variant: Variant) -> "Clerk | Here":
        """A process, or this one."""
        worker: Clerk | Here
        if not self.is_apart:
            worker = Here()
        elif self.crew is not None:
            worker = self.crew.hire()
        elif self.first is not None:
            worker, self.first = self.first, None
        else:
            worker = Worker(is_heard=not self.lanes)
        self.lanes.append(Lane(worker, [variant]))
        return worker

    # ── compiling, and the references ──

    def compile(self) -> None:
        """Compile the variants, in several processes; render the references beside that."""
        self.assign()
        while True:
            for lane in self.lanes:
                if lane.pending is None:
                    self.next_of(lane)
            self.hire_next()
            busy = [lane for lane in self.lanes if lane.pending is not None]
            if not busy:
                break
            wait([lane.pending for lane in busy], timeout=POLL, return_when=FIRST_COMPLETED)
            labels = ", ".join(lane.current.label for lane in busy if lane.current is not None)
            self.say(f"compiling {labels}")
            for lane in busy:
                if lane.pending.done():
                    self.finish(lane)
                elif lane is not self.lanes[0] and self.elapsed > ABANDON_SHARE * self.budget:
                    self.abandon(lane)
        self.render_references()

    def assign(self) -> None:
        """Give every variant to a process: the first one has what has the first film; each precision has its own."""
        order = by_priority(self.variants)
        first = self.lanes[0]
        first.waiting = []
        same = [v for v in order if mode(v) == mode(self.base) and renderer_key(v) != renderer_key(self.base)]
        for variant in order:
            is_first = renderer_key(variant) == renderer_key(self.base)
            is_alike = mode(variant) == mode(self.base) and len(same) < TOGETHER
            if is_first or is_alike or not self.is_apart:
                first.waiting.append(variant)
            else:
                self.to_come.setdefault((*mode(variant), variant.plain), []).append(variant)

    def hire_next(self) -> None:
        """Start another process, if a processor is free for it, and if there is time."""
        if self.budget < SHORT and not self.runs:
            return
        while self.to_come and sum(lane.pending is not None for lane in self.lanes) < self.processors:
            variants = self.to_come.pop(next(iter(self.to_come)))
            if self.elapsed + self.start_seconds + self.expected / 2 > COMPILE_SHARE * self.budget:
                self.drop(NO_TIME_TO_COMPILE, *variants)
                continue
            worker = self.hire(variants[0])
            self.lanes[-1].waiting = variants
            self.lanes[-1].pending = worker.ask("open", self.source, self.arch, self.parts)

    @property
    def processors(self) -> int:
        """How many the machine has that measures."""
        return processors() if self.crew is None else self.crew.processors

    @property
    def expected(self) -> float:
        """Seconds that the first variant of a process probably compiles: as long as that of the first process."""
        return self.runs[0].prepared.compile_seconds if self.runs else COLD * self.start_seconds

    def next_of(self, lane: Lane) -> None:
        """Let a process compile its next variant, or drop what it will not be able to compile in time."""
        if not lane.waiting:
            return
        expected = self.expected if math.isnan(lane.seconds) else lane.seconds
        if self.runs and self.elapsed + expected / 2 > COMPILE_SHARE * self.budget:
            self.drop(NO_TIME_TO_COMPILE, *lane.waiting)
            lane.waiting = []
            return
        lane.current = lane.waiting.pop(0)
        lane.pending = lane.worker.ask("prepare", lane.current, self.size)

    def finish(self, lane: Lane) -> None:
        """Take what a process has compiled."""
        result = lane.pending.result()
        lane.pending, variant, lane.current = None, lane.current, None
        if isinstance(result, Prepared):
            lane.seconds = result.compile_seconds
            self.kernels_made += result.new_kernels
            if not self.runs:
                self.end = max(self.end, time.perf_counter() + SHORTEST)
            self.runs.append(Run(variant, lane, result))

    def abandon(self, lane: Lane) -> None:
        """Wait no longer for a process; it finishes the kernel that it compiles, which is kept for the next run."""
        self.drop(NO_TIME_TO_COMPILE, *([] if lane.current is None else [lane.current]), *lane.waiting)
        self.lanes.remove(lane)
        lane.worker.close()
        for run in [run for run in self.runs if run.lane is lane]:
            self.runs.remove(run)
            self.drop(NO_TIME_TO_COMPILE, run.variant)

    def drop(self, why: str, *variants: Variant) -> None:
        """Leave variants out, and remember why."""
        self.dropped.setdefault(why, []).extend(variants)

    def render_references(self) -> None:
        """The pictures with which all others are compared."""
        self.runs.sort(key=lambda run: by_priority(self.variants).index(run.variant))
        for run in self.runs:
            lookup = run.variant.lookup
            if lookup not in self.truths:
                own = reference_variant(run.variant, self.variants)
                lane = next((r.lane for r in self.runs if r.variant == own), run.lane)
                share = REFERENCE_SHARE * (FURTHER_REFERENCE if self.truths else 1.0)
                seconds = min(share * self.budget, 0.4 * self.left)
                self.truths[lookup] = self.reference_of(lane, own, seconds)
            run.truth = scaled(self.truths[lookup], run.variant.scale)
        self.assistants.close()  # so that nobody disturbs those that are measured

    def reference_of(self, lane: Lane, variant: Variant, seconds: float) -> Truth:
        """A picture by multiple importance sampling, for at most that many seconds, and how far it is off."""
        start, per_sample = time.perf_counter(), math.nan
        shot, count = None, TIMED
        while True:
            seed = REFERENCE_SEED if shot is None else None
            ask = lane.worker.ask("render", variant, self.size, count, seed, "variance")
            first = count + (0 if shot is None else shot.samples)
            if variant == self.reference:
                self.assistants.begin(variant, self.size, REFERENCE_SEED, first, 2 * CHUNK)
            shot = self.wait_for(ask, "rendering the reference")
            per_sample = shot.seconds / count
            parts = self.assistants.parts(self.wait_for)
            if parts:
                shot = self.wait_for(lane.worker.ask("add", variant, self.size, parts), "adding up the reference")
            is_good = shot.error <= GOOD_REFERENCE
            if is_good or time.perf_counter() - start + CHUNK > seconds:
                break
            rest = seconds - (time.perf_counter() - start)
            count = max(TIMED, int(min(CHUNK * 2, rest) / max(per_sample, 1e-6)) // TIMED * TIMED)
        if math.isnan(shot.error):
            raise InputError(
                f"accuracy: no light of {self.source.scene} reaches the camera, so that there is no error to measure"
            )
        return Truth(shot.image.astype(np.float64), shot.error, np.nan_to_num(shot.variance), shot.samples)

    # ── measuring ──

    def measure(self) -> None:
        """A round, pictures at equal time, the leaders to the errors that matter; more rounds, and what is open."""
        self.fit()
        for seed in range(1, self.seeds + 1):
            share = 1 - (LEGS_SHARE if seed == 1 else LATER_LEGS)
            seconds = self.left * share / (self.seeds + 1 - seed)
            if seed > 1 and sum(FLOOR * run.per_sample for run in self.runs) > seconds:
                break
            self.round(seed, allot(self.runs, self.base, seconds), seconds)
            self.others.look(self.pids())
            if seed == 1:
                self.render_pictures()
                self.run_legs(FIRST_LEGS * self.left, to_targets=True)
                self.others.look(self.pids())
        self.run_legs(math.inf)

    def fit(self) -> None:
        """Leave out the last variants until one round of the rest fits into half of the time."""
        while len(self.runs) > 1 and sum(2 * FLOOR * run.per_sample for run in self.runs) > self.left / 2:
            self.drop("there was no time to measure them", self.runs.pop().variant)

    def round(self, seed: int, chosen: dict[Variant, int], seconds: float) -> None:
        """Render every variant with one seed, up to its number of samples; who is slower than planned ends sooner."""
        end = time.perf_counter() + seconds
        groups = waves(self.runs)
        costs = [sum(chosen[run.variant] * run.per_sample for run in wave) for wave in groups]
        for i, wave in enumerate(groups):
            share = costs[i] / sum(costs[i:])
            now = time.perf_counter()
            self.together(wave, seed, chosen, now + LATE * share * max(0.0, end - now))
        self.rounds = seed

    def together(self, runs: Sequence[Run], seed: int, chosen: dict[Variant, int], end: float = math.inf) -> None:
        """Render variants with one seed, which take turns; later than ``end``, none goes beyond ``FLOOR``."""
        done = dict.fromkeys((run.variant for run in runs), 0)
        levels = {run.variant: levels_up_to(run.variant, chosen[run.variant]) for run in runs}
        for level in sorted({n for own in levels.values() for n in own}):
            if level > FLOOR and time.perf_counter() > end:
                break
            self.turn += 1
            for run in runs:
                if level in levels[run.variant]:
                    self.advance(run, seed, done[run.variant], level)
                    done[run.variant] = level

    def advance(self, run: Run, seed: int, done: int, level: int) -> None:
        """Bring a picture from ``done`` samples to ``level``, in calls that are short, and compare it."""
        seconds, begun = 0.0, done
        while done < level:
            fits = max(1, int(CHUNK / max(run.per_sample, 1e-9)))
            count = min(level - done, fits)
            wants = "" if done + count < level else "variance" if level >= FLOOR else "image"
            new = seed if done == 0 else None
            ask = run.lane.worker.ask("render", run.variant, self.size, count, new, wants)
            shot: Shot = self.wait_for(ask, f"{run.variant.label}: seed {seed}, {level} samples")
            seconds, done = seconds + shot.seconds, done + count
            if shot.pilot_seconds > 0:
                run.pilots.append(shot.pilot_seconds)
        if level - begun >= TIMED or (level >= TIMED and begun == 0):
            run.blocks.append(Block(self.turn, level - begun, seconds))
        error = error_of(shot.image, shot.error, run.truth)
        run.found.setdefault(seed, {})[level] = (error, shot.error)
        if shot.variance is not None:
            run.finals[seed] = shot.image.astype(np.float64), shot.variance

    def shown(self) -> list[Run]:
        """The variants whose pictures can be told apart, and are shown."""
        alike = ("precision", "fast_math", "triangle_test", "intersector", "plain")
        return [r for r in self.runs if not set(r.variant.differences(self.base)) & set(alike) and r.variant.scale == 1]

    def render_pictures(self) -> None:
        """A picture of each variant after the same time, as long as the best one takes to the second target."""
        runs = self.shown()
        share = min(PICTURES_SHARE * self.budget, max(0.0, self.left) / 2) / max(1, len(runs))
        best = min((run.samples_to(TARGETS[1]) * run.per_sample for run in runs), default=share)
        self.equal_seconds = min(share, best)
        for run in runs:
            count = max(PILOT if run.variant.adaptive else FIRST_SAMPLES, round(self.equal_seconds / run.per_sample))
            ask = run.lane.worker.ask("render", run.variant, self.size, count, PICTURE_SEED, "image")
            run.picture = self.wait_for(ask, f"{run.variant.label}: a picture")

    def run_legs(self, seconds: float, to_targets: bool = False) -> None:
        """Spend so many seconds where the answer is undecided; whoever is nearest to an answer comes first.

        Args:
            to_targets: end when the leaders have reached ``MIDDLE``.
        """
        end = time.perf_counter() + seconds
        while True:
            left = min(self.left, end - time.perf_counter())
            leg = next_leg(self.runs, self.base, left, TARGETS[1:3] if to_targets else TARGETS[1:], not to_targets)
            if leg is None:
                break
            run, samples = leg
            self.turn += 1
            self.together([run], max([LEG_SEEDS, *run.found]) + 1, {run.variant: samples})

    # ── what was found ──

    def study(self, facts: SceneFacts) -> Study:
        """Everything that was measured."""
        study = Study(
            facts.title, self.size, facts.machine, max(1, self.rounds), self.equal_seconds,
            budget=self.budget, start_seconds=self.start_seconds, read_seconds=facts.read_seconds,
            kernels_made=self.kernels_made, notes=self.notes,
        )  # fmt: skip
        most = max(v.max_bounces for v in self.variants)
        study.reference_bounces = most if self.base.is_path else None
        for run in sorted((r for r in self.runs if r.found), key=lambda r: self.variants.index(r.variant)):
            study.curves.append(curve_of(run, most))
        used = {curve.variant.lookup for curve in study.curves}
        study.references = {lookup: truth.image for lookup, truth in self.truths.items() if lookup in used}
        first = self.truths[study.curves[0].variant.lookup]
        study.reference_error, study.reference_samples = first.error, first.samples
        for why, variants in self.dropped.items():
            study.notes.append(f"Not compared, because {why}: {'; '.join(v.label for v in variants)}.")
        if self.crew is None:
            study.others = others.told(self.others.processors, self.others.most)
        else:
            study.notes.append(f"{self.crew.told()} {self.assistants.told()}")
        if self.should_stop():
            study.notes.append("The study was interrupted: this is what was measured until then.")
        study.seconds = self.elapsed
        return study


def curve_of(run: Run, most: int) -> Curve:
    """The curve of a variant, with what its pictures say about bias, and its picture at equal time."""
    curve, truth = run.so_far(), run.truth
    if not curve.blocks:
        curve.blocks = [Block(0, run.prepared.samples, run.prepared.samples * run.prepared.seconds)]
    curve.reference_mean = truth.mean
    curve.is_biased = run.variant.is_path and run.variant.max_bounces < most
    curve.unseen = max(
        (getattr(e, "unseen", 0.0) for levels in run.found.values() for _, e in list(levels.values())[-1:])
    )
    if run.finals:
        finals = list(run.finals.values())
        curve.shift, curve.shift_error, curve.bias = shift_of(finals, truth, curve.unseen)
        if not curve.is_biased:
            curve.unmet = unmet_light(np.mean([image for image, _ in finals], axis=0), truth.image)
        if curve.unmet is not None:
            curve.bias = math.nan
    if run.picture is not None:
        curve.image, curve.image_samples = run.picture.image, run.picture.samples
        curve.image_error = truth.error_of(curve.image)
        curve.image_rel_mse, curve.image_flip = rel_mse(curve.image, truth.image), flip(curve.image, truth.image)[0]
    return curve


def next_leg(
    runs: Sequence[Run], base: Variant, left: float, targets: Sequence[float] = TARGETS[1:], fills: bool = True
) -> tuple[Run, int] | None:
    """The variant that is rendered with another seed, and up to how many samples; None if there is no time for any.

    First those that may win go to the targets that they have not reached, as far as there is time. Then those that have
    the fewest pictures get another one, if ``fills``.
    """
    main = [run for run in runs if is_of_the_chart(run.variant, base) and run.truth is not None]
    forecast = {id(run): run.samples_to(MIDDLE) * run.per_sample for run in main}
    best = min(forecast.values(), default=math.inf)
    leading = sorted((r for r in main if forecast[id(r)] <= LEADING * best), key=lambda r: forecast[id(r)])
    for target in targets:
        for run in leading:
            if not math.isnan(run.so_far().seconds_to(target)) or not run.samples:
                continue
            fits = int(left / run.per_sample)
            least = MORE * run.samples[-1]
            level = min(max(run.samples_to(target) * SURELY, least), fits, MOST_SAMPLES)
            if level >= least:
                return run, int(level) // 2 * 2
    known = [run for run in runs if run.samples] if fills else []
    for run in sorted(known, key=lambda r: (len(r.found), id(r) not in {id(x) for x in leading}, r.per_sample)):
        level = run.samples[-1]
        while level > FLOOR and level * run.per_sample > left:
            level //= 2
        if level * run.per_sample <= left:
            return run, level
    return None


def mode(variant: Variant) -> tuple[str, bool]:
    """What a process has only one of."""
    return variant.precision, variant.fast_math


def processors() -> int:
    """How many this process may use."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


def measure(source: Source, variants: list[Variant], size: tuple[int, int], budget: float, seeds: int, **more) -> Study:
    """Render every variant within the budget; arguments as for ``Schedule``."""
    source.check(variants)
    return Schedule(source, variants, size, budget, seeds, **more).run()
