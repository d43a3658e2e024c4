"""Shadow rays in streams: lists of rays go down the hierarchy together, with the answers of the plain form.

A single ray visits a few nodes, and for each of them the CPU decodes eight boxes and guesses a branch. A *stream* is a
list of rays. A node decodes its boxes once, tests all rays of its list against them, and gives each child the list of
the rays that meet it. Nothing is sorted but the signs of the directions, no branch depends on a single ray, and the
rays of a list need nothing in common. A shadow ray only asks whether anything is in its way. So no distances are kept,
and a blocked ray misses every further box (Wald, Gribble, Boulos & Kensler, "SIMD ray stream tracing", 2007; Barringer
& Akenine-Möller, "Dynamic ray stream traversal", SIGGRAPH 2014).

In a leaf, rays that pass a triangle by are found for four triangles at once (``leaf_blocks``), and rays that start
behind its plane are found next. The plain test then decides about the few that are left. Therefore the answers are the
same, to the last bit.
"""

import taichi as ti
import taichi.math as tm

from taichi_tracer.fast.bvh_build import BLOCK, BLOCK_BITS
from taichi_tracer.fast.bvh_wide import WIDTH
from taichi_tracer.fast.lanes import LANES, larger, smaller
from taichi_tracer.fast.leaf_blocks import Aim, aim_of, leaf_range
from taichi_tracer.fast.shadow_lanes import LeafLanes, ShadowLanes
from taichi_tracer.formulas.boxes import RayBounds, box_interval
from taichi_tracer.formulas.triangles import stable_normal
from taichi_tracer.ray import Ray
from taichi_tracer.system import memory

FEW = 64  # of a scene with so few primitives, many rays come to each leaf
OCTANTS = 8  # one list at the root for each combination of signs of a direction


