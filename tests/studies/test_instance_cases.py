"""The hard cases of objects in several places: they pass, and each finds the mistake that it is about."""

import pytest

from taichi_tracer.studies.hard import instance_cases

EPSILON = 2.0**-23

pytestmark = pytest.mark.usefixtures("f32")


@pytest.mark.parametrize("case", [*instance_cases.INSTANCES])
def test_it_passes(case):
    found = case().judge(EPSILON)
    assert found["tried"] > 5
    assert (found["wrong"], found["nan"]) == (0, 0)
