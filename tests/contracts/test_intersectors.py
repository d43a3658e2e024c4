"""Every registered intersector answers as brute force."""

import pytest
from support import start

from taichi_tracer.contracts import intersectors
from taichi_tracer.system.registry import PARTS


@pytest.fixture(scope="module", autouse=True)
def _taichi():
    start("f32")
    intersectors.truth.cache_clear()  # of another precision


@pytest.mark.parametrize(
    "part", [part for part in PARTS.all("intersector") if part is not intersectors.TRUTH], ids=lambda part: part.name
)
def test_intersector(part):
    intersectors.check_intersector(part)
