"""A study ends within its budget: tried on a clock of its own, with processes that compile and render nothing."""

import math
from collections import Counter
from concurrent.futures import Future
from types import SimpleNamespace

import numpy as np
import pytest

from taichi_tracer.picture.error_estimate import RelativeError
from taichi_tracer.studies import budget, schedule, variants
from taichi_tracer.studies.bench import Prepared, Shot
from taichi_tracer.studies.source import Order, SceneFacts, Source
from taichi_tracer.system import processors
from taichi_tracer.system.errors import InputError

TRUE = np.ones((16, 16, 3))
SLOWNESS = {"uniform": 20.0, "brdf": 5.0, "environment": 1.3, "mis": 1.0}  # times the error of mis


class World:
    """A clock, and what happens when: it stands still but while somebody waits."""

    def __init__(self, compiling, per_sample=0.008, starting=1.2, endless=None):
        self.now, self.events = 0.0, []
        self.endless = compiling if endless is None else endless
        self.compiling, self.per_sample, self.starting = compiling, per_sample, starting
        self.rendered = Counter()

    def perf_counter(self):
        return self.now

    def wait(self, futures, timeout, return_when=None):
        end = self.now + timeout
        while not any(f.done() for f in futures) and self.events and min(e[0] for e in self.events) <= end:
            self.events.sort(key=lambda event: event[0])
            self.now, future, answer = self.events.pop(0)
            future.set_result(answer)
        done = {f for f in futures if f.done()}
        self.now = self.now if done else end
        return SimpleNamespace(done=done)


class Process:
    """A worker of such a world."""

    pid = 0

    def __init__(self, world):
        self.world, self.free_at, self.closed, self.known, self.samples = world, 0.0, False, set(), 0

    def ask(self, method, *words, **_options):
        future = Future()
        seconds, answer = getattr(self, method)(*words)
        self.free_at = max(self.free_at, self.world.now) + seconds
        self.world.events.append((self.free_at, future, answer))
        return future

    def open(self, *_words):
        return self.world.starting, None

    def facts(self, _variant):
        return 0.4, SceneFacts("box", "box.obj", "a machine", 2, True, 40, 0.4)

    def prepare(self, variant, _size):
        share = 0.5 if variant.film in self.known else 1.0
        self.known.add(variant.film)
        seconds = self.world.endless if variant.precision == "f64" else share * self.world.compiling
        return seconds, Prepared(seconds, 5, seconds, self.world.per_sample)

    def render(self, variant, _size, count, seed, _wants):
        self.samples = count if seed is not None else self.samples + count
        error = self.error_of(variant, self.samples)
        rng = np.random.default_rng(self.samples)
        true = TRUE[: int(16 * variant.scale), : int(16 * variant.scale)]
        noise = rng.normal(size=true.shape)
        image = true + float(error) * noise / math.sqrt((noise**2).mean())
        seconds = count * self.world.per_sample
        self.world.rendered[variant.label] += seconds
        return seconds, Shot(seconds, 0.0, self.samples, image, error, np.full(true.shape, float(error) ** 2))

    def error_of(self, variant, n):
        error = SLOWNESS[variant.estimator] * n ** (-0.7 if variant.sampler != "independent" else -0.5)
        return RelativeError(error, error / 1.1, error * 1.1)

    def close(self):
        self.closed = True


@pytest.fixture
def world_of(monkeypatch):
    """A function that makes a world and puts the schedule into it."""

    def make(**options):
        world = World(**options)
        world.processes = []

        def hired(**_options):
            world.processes.append(Process(world))
            return world.processes[-1]

        monkeypatch.setattr(budget, "time", world)
        monkeypatch.setattr(budget, "wait", world.wait)
        monkeypatch.setattr(schedule, "wait", world.wait)
        monkeypatch.setattr(schedule, "StudyWorker", hired)
        monkeypatch.setattr(processors, "usable", lambda: 2)
        monkeypatch.setattr(processors, "busy_seconds", lambda: None)
        monkeypatch.setattr(schedule, "flip", lambda *_: (0.0, None))
        return world

    return make


def study_in(seconds, **options):
    order = Order(Source("box"), variants.plan(), (16, 16), seconds, 3)
    return schedule.Schedule(order, **options).run()


@pytest.mark.parametrize("compiling", [0.5, 3.0])
@pytest.mark.parametrize("seconds", [8, 20, 45, 60, 120])
def test_a_study_ends_within_a_tenth_of_its_budget(world_of, seconds, compiling):
    world = world_of(compiling=compiling)
    study = study_in(seconds)
    assert study.seconds == pytest.approx(world.now)
    assert 0.9 * seconds <= world.now <= 1.1 * seconds
    assert all(process.closed for process in world.processes)


def test_what_a_short_study_drops_is_named(world_of):
    world_of(compiling=3.0)
    study = study_in(20)
    dropped = [label for note in study.notes for label in note.partition(": ")[2].rstrip(".").split("; ")]
    labels = [curve.variant.label for curve in study.curves]
    assert labels[0] == "mis, niederreiter"
    assert dropped
    assert sorted(labels + dropped) == sorted(variant.label for variant in variants.plan())


def test_a_study_that_cannot_begin_in_time_says_so_and_ends(world_of):
    world = world_of(compiling=30.0)
    with pytest.raises(InputError, match="--budget 5 was over before mis, niederreiter was compiled, .* --budget 20"):
        study_in(5)
    assert world.now < 5.5
    assert all(process.closed for process in world.processes)


def test_an_interrupted_study_has_what_was_done(world_of):
    world = world_of(compiling=1.0)
    study = study_in(60, should_stop=lambda: world.now > 25)
    assert world.now < 26
    assert study.curves
    assert study.notes[-1].startswith("The study was interrupted")
