"""Every registered camera keeps its contract in each precision; those that break it in one point are found."""

from contracts.registered import every
from taichi_tracer.contracts.steps import check_part


@every("camera")
def test_camera(precision, part):
    check_part(part)
