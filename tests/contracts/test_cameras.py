"""Every registered camera keeps its contract in each precision; those that break it in one point are found."""

from contracts.registered import check_part, every


@every("camera")
def test_camera(precision, part):
    check_part(part)
