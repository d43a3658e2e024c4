"""What stands in for a scene: it must bear methods that are wrong."""

import numpy as np
import pytest
import taichi as ti

from taichi_tracer.teaching import stand_ins

pytestmark = pytest.mark.usefixtures("f32")


def test_a_table_can_be_read_anywhere():
    """A wrong index gives a number that no picture has, and does not end the process."""
    field = ti.Vector.field(3, float, (2, 3))
    field.from_numpy(np.arange(18, dtype=np.float32).reshape(2, 3, 3))
    table = stand_ins.Guarded(field)

    @ti.kernel
    def read(row: float, column: float) -> ti.math.vec3:
        return table[int(row), int(column)]

    @ti.kernel
    def read_vector(row: int, column: int) -> ti.math.vec3:
        return table[ti.Vector([row, column])]

    assert list(read(1, 2)) == list(table[1, 2]) == list(read_vector(1, 2)) == [15, 16, 17]
    for place in ((2, 0), (0, 3), (-1, 0), (0, -1), (float("nan"), 0), (0, float("nan")), (1e9, -1e9)):
        assert list(read(*place)) == [stand_ins.OUTSIDE] * 3
    assert table.shape == (2, 3)
