"""Who renders a study answers, in this process or in another one."""

import pytest

import taichi_tracer as tt
from taichi_tracer.studies.source import Source
from taichi_tracer.studies.variants import Variant
from taichi_tracer.studies.workers import InThisProcess, StudyWorker


def test_a_worker_answers_and_ends():
    worker = StudyWorker(is_heard=False)
    try:
        worker.ask("open", Source("kube")).result(60)
        with pytest.raises(tt.InputError, match="unknown scene 'kube'"):
            worker.ask("facts", Variant()).result(60)
    finally:
        worker.close()
    worker.process.wait(60)
    assert worker.process.returncode == 0


def test_this_process_answers_in_the_same_way():
    here = InThisProcess()
    here.ask("open", Source("kube")).result()
    with pytest.raises(tt.InputError, match="unknown scene 'kube'"):
        here.ask("facts", Variant()).result()
