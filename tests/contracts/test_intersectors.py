"""Every registered intersector answers as brute force, in each form; those that break that in one point are found."""

import pytest
from support import start

from taichi_tracer.contracts import intersectors
from taichi_tracer.system.registry import PARTS


def every_form():
    """A decorator: runs the test with ``part`` and ``fast`` set to each form of an intersector, but for the truth."""
    forms = []
    for part in PARTS.all("intersector"):
        if part is not intersectors.TRUTH:  # whose fast form is the same loop
            forms.append(pytest.param(part, True, id=part.name))
    return pytest.mark.parametrize(("part", "fast"), forms)


@pytest.fixture(scope="module", autouse=True)
def _taichi():
    start("f32")
    intersectors.truth.cache_clear()  # of another precision


@every_form()
def test_intersector(part, fast):
    intersectors.check_intersector(part, fast)
