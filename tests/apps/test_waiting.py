"""A terminal says what is compiled, and forgets it afterwards."""

from taichi_tracer.apps.waiting import CLEAR, CompilingLine
from taichi_tracer.system import compiling


def test_a_kernel_that_may_take_long_is_named_until_it_is_there(capsys):
    line = CompilingLine()
    line.begins(compiling.Kernel("Film._clear", reading=0.01))
    line.ends()
    assert capsys.readouterr().err == ""
    line.begins(compiling.Kernel("ProgressiveRenderer._take_samples", reading=0.5))
    assert capsys.readouterr().err == f"{CLEAR}compiling ProgressiveRenderer._take_samples ..."
    line.ends()
    line.ends()
    assert capsys.readouterr().err == CLEAR
