"""Who is there, who fits, and who has which scene: tried with workers that do nothing, and without Dask."""

import threading
from types import SimpleNamespace

import pytest

import taichi_tracer as tt
from taichi_tracer.cluster.members import Cluster, Member, local_workers


class Answer:
    """A future of Dask that is done."""

    def __init__(self, result=None, error=None, status=None):
        self.value, self.error = result, error
        self.status = status or ("finished" if error is None else "error")

    def done(self):
        return True

    def result(self):
        return self.value

    def exception(self):
        return self.error


@pytest.fixture
def cluster():
    """A connection to one worker, whose questions are noted and answered by the test."""
    made = Cluster.__new__(Cluster)
    made.where, made.is_local, made.session = "tcp://host:8786", False, "0123456789"
    made.members, made.pieces, made.reasons, made.lines, made.asked = {}, {}, [], [], []
    made.settings, made.wanted, made.bytes_sent, made.wake = None, {}, 0, threading.Event()
    made.tell = made.lines.append
    made.client = SimpleNamespace(scatter=lambda one, workers: {key: Answer(key) for key in one})

    def submit(function, *words, at, priority=0):
        made.asked.append(function.__name__)
        return

    made.submit = submit
    made.members["tcp://a:1"] = Member("tcp://a:1")
    return made


def answered(cluster, *answers):
    """The worker gives these answers, one after the other."""
    (member,) = cluster.members.values()
    for answer in answers:
        member.waiting = answer
        cluster.advance(member)
    return member


@pytest.mark.parametrize(
    ("where", "count"), [("local", 1), ("local:3", 3), ("tcp://10.0.0.1:8786", None), ("tls://[::1]:8786", None)]
)
def test_addresses(where, count):
    assert local_workers(where) == count


@pytest.mark.parametrize(
    "where", ["", "local:", "local:x", "local:0", "host:8786", "tcp://host", "http://host:1", "tcp://host:70000"]
)
def test_what_is_no_address_is_told_with_what_would_be_one(where):
    with pytest.raises(tt.InputError, match="local:"):
        local_workers(where)
