"""The hard cases of surfaces and of lights at them: they pass, and each finds the mistake that it is about."""

import pytest

from taichi_tracer.studies.hard import surface_cases

EPSILON = 2.0**-23

pytestmark = pytest.mark.usefixtures("f32")


CASES = [pytest.param(surface_cases.Microfacets, marks=pytest.mark.slow), surface_cases.RoughLayers]


@pytest.mark.parametrize("case", CASES)
def test_it_passes(case):
    found = case().judge(EPSILON)
    assert found["tried"] > 100
    assert (found["wrong"], found["nan"]) == (0, 0)
