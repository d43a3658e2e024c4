"""The mistake finder: every mistake is found under its name, and right answers are never named."""

import numpy as np
import pytest

from taichi_tracer.teaching import catalogue
from taichi_tracer.teaching.mistakes import answers_of, changed_source, find
from taichi_tracer.teaching.running import expected

SEED = 1
MOST = 8  # mistakes of one method

pytestmark = pytest.mark.usefixtures("own_cache")


@pytest.mark.parametrize("part_name", ["Camera.generate_ndc_coords", "RayIntersector.query_ray"])
def test_every_mistake_is_found_under_its_own_name(part_name):
    assignment = catalogue.load("a1")
    part = assignment.part(part_name)
    right = expected(assignment, part, assignment.inputs(part, SEED))
    assert find(assignment, part, SEED, right, right) == []
    for one in assignment.mistakes_of(part):
        wrong = answers_of(assignment, part, one, SEED)
        assert [finding["names"] for finding in find(assignment, part, SEED, wrong, right)] == [[one.name]]


@pytest.mark.parametrize("name", catalogue.names())
def test_a_method_has_few_known_mistakes_which_change_the_solution(name):
    assignment = catalogue.load(name)
    for part in assignment.parts:
        known = assignment.mistakes_of(part)
        assert len({changed_source(assignment, part, one) for one in known}) == len(known) <= MOST


def test_an_error_that_no_mistake_explains_is_described():
    assignment = catalogue.load("a1")
    part = assignment.parts[0]
    right = expected(assignment, part, assignment.inputs(part, 0))
    found = find(assignment, part, 0, {"ndc": right["ndc"] * np.float32(0.7)}, right, seconds=0)
    assert [(f["names"], f["text"]) for f in found] == [([], "ndc is scaled by 0.7")]
