"""Memory is used again only if nobody can see the former array."""

import numpy as np
import pytest

from taichi_tracer.system import reuse
from taichi_tracer.system.reuse import LARGE, MOST_BYTES, MOST_KEPT, Reused


def address(array):
    """Where the memory of an array begins."""
    return array.__array_interface__["data"][0]


def test_memory_is_used_again_when_the_array_is_deleted():
    reused = Reused()
    first = reused.empty(LARGE + 5)
    before = address(first)
    del first
    assert address(reused.empty(LARGE)) == before


@pytest.mark.parametrize("part", [lambda a: a[10:20], lambda a: a.view(np.int32)[4:].reshape(-1, 2), memoryview])
def test_memory_is_not_used_while_a_part_is_alive(part):
    reused = Reused()
    array = reused.empty(LARGE)
    before, part = address(array), part(array)
    del array
    second = reused.empty(LARGE)
    assert address(second) != before
    del part, second
    assert len({address(reused.empty(LARGE)) for _ in range(3)}) == 1


def test_a_variable_in_a_loop_needs_two_memories():
    reused, seen = Reused(), set()
    for _ in range(6):
        result = reused.empty(LARGE)
        seen.add(address(result))
    assert len(seen) == MOST_KEPT == 2


def test_the_size_of_what_is_kept_is_limited(monkeypatch):
    reused = Reused()
    for size in (LARGE - 1, MOST_BYTES + 1):
        assert reused.empty(size).size == size
    assert reused._kept == []
    monkeypatch.setattr(reuse, "LARGE", 8)
    held = [reused.empty(100) for _ in range(5)]
    assert len(reused._kept) == MOST_KEPT
    assert len({address(one) for one in held}) == 5
    del held
    assert reused.empty(20).base.size == 20  # and not a fifth of 100
