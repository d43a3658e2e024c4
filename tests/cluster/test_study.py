"""A study on a cluster: one worker measures, and what its processes are asked for; real ones are at the end."""

import threading
from types import SimpleNamespace

import pytest

import taichi_tracer as tt
from taichi_tracer.apps.cli import make_parser
from taichi_tracer.cluster import study
from taichi_tracer.cluster.members import Member
from taichi_tracer.cluster.worker import GoneError
from taichi_tracer.system.errors import IncompleteError
from taichi_tracer.system.processes import WorkerDied

ARGS = ["accuracy", "cornell_box", "--report", "/home/me/secret", "--budget", "60", "--cluster", "tcp://host:8786"]


class Answer:
    """A future of Dask, as the test wants it."""

    def __init__(self, result=None, error=None, comes=True):
        self.value, self.error, self.comes = result, error, comes
        self.status = "finished" if error is None else "error"

    def add_done_callback(self, call):
        if self.comes:
            call(self)

    def done(self):
        return self.comes

    def result(self):
        return self.value

    def exception(self):
        return self.error


@pytest.fixture
def two_machines():
    """Two workers, of which the second one has more threads."""
    found = {address: Member(address, state="ready") for address in ("tcp://a:1", "tcp://b:1")}
    cluster = SimpleNamespace(
        members=found, session="one", is_local=False, is_lost=False, asked=[], look=list, wake=threading.Event()
    )
    cluster.client = SimpleNamespace(nthreads=lambda: {"tcp://a:1": 2, "tcp://b:1": 8}, run=lambda *_words, **_more: 0)
    cluster.answer = Answer("done")

    def submit(function, *words, at):
        cluster.asked.append((function.__name__, at[0], words[1:3]))
        return cluster.answer

    cluster.submit, cluster.pieces_for = submit, lambda member, parcel: []
    return study.ClusterMachines(cluster, make_parser().parse_args(ARGS))


def test_the_worker_with_the_most_threads_measures_and_the_others_help(two_machines):
    first = two_machines.start_worker()
    assert first.ask("open", "a source", "cpu", ()).result(10) == "done"
    second = two_machines.start_worker()  # another process on the same machine
    assert second.ask("facts", "a variant").result(10) == "done"
    two_machines.get_ready((), "a variant", (8, 8))
    (other,) = two_machines.helpers.prepared
    assert two_machines.helpers.prepared[other].result(10) == "done"
    assert [(name, at) for name, at, _ in two_machines.cluster.asked] == [
        ("open_study", "tcp://b:1"),
        ("study", "tcp://b:1"),
        ("open_study", "tcp://a:1"),
        ("study", "tcp://a:1"),
    ]
    assert two_machines.processors == 8
    assert "one worker, tcp://b:1, with 8 threads" in two_machines.told()
    two_machines.end_helping()
    for one in (first, second):
        one.close()


def test_a_shipped_scene_travels_by_name_without_paths_of_the_sender(two_machines):
    assert two_machines.parcel.files == ()
    assert "secret" not in two_machines.parcel.options
    assert "cornell_box" in two_machines.parcel.options


def test_a_worker_that_has_gone_is_told(two_machines):
    two_machines.cluster.answer = Answer(comes=False)
    member = two_machines.cluster.members.pop("tcp://a:1")
    with pytest.raises(WorkerDied, match="the worker tcp://a:1 has gone"):
        two_machines.ask(member, 0, "render", (), {})


@pytest.mark.parametrize(
    ("error", "kind", "told"),
    [
        (GoneError("the process that renders has ended (exit code -9)"), WorkerDied, "exit code -9"),
        (tt.InputError("the scene has no light"), tt.InputError, "no light"),
        (RuntimeError("a traceback"), RuntimeError, "worker tcp://a:1: a traceback"),
    ],
)
def test_what_ends_a_call_is_told_in_its_words(two_machines, error, kind, told):
    two_machines.cluster.answer = Answer(error=error)
    with pytest.raises(kind, match=told):
        two_machines.ask(two_machines.cluster.members["tcp://a:1"], 0, "render", (), {})


def test_a_cluster_without_a_worker_that_fits_ends_the_call(two_machines):
    def look():
        raise IncompleteError("no worker of tcp://host:8786 can be used: Taichi 1.6.0 there, 1.7.4 here")

    two_machines.cluster.look = look
    with pytest.raises(WorkerDied, match=r"Taichi 1\.6\.0 there"):
        two_machines.start_worker().ask("open").result(10)
