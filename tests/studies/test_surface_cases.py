"""The hard cases of surfaces and of lights at them: they pass, and each finds the mistake that it is about."""

import pytest

from taichi_tracer.studies.hard import surface_cases
from taichi_tracer.studies.hard.case import CaseTally

EPSILON = 2.0**-23

pytestmark = pytest.mark.usefixtures("f32")


CASES = [pytest.param(surface_cases.microfacets, marks=pytest.mark.slow), surface_cases.rough_layers]


@pytest.mark.parametrize("case", CASES)
def test_it_passes(case):
    found = CaseTally()
    case(found, EPSILON)
    assert found.tried > 100
    assert (found.wrong, found.nan) == (0, 0)
