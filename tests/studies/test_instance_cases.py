"""The hard cases of objects in several places: they pass, and each finds the mistake that it is about."""

import pytest

from taichi_tracer.studies.hard import view_cases
from taichi_tracer.studies.hard.case import CaseTally

EPSILON = 2.0**-23

pytestmark = pytest.mark.usefixtures("f32")


@pytest.mark.parametrize("name", ["many_sizes", "scaled_to_nothing", "some_places"])
def test_it_passes(name):
    found = CaseTally()
    getattr(view_cases, name)(found, EPSILON)
    assert found.tried > 5
    assert (found.wrong, found.nan) == (0, 0)
