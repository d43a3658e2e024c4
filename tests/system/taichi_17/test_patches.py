"""The table of what is replaced in Taichi."""

from taichi_tracer.system import runtime


def test_the_patches_were_tried_with_the_taichi_that_is_installed():
    assert runtime.patches() == ""
