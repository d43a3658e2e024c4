"""What other programs take of the machine is noticed, and little of it is not told."""

import os

import pytest

from taichi_tracer.studies import others


def test_what_others_take_is_what_is_not_ours(monkeypatch):
    busy, own, clock = iter([100.0, 130.0, 140.0]), iter([10.0, 25.0, 35.0]), iter([0.0, 10.0, 20.0])
    monkeypatch.setattr(others, "busy_seconds", lambda: next(busy))
    monkeypatch.setattr(others, "own_seconds", lambda _pids: next(own))
    monkeypatch.setattr(others.time, "perf_counter", lambda: next(clock))
    looks = others.Others()
    for _ in range(3):
        looks.look([1])
    assert looks.shares == [pytest.approx(1.5), pytest.approx(0.0)]
    assert (looks.processors, looks.most) == (pytest.approx(0.75), pytest.approx(1.5))


def test_a_sentence_only_where_it_matters(monkeypatch):
    monkeypatch.setattr(others.os, "cpu_count", lambda: 2)
    assert others.told(0.1, 0.2) is None
    assert others.told(0.4, 1.0).startswith("Other programs used 0.4 of the 2 processors on average, and 1.0 at most")


@pytest.mark.skipif(not os.path.exists("/proc/stat"), reason="only Linux tells")
def test_the_system_is_read():
    assert others.busy_seconds() > others.own_seconds([os.getpid()]) > 0
    assert others.own_seconds([2**30]) == 0


def test_a_system_that_tells_nothing_is_not_asked(monkeypatch):
    monkeypatch.setattr(others, "busy_seconds", lambda: None)
    looks = others.Others()
    looks.look([])
    assert (looks.processors, looks.most) == (0.0, 0.0)
