"""Sobol' points are nets."""

import numpy as np
import pytest
from sequences import SOBOL, points

pytestmark = pytest.mark.usefixtures("f32")


@pytest.mark.parametrize("bits", [4, 6, 8])
def test_sobol_points_are_nets(bits):
    """Every box of volume 2^−m holds one of each 2^m consecutive samples of a replica, whatever its shape."""
    count = 1 << bits
    for pixel in range(5):
        all_points = points(SOBOL, 4 * count, pixel=pixel, dimension=pixel % 3).astype(np.float64)
        even, odd = all_points[::2], all_points[1::2]
        for block in (even[:count], even[count:], odd[:count], odd[count:]):
            for k in range(bits + 1):
                cells = np.floor(block * [1 << k, count >> k])
                assert len({tuple(cell) for cell in cells}) == count
