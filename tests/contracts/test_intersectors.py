"""Every registered intersector answers as brute force."""

import pytest
from support import start

from taichi_tracer.contracts import intersectors
from taichi_tracer.system.parts.registry import PARTS


@pytest.fixture(scope="module", autouse=True)
def _taichi():
    start("f32")
    intersectors.truth.cache_clear()  # of another precision


PARTS_BUT_TRUTH = pytest.mark.parametrize(
    "part", [part for part in PARTS.all("intersector") if part is not intersectors.TRUTH], ids=lambda part: part.name
)


@PARTS_BUT_TRUTH
def test_intersector(part):
    intersectors.check_intersector(part)


@PARTS_BUT_TRUTH
@pytest.mark.parametrize("shape", intersectors.HARD)
def test_the_build_of_a_hard_shape_ends(part, shape):
    assert intersectors.check_equals_brute_force(part, shape, count=200).is_hit.any()