@ti.data_oriented
class ShadowStreams:
    """Memory for shadow rays, and their traversal. A place holds the rays of one thread.

    Fields of a ray in a place:
        ray_o, ray_d: its origin and direction. near, inverse, far: its ``RayBounds``. axes, aimed, shear: the axes, the
            origin and the shear of its ``leaf_blocks.Aim``. reach: −∞ if it is blocked, 0 if it is no legal ray, and
            otherwise ∞.
    Fields of a place:
        count: the number of rays. ids: all lists, each of which has the numbers of some rays.

    Args:
        intersector: a ``WideBVH``.
        places: the number of lists that can be traced at the same time.
        most: the largest number of rays of a place; at most 65,536, because the lists have numbers of 16 bits.
    """

    def __init__(self, intersector, places: int, most: int) -> None:
        self.intersector = intersector
        self._memory = memory.Memory(scratch="ShadowStreams")
        self.ray_o, self.ray_d, self.near, self.inverse, self.far = (ti.Vector.field(3, float) for _ in range(5))
        self.axes, self.aimed = ti.Vector.field(3, ti.i32), ti.Vector.field(3, float)
        self.shear = ti.Vector.field(2, float)
        self.reach, self.ids, self.count = ti.field(float), ti.field(ti.u16), ti.field(ti.i32)
        place = self._memory.fields.dense(ti.i, places)
        place.place(self.count)
        place.dense(ti.j, most).place(self.near, self.inverse, self.far, self.reach)
        place.dense(ti.j, most).place(self.ray_o, self.ray_d, self.aimed, self.axes, self.shear)
        # At each level of the tree, the lists of the eight children lie behind the list of their node.
        place.dense(ti.j, most * (1 + OCTANTS + WIDTH * (intersector.depth + 1))).place(self.ids)
        self._memory.allocate()
        self.in_lanes = intersector.num_leaf_triangles <= FEW and intersector.solve_packet is not None
        if self.in_lanes:
            self.leaf_lanes = LeafLanes(places)

    @ti.func
    def clear(self, c):
        """Forget the rays of a place."""
        self.count[c] = 0

    @ti.func
    def add(self, c, origin, direction):
        """Add a ray to a place. Returns its number; the first one is 0."""
        k = self.count[c]
        self.ray_o[c, k], self.ray_d[c, k] = origin, direction
        self.count[c] = k + 1
        return k

    @ti.func
    def is_blocked(self, c, k):
        """After ``trace``: whether anything is in the way of a ray."""
        return self.reach[c, k] < 0

    @ti.func
    def trace(self, c):
        """Find for every ray of a place whether anything is in its way."""
        m = self.count[c]
        counts = ti.Vector([0] * OCTANTS, ti.i32)
        for r in range(m):
            ray = self.ray(c, r)
            bounds = self.intersector.ray_bounds(ray)
            self.near[c, r], self.inverse[c, r], self.far[c, r] = bounds.near_origin, bounds.inverse, bounds.far_origin
            if ti.static(not self.in_lanes):
                aim = aim_of(ray)
                self.axes[c, r] = ti.Vector([aim.x, aim.y, aim.z])
                self.shear[c, r], self.aimed[c, r] = tm.vec2(aim.shear_x, aim.shear_y), aim.origin
            self.reach[c, r] = ti.select(self.intersector.is_legal(ray), tm.inf, 0.0)
            octant = 0
            for k in ti.static(range(3)):
                octant += ti.select(bounds.inverse[k] >= 0, 0, 1 << k)
            self.ids[c, octant * m + counts[octant]] = ti.cast(r, ti.u16)
            counts[octant] += 1
        for octant in range(OCTANTS):
            if counts[octant] > 0:
                self.trace_octant(c, octant, octant * m, counts[octant], OCTANTS * m)

    @ti.func
    def trace_octant(self, c, octant, begin, rays, free):
        """Trace the list of an octant. Lists of children are written from ``free`` on."""
        node = ti.Vector([0] * self.intersector.stack_size, ti.i32)
        first = ti.Vector([0] * self.intersector.stack_size, ti.i32)
        size = ti.Vector([0] * self.intersector.stack_size, ti.i32)
        node[0], first[0], size[0] = self.intersector.root, begin, rays
        top = 1
        while top > 0:
            top -= 1
            reference, at, count = node[top], first[top], size[top]
            lists = ti.max(at + count, free)  # all waiting lists lie before this one
            if reference >= 0:
                counts = self.filter_children(c, octant, reference, at, count, lists)
                for k in ti.static(range(WIDTH)):  # without branches, see ``WideBVH.enter_any``
                    node[top], first[top] = self.intersector.children[reference, k], lists + k * count
                    size[top] = counts[k]
                    top += ti.select(counts[k] > 0, 1, 0)
            else:
                self.try_leaf(c, octant, reference, at, count, lists)

    @ti.func
    def filter_children(self, c, octant, node, at, count, lists):
        """Write for each child of a node the list of the rays that meet its box. Returns the lengths of these lists.

        The number of a ray is written to all eight lists, and only the lists that it belongs to become longer.
        """
        counts = ti.Vector([0] * WIDTH, ti.i32)
        x_near, x_far = self.intersector.near_and_far_plane(node, 0, octant & 1 == 0)
        y_near, y_far = self.intersector.near_and_far_plane(node, 1, octant & 2 == 0)
        z_near, z_far = self.intersector.near_and_far_plane(node, 2, octant & 4 == 0)
        for j in range(at, at + count):
            r = ti.cast(self.ids[c, j], ti.i32)
            near, far, inverse = self.near[c, r], self.far[c, r], self.inverse[c, r]
            t_near, t_far = ti.Vector([0.0] * WIDTH), ti.Vector([self.reach[c, r]] * WIDTH)
            t_near = larger((x_near - near.x) * inverse.x, t_near)
            t_far = smaller((x_far - far.x) * inverse.x, t_far)
            t_near = larger((y_near - near.y) * inverse.y, t_near)
            t_far = smaller((y_far - far.y) * inverse.y, t_far)
            t_near = larger((z_near - near.z) * inverse.z, t_near)
            t_far = smaller((z_far - far.z) * inverse.z, t_far)
            for k in ti.static(range(WIDTH)):
                self.ids[c, lists + k * count + counts[k]] = ti.cast(r, ti.u16)
            counts += ti.cast(t_near <= t_far, ti.i32)
        return counts

    @ti.func
    def try_leaf(self, c, octant, reference, at, count, lists):
        """Try the primitives of a leaf with the rays of its list."""
        first, number = leaf_range(reference)
        if ti.static(self.in_lanes):
            self.try_in_lanes(c, at, count, first, number)
        elif ti.static(self.intersector.blocks.has_test and self.intersector.is_plain_geometry):
            for block in range(first >> BLOCK_BITS, (first + number + BLOCK - 1) >> BLOCK_BITS):
                counts = self.filter_triangles(c, at, count, lists, block)
                for k in range(BLOCK):  # a loop that runs: the code of a triangle is there once
                    if counts[k] > 0:
                        self.try_triangle(c, octant, lists + k * count, counts[k], (block << BLOCK_BITS) + k)
        else:
            for place in range(first, first + number):
                low, high = self.intersector.leaf_box(place)
                for j in range(at, at + count):
                    r = ti.cast(self.ids[c, j], ti.i32)
                    t_near, t_far = box_interval(self.bounds(c, r), low, high, 0.0, self.reach[c, r])
                    if t_near <= t_far:
                        self.decide(c, r, place)

    @ti.func
    def try_in_lanes(self, c, at, count, first, number):
        """Try the primitives of a leaf with sixteen rays of its list after the other."""
        for begin in range((count + LANES - 1) // LANES):
            for lane in range(self.leaf_lanes.lanes[None]):
                r = ti.cast(self.ids[c, at + ti.min(begin * LANES + lane, count - 1)], ti.i32)
                self.leaf_lanes.put(c, lane, self.ray_o[c, r], self.ray_d[c, r], self.reach[c, r])
            self.leaf_lanes.prepare(c, self.intersector)
            self.leaf_lanes.try_leaf(c, self.intersector, first, number)
            for lane in range(self.leaf_lanes.lanes[None]):
                r = ti.cast(self.ids[c, at + ti.min(begin * LANES + lane, count - 1)], ti.i32)
                self.reach[c, r] = self.leaf_lanes.reach[c, 0][lane]

    @ti.func
    def filter_triangles(self, c, at, count, lists, block):
        """Write for each triangle of a block the list of the rays whose line may meet it. Returns their lengths."""
        counts = ti.Vector([0] * BLOCK, ti.i32)
        for j in range(at, at + count):
            r = ti.cast(self.ids[c, j], ti.i32)
            aim = Aim(x=self.axes[c, r].x, y=self.axes[c, r].y, z=self.axes[c, r].z)
            aim.shear_x, aim.shear_y, aim.origin = self.shear[c, r].x, self.shear[c, r].y, self.aimed[c, r]
            may_meet = self.intersector.blocks.test(self.intersector.blocks, self.ray(c, r), aim, block)
            for k in ti.static(range(BLOCK)):
                self.ids[c, lists + k * count + counts[k]] = ti.cast(r, ti.u16)
            counts += ti.cast(may_meet, ti.i32)
        return counts

    @ti.func
    def try_triangle(self, c, octant, at, count, place):
        """Try a triangle with the rays of a list. Most of them start behind its plane, because they leave it."""
        v0, v1, v2 = self.intersector.blocks.triangle(place)
        n = stable_normal(v0, v1, v2)
        low, high = self.intersector.leaf_box(place)
        near_corner, far_corner = tm.vec3(0), tm.vec3(0)
        for k in ti.static(range(3)):
            near_corner[k] = ti.select((octant >> k) & 1 == 0, low[k], high[k])
            far_corner[k] = ti.select((octant >> k) & 1 == 0, high[k], low[k])
        for j in range(at, at + count):
            r = ti.cast(self.ids[c, j], ti.i32)
            if ti.static(self.intersector.triangle_test != "watertight"):
                self.decide(c, r, place)
            else:
                # t and its interval, as ``watertight`` and ``RayIntersector.candidate`` compute them
                to_near, to_far = near_corner - self.near[c, r], far_corner - self.far[c, r]
                t_near, t_far = -tm.inf, tm.inf
                for k in ti.static(range(3)):
                    t_near = larger(to_near[k] * self.inverse[c, r][k], t_near)
                    t_far = smaller(to_far[k] * self.inverse[c, r][k], t_far)
                t = -tm.dot(v0 - self.ray_o[c, r], n) / -tm.dot(self.ray_d[c, r], n)
                t = ti.select(t < t_near, t_near, ti.select(t > t_far, t_far, t))
                if (t_near <= t_far) & (t > 0):
                    self.decide(c, r, place)

    @ti.func
    def ray(self, c, r):
        """A ray of a place."""
        return Ray(origin=self.ray_o[c, r], direction=self.ray_d[c, r])

    @ti.func
    def bounds(self, c, r):
        """The ``RayBounds`` of a ray."""
        return RayBounds(inverse=self.inverse[c, r], near_origin=self.near[c, r], far_origin=self.far[c, r])

    @ti.func
    def decide(self, c, r, place):
        """Let the plain form decide whether a primitive blocks a ray."""
        if self.reach[c, r] > 0:
            v0, v1, v2 = self.intersector.blocks.triangle(place)
            primitive_id = self.intersector.blocks.primitive(place)
            ray, bounds = self.ray(c, r), self.bounds(c, r)
            t, u, v = self.intersector.try_primitive(ray, bounds, primitive_id, v0, v1, v2, 0.0)
            if t > 0:
                self.reach[c, r] = -tm.inf


def shadow_rays(intersector, places: int, most: int):
    """``ShadowLanes`` if all primitives lie in one leaf and their tests have forms for lanes, else ``ShadowStreams``.

    Args:
        intersector: a ``WideBVH``. places, most: as for both classes, which have the same methods.
    """
    is_one_leaf = intersector.root < 0 and intersector.solve_packet is not None
    return (ShadowLanes if is_one_leaf else ShadowStreams)(intersector, places, most)
