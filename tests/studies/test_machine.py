"""The machine is told in one line."""

from support import start

from taichi_tracer.studies import machine


def test_the_machine_is_told_in_one_line():
    start("f32")
    told = machine.describe_machine()
    assert told.startswith("python 3.")
    assert "backend cpu" in told
