"""What runs inside a worker of Dask: a process for each session, opened once, and asked for one thing a time."""

from concurrent.futures import Future
from types import SimpleNamespace

import pytest

import taichi_tracer as tt
from taichi_tracer.cluster import worker
from taichi_tracer.cluster.worker import GoneError, Seat, leave, seat_name, seats_of, threads_of
from taichi_tracer.system.processes import WorkerDied


class Child:
    """A process that only notes what it is asked for."""

    def __init__(self, error=None):
        self.calls, self.error, self.is_closed = [], error, False
        self.process = SimpleNamespace(wait=lambda _: None, returncode=-9, poll=lambda: None)

    def ask(self, method, *words, **options):
        self.calls.append((method, words, options))
        future = Future()
        if self.error is not None:
            future.set_exception(self.error)
        else:
            future.set_result(method)
        return future

    def close(self):
        self.is_closed = True

    end = close


def test_a_process_is_opened_once_with_its_folder_and_its_threads():
    seat = Seat("/scratch", 4, Child(), "more")
    assert [seat.ask("settings", "cpu"), seat.ask("render", 1, count=2)] == ["settings", "render"]
    assert seat.child.calls == [
        ("open", ("/scratch", 4, "more"), {}),
        ("settings", ("cpu",), {}),
        ("render", (1,), {"count": 2}),
    ]
    seat.close()
    assert seat.child.is_closed


def test_a_process_that_has_ended_is_told_with_its_code():
    seat = Seat("/scratch", 4, Child(WorkerDied("it ended")))
    with pytest.raises(GoneError, match=r"has ended \(exit code -9\)"):
        seat.ask("render")
    seat.stop_timer()


def test_other_errors_pass():
    seat = Seat("/scratch", 4, Child(tt.InputError("the disk is full")))
    with pytest.raises(tt.InputError, match="the disk is full"):
        seat.ask("receive")
    seat.stop_timer()


def test_a_session_leaves_with_all_its_processes_and_no_others():
    there = SimpleNamespace()
    seats = seats_of(there)
    assert seats_of(there) is seats
    for name in ("one", seat_name("one", 0), seat_name("one", 1), "two"):
        seats[name] = Seat("/scratch", 1, Child())
    first = seats["one/0"]
    leave("one/0", there)
    assert first.child.is_closed
    leave("one", there)
    assert list(seats) == ["two"]
    assert not seats["two"].child.is_closed


def test_a_session_without_a_process_is_told(monkeypatch):
    distributed = pytest.importorskip("distributed")
    monkeypatch.setattr(distributed, "get_worker", SimpleNamespace)
    with pytest.raises(GoneError, match="no process for this session"):
        worker.samples("one", "a picture", [0, 0, None], 0, 4)


def test_a_worker_uses_no_more_processors_than_there_are(monkeypatch):
    monkeypatch.setattr(worker.os, "cpu_count", lambda: 2)
    assert [threads_of(SimpleNamespace(state=SimpleNamespace(nthreads=n))) for n in (1, 2, 64)] == [1, 2, 2]
