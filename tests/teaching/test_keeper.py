"""The keeper: its task as JSON. What it does is tried in test_sandbox.py."""

from taichi_tracer.teaching.keeper import Task
from taichi_tracer.teaching.walls import Limits, Surroundings


def test_a_task_survives_its_words():
    for limits in (None, Limits(cpu=1.5)):
        task = Task(Surroundings("bwrap", "/x", ("/usr", "/lib"), 7), limits, 3, 4, 5)
        assert Task.of(task.words()) == task
