"""Ranges of a study's reference that other workers render have no gaps, whoever fails."""

from concurrent.futures import Future

import pytest

import taichi_tracer as tt
from taichi_tracer.cluster.helpers import Helpers
from taichi_tracer.studies.bench import Prepared
from taichi_tracer.studies.source import Source
from taichi_tracer.studies.variants import Variant
from taichi_tracer.system.processes import WorkerDied


class Machine:
    """A machine that takes so many seconds for a sample."""

    def __init__(self, seconds, error=None, is_ready=True):
        self.seconds, self.error, self.is_ready, self.ranges, self.is_closed = seconds, error, is_ready, [], False

    def ask(self, method, *words):
        future = Future()
        if method == "prepare" and self.is_ready:
            future.set_result(Prepared(1.0, 3, 1.0, self.seconds))
        elif method == "take":
            *_, first, count = words
            self.ranges.append((first, first + count))
            future.set_exception(self.error) if self.error else future.set_result({"from": first})
        return future

    def close(self):
        self.is_closed = True


def helpers_of(*machines):
    return Helpers(list(machines), (Source("cube"), "cpu", ()), Variant(), (16, 16))


def round_of(helpers, first):
    helpers.begin(7, first, 0.8)
    return helpers.parts(lambda future, _what: future.result(10))


def test_ranges_follow_each_other_and_have_equal_times():
    machines = Machine(0.1), Machine(0.01), Machine(0.1, is_ready=False)
    helpers = helpers_of(*machines)
    assert round_of(helpers, 8) == [(8, {"from": 8}), (80, {"from": 16})]
    assert [machine.ranges for machine in machines] == [[(8, 16)], [(16, 96)], []]
    assert helpers.told() == "2 other workers rendered 88 samples per pixel of the reference."
    helpers.close()
    assert all(machine.is_closed for machine in machines)
    assert round_of(helpers, 96) == []


def test_after_a_range_that_did_not_come_none_counts_and_who_failed_gets_no_more():
    machines = Machine(0.1), Machine(0.1, WorkerDied("it has gone")), Machine(0.1)
    helpers = helpers_of(*machines)
    assert round_of(helpers, 8) == [(8, {"from": 8})]
    assert round_of(helpers, 24) == [(8, {"from": 24}), (8, {"from": 32})]
    assert machines[1].ranges == [(16, 24)]


def test_an_interruption_passes():
    helpers = helpers_of(Machine(0.1))
    helpers.begin(7, 8, 0.8)

    def stop(_future, _what):
        raise tt.InputError("interrupted")

    with pytest.raises(tt.InputError, match="interrupted"):
        helpers.parts(stop)


def test_without_helpers_the_first_machine_does_it_alone():
    assert round_of(helpers_of(), 8) == []
    assert helpers_of().told() == "It rendered the reference, too."
