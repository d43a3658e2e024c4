"""Whether two scenes answer alike, to the last bit."""

import numpy as np


def assert_same_answers(expected, found, origins, directions, **interval):
    """``intersect`` and ``occluded`` of two scenes, for (N, 3) rays; returns the ``RayHits`` of the first."""
    a, b = (scene.intersect(origins, directions, **interval) for scene in (expected, found))
    for field, value in vars(a).items():
        np.testing.assert_array_equal(getattr(b, field), value, err_msg=f"{found}: {field}")
    for scene in (expected, found):
        np.testing.assert_array_equal(scene.occluded(origins, directions, **interval), a.is_hit, err_msg=f"{scene}")
    return a
