"""Every moment belongs to exactly one stage, and nothing happens while no stopwatch runs."""

import pytest

from taichi_tracer.system import stopwatch
from taichi_tracer.system.stopwatch import BUILD, IMPORTS, OTHER, READ, SAMPLES, STAGES, stage


@pytest.fixture
def clock(monkeypatch):
    """A clock that stands still until its value is changed."""
    now = [10.0]
    monkeypatch.setattr(stopwatch, "perf_counter", lambda: now[0])
    yield now
    stopwatch.stop()


def test_an_inner_part_does_not_count_for_the_outer_one(clock):
    watch = stopwatch.start(started=8.5)
    clock[0] = 11.0
    with stage(READ):
        clock[0] = 12.0
        with stage(BUILD):
            clock[0] = 14.0
        clock[0] = 14.5
    clock[0] = 17.5
    stopwatch.stop()
    assert watch.seconds == dict.fromkeys(STAGES, 0.0) | {IMPORTS: 1.5, READ: 1.5, BUILD: 2.0, OTHER: 4.0}
    assert sum(watch.seconds.values()) == watch.total == 9.0
    assert (watch.times[READ], watch.times[BUILD], watch.times[SAMPLES]) == (1, 1, 0)
