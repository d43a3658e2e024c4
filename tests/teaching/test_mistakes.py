"""The mistake finder: every mistake is found under its name, pairs mostly, and right answers are never named.

TAICHI_TRACER_LONG=1 runs it for every part of every assignment.
"""

import numpy as np
import pytest

from taichi_tracer.teaching import catalogue
from taichi_tracer.teaching.loading import OK, solution_of
from taichi_tracer.teaching.mistakes import find, with_mistakes
from taichi_tracer.teaching.running import answer, expected

# Pairs of names of which no input can tell which one it is, and why.
ALIKE = [
    # u, v and t of a hit on the back have the wrong sign, so that only hits behind the origin would differ.
    {"one-sided test: det > epsilon", "absolute value of det in the quotients"}
]
QUICK = ("Camera.generate_ndc_coords", "RayIntersector.query_ray")
PARTS = [(name, part.name) for name in catalogue.names() for part in catalogue.load(name).parts if part.replaces]
EVERY = [ids for ids in PARTS if ids[1] in QUICK and ids[0] == "a1"]


pytestmark = pytest.mark.usefixtures("own_cache")


def answers_with(assignment, part, combination, inputs):
    """What the solution with some mistakes answers."""
    classes = with_mistakes(assignment, part, combination)
    if classes is None:
        return None
    found = answer(part, classes, solution_of(assignment), inputs, dict(assignment.classes))
    return found.arrays if found.status == OK else None


@pytest.mark.parametrize(("name", "part_name"), EVERY)
def test_every_mistake_is_found_under_its_own_name(name, part_name):
    assignment = catalogue.load(name)
    part = assignment.part(part_name)
    inputs = assignment.inputs(part, 1)
    right = expected(assignment, part, inputs)
    for one in assignment.mistakes_of(part):
        wrong = answers_with(assignment, part, (one,), inputs)
        assert part.judge(inputs, wrong, right).status == "wrong", one.name
        names = {n for finding in find(assignment, part, inputs, wrong, right) for n in finding.names}
        assert one.name in names
        assert len(names) == 1 or names in ALIKE, names


@pytest.mark.parametrize(("name", "part_name"), EVERY)
def test_nothing_is_found_in_the_solution(name, part_name):
    assignment = catalogue.load(name)
    part = assignment.part(part_name)
    inputs = assignment.inputs(part, 2)
    right = expected(assignment, part, inputs)
    assert part.judge(inputs, right, right).status == "right"
    assert find(assignment, part, inputs, right, right) == []


def test_an_error_that_no_mistake_explains_is_described():
    assignment = catalogue.load("a1")
    part = assignment.parts[0]
    inputs = assignment.inputs(part, 0)
    right = expected(assignment, part, inputs)
    found = find(assignment, part, inputs, {"ndc": right["ndc"] * np.float32(0.7)}, right, seconds=0)
    assert [f.names for f in found] == [(), ()]
    assert [f.text for f in found] == ["ndc is scaled by 0.7", "7 more known mistakes are compared in the next check"]
