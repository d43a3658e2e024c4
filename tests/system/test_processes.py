"""A worker is a process of its own: it answers, tells errors in the words of the package, and ends with its parent."""

import sys
from pathlib import Path

import pytest

import taichi_tracer as tt
from taichi_tracer.system.processes import WorkerDied, WorkerProcess, serve


class Counter:
    """What a worker of this test makes."""

    def __init__(self, first):
        if first < 0:
            raise tt.InputError("a number below 0")
        self.count = first

    def add(self, n):
        print("this must not come between the answers", file=sys.stdout)
        self.count += n
        return self.count


class CountingWorker(WorkerProcess):
    """A ``Counter`` in a process of its own."""

    program = f"import sys; sys.path.insert(0, {str(Path(__file__).parent)!r}); import test_processes as t; t.work()"
    task = "the test"


def work():
    """What the process does."""
    serve(Counter)


def test_a_worker_answers_and_ends():
    worker = CountingWorker(is_heard=False)
    try:
        with pytest.raises(tt.InputError, match="a number below 0"):
            worker.ask("open", -1).result(60)
        worker.ask("open", 2)
        assert [worker.ask("add", n).result(60) for n in (1, 2)] == [3, 5]
        with pytest.raises(RuntimeError, match="has no attribute 'fly'"):
            worker.ask("fly").result(60)
    finally:
        worker.close()
    worker.process.wait(60)
    assert worker.process.returncode == 0


def test_a_worker_that_dies_is_told():
    worker = CountingWorker(is_heard=False)
    worker.process.kill()
    with pytest.raises(WorkerDied, match="a process of the test ended in open"):
        worker.ask("open", 1).result(60)
    worker.close()
