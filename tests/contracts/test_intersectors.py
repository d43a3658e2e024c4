"""Every registered intersector answers as brute force."""

import pytest
from support import start

from taichi_tracer.contracts import intersectors
from taichi_tracer.system.registry import PARTS


@pytest.fixture(scope="module", autouse=True)
def _taichi():
    start("f32")
    intersectors.truth.cache_clear()  # of another precision


PARTS_BUT_TRUTH = pytest.mark.parametrize(
    "part", [part for part in PARTS.all("intersector") if part is not intersectors.TRUTH], ids=lambda part: part.name
)
LONG = [pytest.param(shape, marks=pytest.mark.slow) for shape in intersectors.HARD_AND_LONG]


@PARTS_BUT_TRUTH
def test_intersector(part):
    intersectors.check_intersector(part)


@PARTS_BUT_TRUTH
@pytest.mark.parametrize("shape", [*intersectors.HARD, *LONG])
def test_the_build_of_a_hard_shape_ends(part, shape):
    intersectors.check_hard_shape(part, shape)
