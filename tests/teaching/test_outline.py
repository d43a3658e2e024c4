"""What a submission's process gets: the solution of the parts that were asked for before, and of no other one."""

import pytest

from taichi_tracer.teaching import catalogue, outline


@pytest.mark.parametrize("name", catalogue.names())
def test_what_a_method_calls_comes_before_it(name):
    assignment = catalogue.load(name)
    names, calls = outline.in_order(assignment), outline.called(assignment)
    assert sorted(names) == sorted(part.name for part in assignment.parts if part.replaces)
    for i, part in enumerate(names):
        assert not calls[part] & set(names[i + 1 :]), part
