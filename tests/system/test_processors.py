"""What other programs take of the machine is noticed, and little of it is not told."""

import os

import pytest

from taichi_tracer.system import processors


def test_what_others_take_is_what_is_not_ours(monkeypatch):
    busy, own, clock = iter([100.0, 130.0, 140.0]), iter([10.0, 25.0, 35.0]), iter([0.0, 10.0, 20.0])
    monkeypatch.setattr(processors, "busy_seconds", lambda: next(busy))
    monkeypatch.setattr(processors, "own_seconds", lambda _pids: next(own))
    monkeypatch.setattr(processors.time, "perf_counter", lambda: next(clock))
    looks = processors.Others()
    for _ in range(3):
        looks.look([1])
    monkeypatch.setattr(processors.os, "cpu_count", lambda: 2)
    assert looks.told().startswith("Other programs used 0.8 of the 2 processors on average, and 1.5 at most: on an")


def test_a_sentence_only_where_it_matters(monkeypatch):
    monkeypatch.setattr(processors.os, "cpu_count", lambda: 2)
    assert processors.Others([(0.0, 1.0), (10.0, 3.0)]).told() is None
    assert processors.Others([(0.0, 1.0)]).told() is None


@pytest.mark.skipif(not os.path.exists("/proc/stat"), reason="only Linux tells")
def test_the_system_is_read():
    assert processors.busy_seconds() > processors.own_seconds([os.getpid()]) > 0
    assert processors.own_seconds([2**30]) == 0


def test_a_system_that_tells_nothing_is_not_asked(monkeypatch):
    monkeypatch.setattr(processors, "busy_seconds", lambda: None)
    looks = processors.Others()
    looks.look([])
    assert looks.told() is None
