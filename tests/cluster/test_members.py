"""Who is there, who fits, and who has which scene: tried with workers that do nothing, and without Dask."""

import json
import socket
import threading
from types import SimpleNamespace

import pytest

import taichi_tracer as tt
from taichi_tracer.cluster import members
from taichi_tracer.cluster.members import TRIES, Cluster, Member, check_answers, last_line, later, local_workers
from taichi_tracer.cluster.versions import installation

SETTINGS = "cpu", "f32", False
THERE = {"backend": "cpu", "precision": "f32", "fast math": "False"}


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


class Parcel:
    """One file of 7 bytes."""

    id, hashes = "a picture", ("abc",)

    def message(self):
        return {"id": self.id}

    def content(self, _wanted):
        return b"content"


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


def test_nobody_there_is_known_at_once():
    with socket.socket() as free:
        free.bind(("127.0.0.1", 0))
        where = f"tcp://127.0.0.1:{free.getsockname()[1]}"
        with pytest.raises(OSError, match="refused"):
            check_answers(where)
        free.listen()
        check_answers(where)


def test_a_worker_that_fits_gets_ready_and_has_the_picture(cluster):
    cluster.prepare(*SETTINGS)
    member = answered(cluster, Answer(installation()))
    assert (member.state, cluster.asked) == ("settling", ["settle"])
    answered(cluster, Answer(THERE))
    assert member.state == "ready"
    member.waiting = None
    facts = json.dumps({"scene": "box", "camera": "here"})
    assert cluster.ready(Parcel(), (0, 0, None), facts) == []
    assert (cluster.asked[-1], cluster.bytes_sent) == ("receive", 7)
    answered(cluster, Answer({"facts": facts, "seconds": 0.5, "pid": 1, "memory": 2}))
    assert cluster.ready(Parcel(), (0, 0, None), facts) == [member]
    assert member.seconds_per_sample == 0.5
    cluster.pieces_for(member, Parcel())
    assert cluster.bytes_sent == 7  # once per worker


def test_what_differs_is_left_out_by_name(cluster):
    cluster.prepare(*SETTINGS)
    member = answered(cluster, Answer(installation() | {"Taichi": "1.6.0"}))
    assert (member.state, cluster.asked) == ("refused", [])
    assert cluster.lines[0].startswith("worker tcp://a:1 is left out: Taichi 1.6.0 there, ")


def test_another_precision_and_another_picture_are_left_out_by_name(cluster):
    cluster.prepare(*SETTINGS)
    answered(cluster, Answer(installation()), Answer(THERE | {"precision": "f64"}))
    assert cluster.lines == ["worker tcp://a:1 is left out: precision f64 there, f32 here"]
    (member,) = cluster.members.values()
    member.state, member.asked = "ready", (Parcel(), (0, 0, None), json.dumps({"scene": "box", "camera": "here"}))
    answered(cluster, Answer({"facts": json.dumps({"scene": "box", "camera": "there"}), "seconds": 1.0}))
    assert cluster.lines[1].endswith("it has another camera than this machine")


def test_a_process_that_ends_is_started_again_and_at_last_left_out(cluster):
    cluster.prepare(*SETTINGS)
    member = answered(cluster, Answer(installation()), *[Answer(error=RuntimeError("gone"))] * (TRIES - 1))
    assert member.state == "settling"
    assert cluster.asked == ["settle"] * TRIES
    answered(cluster, Answer(error=RuntimeError("gone")))
    assert cluster.lines == [f"worker tcp://a:1 is left out: it failed {TRIES} times: gone"]


@pytest.mark.parametrize(
    ("error", "told"),
    [
        (tt.InputError("/scratch: the disk is full"), "/scratch: the disk is full"),
        (ImportError("No module named 'taichi_tracer'"), "it has no taichi_tracer that can do this"),
    ],
)
def test_what_cannot_be_mended_is_told_at_once(cluster, error, told):
    cluster.prepare(*SETTINGS)
    answered(cluster, Answer(installation()), Answer(error=error))
    assert told in cluster.lines[0]


def test_what_was_lost_on_the_way_is_asked_for_again(cluster):
    answered(cluster, Answer(status="cancelled"))
    assert cluster.asked == ["introduce"]


def test_a_study_needs_no_process_before_it_hires_one(cluster):
    member = answered(cluster, Answer(installation()))
    assert (member.state, cluster.asked) == ("ready", [])
    cluster.prepare(*SETTINGS)  # a picture follows on the same connection
    assert (member.state, cluster.asked) == ("settling", ["settle"])


def test_a_call_that_never_returns_holds_nobody_up():
    assert later(lambda: 3).result(10) == 3
    with pytest.raises(ZeroDivisionError):
        later(lambda: 1 / 0).result(10)
    with pytest.raises(members.FutureTimeout):
        later(threading.Event().wait).result(0.01)


def test_of_a_traceback_the_last_line_is_told():
    assert last_line(RuntimeError("Traceback\n  File\nValueError: no\n")) == "ValueError: no"
    assert last_line(KeyError()) == "KeyError"
