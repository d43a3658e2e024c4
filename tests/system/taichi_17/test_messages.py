"""Messages are those of Taichi alone, word for word."""

import pytest
import taichi as ti
from support import as_taichi_is, start
from taichi.lang import util

from taichi_tracer.system.taichi_17 import messages


def test_the_place_of_a_field_is_told_as_by_taichi():
    def both(level):
        return util.get_traceback(level), messages.traceback_text(level)

    for level in (1, 2):
        usual, found = both(level)
        assert found == usual


@ti.func
def wrong_in_the_second_line(a):
    b = a + 1
    return b + not_defined_anywhere + "a very long text, so that the line is longer than eighty characters"  # noqa: F821


@ti.kernel
def asks_it() -> int:
    return wrong_in_the_second_line(1)


def test_messages_are_those_of_taichi_alone():
    """Word for word what Taichi prints when it reads and describes everything anew."""
    start("f32")
    with pytest.raises(ti.TaichiNameError) as kept:
        asks_it()
    with as_taichi_is(), pytest.raises(ti.TaichiNameError) as alone:
        asks_it()
    assert str(kept.value) == str(alone.value)
    assert "test_messages.py" in str(kept.value)
    assert "^^^^^^^^^^^^^^^^^^^^" in str(kept.value)
