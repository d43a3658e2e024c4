"""The clock of a study: it ends in time for what comes afterwards."""

from types import SimpleNamespace

import pytest

from taichi_tracer.studies import budget
from taichi_tracer.studies.source import Order, Source


@pytest.fixture
def clock(monkeypatch):
    now = SimpleNamespace(seconds=0.0)
    monkeypatch.setattr(budget, "time", SimpleNamespace(perf_counter=lambda: now.seconds))
    return now


def made(stop=lambda: False, **more):
    return budget.Budget(Order(Source("cube"), (), (8, 8), 60.0, 3, spent=1.0, **{"keep": 2.0} | more), print, stop)


def test_what_the_caller_does_afterwards_is_kept_for_it(clock):
    study = made()
    assert study.left == pytest.approx(60 - 1 - 1.8)  # 3 % to end the processes
    clock.seconds = 2.0
    study.process_is_ready()
    assert study.start_seconds == 3.0
    assert study.left == pytest.approx(60 - 3 - 1.8 - 2 * 3)


def test_a_slow_start_takes_no_more_than_a_share_of_the_budget(clock):
    study = made()
    clock.seconds = 20.0
    study.process_is_ready()
    assert study.left == pytest.approx(60 - 21 - 1.8 - 0.2 * 60)


def test_it_ends_when_its_time_is_over(clock):
    study = made(keep=0.0)
    clock.seconds = 57.0
    study.say("rendering")
    clock.seconds = 57.5
    with pytest.raises(budget.Stopped):
        study.say("rendering")


def test_the_user_can_stop_at_any_time(clock):
    with pytest.raises(budget.Stopped):
        made(stop=lambda: True).say("starting")
