"""What a sample's work is counted as; ``tests/test_maps.py`` compares the maps with explained samples."""

import pytest
import taichi as ti
import taichi.math as tm

from taichi_tracer.integrators.work import WorkTally

pytestmark = pytest.mark.usefixtures("f32")


@ti.kernel
def work(tally: ti.template()) -> ti.types.vector(5, ti.i32):
    found = ti.Vector([0, 0, 0, 0, 0])
    for _ in range(1):
        tally.begin()
        for k in range(3):
            tally.node()
            tally.shadow_ray(k == 1)
        tally.primitive()
        up = tm.vec3(0, 1, 0)
        tally.direction(up, tm.vec3(1, 0, 0))  # along the horizon: it brings nothing
        tally.direction(up, tm.vec3(1, 0, 0))  # the same direction, asked once more
        tally.direction(up, tm.vec3(0, 1, 0))
        tally.direction(up, tm.vec3(0, -1, 0))
        found = ti.Vector([tally.nodes, tally.primitives, tally.shadows, tally.blocked, tally.below])
    return found


def test_every_sample_begins_at_zero_and_a_direction_counts_once():
    tally = WorkTally()
    for _ in range(2):
        assert list(work(tally)) == [3, 1, 3, 1, 2]
