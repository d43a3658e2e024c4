"""Shadow rays of a scene whose primitives all lie in one leaf: sixteen rays at once try one primitive after the other.

There is no tree, and so there are no lists of rays: the rays are kept side by side from the beginning. The answers are
those of the plain form, see ``leaf_lanes``.
"""

import taichi as ti
import taichi.math as tm

from taichi_tracer.fast.lanes import LANE_BITS, LANES, lanes
from taichi_tracer.fast.leaf_lanes import LeafLanes
from taichi_tracer.fast.shadow_streams import ShadowStreams
from taichi_tracer.fast.wide_bvh import leaf_range
from taichi_tracer.system import memory


def shadow_rays(intersector, places: int, most: int):
    """``ShadowLanes`` if all primitives lie in one leaf and their tests have forms for lanes, else ``ShadowStreams``.

    Args:
        intersector: a ``WideBVH``. places, most: as for both classes, which have the same methods.
    """
    is_one_leaf = intersector.root < 0 and intersector.solve_packet is not None
    return (ShadowLanes if is_one_leaf else ShadowStreams)(intersector, places, most)


@ti.data_oriented
class ShadowLanes:
    """Memory for shadow rays, and their tests. A place holds the rays of one thread.

    Fields of sixteen rays in a place:
        o, d: for each axis, the origins and the directions. reach: −∞ if a ray is blocked.

    Args:
        intersector: a ``WideBVH`` whose root is a leaf.
        places: the number of lists that can be traced at the same time.
        most: the largest number of rays of a place.
    """

    def __init__(self, intersector, places: int, most: int) -> None:
        self.intersector = intersector
        self._memory = memory.Memory()
        self.o, self.d, self.reach = (ti.Vector.field(LANES, float) for _ in range(3))
        self.count = ti.field(ti.i32)
        group = self._memory.fields.dense(ti.i, places).dense(ti.j, -(-most // LANES))
        group.dense(ti.k, 3).place(self.o)
        group.dense(ti.k, 3).place(self.d)
        group.place(self.reach)
        # For each place its own line of the cache: a thread that writes to a line takes it from all others.
        self._memory.fields.dense(ti.i, places).dense(ti.j, LANES).place(self.count)
        self._memory.allocate()
        self.leaf = LeafLanes(places)

    @ti.func
    def clear(self, c):
        """Forget the rays of a place."""
        self.count[c, 0] = 0

    @ti.func
    def add(self, c, origin, direction):
        """Add a ray to a place. Returns its number; the first one is 0."""
        k = self.count[c, 0]
        g, lane = k >> LANE_BITS, k & (LANES - 1)
        for axis in ti.static(range(3)):
            self.o[c, g, axis][lane], self.d[c, g, axis][lane] = origin[axis], direction[axis]
        self.count[c, 0] = k + 1
        return k

    @ti.func
    def is_blocked(self, c, k):
        """After ``trace``: whether anything is in the way of a ray."""
        return self.reach[c, k >> LANE_BITS][k & (LANES - 1)] < 0

    @ti.func
    def trace(self, c):
        """Find for every ray of a place whether anything is in its way. The last lanes may hold older rays."""
        first, number = leaf_range(self.intersector.root)
        for g in range((self.count[c, 0] + LANES - 1) >> LANE_BITS):
            for axis in ti.static(range(3)):
                self.leaf.o[c, 0, axis], self.leaf.d[c, 0, axis] = self.o[c, g, axis], self.d[c, g, axis]
            self.leaf.reach[c, 0] = lanes(tm.inf)
            self.leaf.prepare(c, self.intersector)
            self.leaf.try_leaf(c, self.intersector, first, number)
            self.reach[c, g] = self.leaf.reach[c, 0]
