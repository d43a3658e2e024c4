"""Which samples a merged picture has."""

import pytest

import taichi_tracer as tt
from taichi_tracer.apps.commands.merge import joined


def test_ranges_join_where_they_touch_and_may_not_overlap():
    assert joined([[0, 4]], [[4, 9]], "b") == [[0, 9]]
    assert joined([[8, 9], [0, 2]], [[4, 6]], "b") == [[0, 2], [4, 6], [8, 9]]
    with pytest.raises(tt.InputError, match="b: samples 3 to 4 are in another file, too"):
        joined([[0, 5]], [[3, 9]], "b")
