"""Every registered sampler keeps the contract of ``sampler.Sampler``; those that break it in one point are found."""

import pytest
from support import DEBUG, start

from contracts.registered import check_part, every

pytestmark = pytest.mark.skipif(
    DEBUG,
    reason="with bounds checked, Taichi prints a line for every product of words that overflows: those of a hash do",
)


@pytest.fixture(scope="module", autouse=True)
def _taichi():
    start("f32")


@every("sampler")
def test_sampler(part):
    check_part(part)
