"""Shadow rays of leaves: sixteen at once try a primitive, with the arithmetic of the plain form.

Where a scene has few primitives, many rays come to the same leaf. Then it is best to put rays side by side: the edges
and the plane of a triangle, or the roots of a sphere, are computed for sixteen rays with the instructions of one. The
rays may start anywhere and go anywhere. The formulas are those of ``ray_intersector``, in the same order of operations,
so that both forms give the same answers.
"""

import taichi as ti
import taichi.math as tm

from taichi_tracer.fast.lanes import LANE_BITS, LANES, any_lane, flags, lanes, larger, smaller
from taichi_tracer.fast.leaf_blocks import leaf_range
from taichi_tracer.fast.packet_shapes import SphereLanes, sphere_distance
from taichi_tracer.ray import Ray
from taichi_tracer.system import memory, runtime

ONLY = 0  # the group of a place: there is one


@ti.data_oriented
class LeafLanes:
    """Memory for sixteen rays in each place, and the search for anything in their way.

    The rays have the fields and the methods of a group of ``packets.Packets``, so that the same triangle tests work on
    both. Fields of a group, sixteen lanes each:
        o, d, i, n, f: for each axis, the origin, the direction, 1/d, and the origin moved forwards and backwards
            (``RayBounds``).
        axis: the number of the largest component of the direction.
        shear_x, shear_y: the shear of the two smaller axes per unit of the largest, see ``triangles.shear_axes``.
        x0 … y2: the vertices of a triangle in sheared coordinates.
        reach: t of the end of a ray; −∞ when something is in its way, and 0 if it is no legal ray.
        is_undecided: the lanes that a triangle test cannot decide in this precision.

    Args:
        places: the number of groups that can be traced at the same time.
    """

    def __init__(self, places: int) -> None:
        self._memory = memory.Memory(scratch="LeafLanes")
        self.o, self.d, self.i, self.n, self.f = (ti.Vector.field(LANES, float) for _ in range(5))
        self.x0, self.x1, self.x2, self.y0, self.y1, self.y2 = (ti.Vector.field(LANES, float) for _ in range(6))
        self.shear_x, self.shear_y, self.reach, self.pad = (ti.Vector.field(LANES, float) for _ in range(4))
        self.axis, self.is_undecided = (ti.Vector.field(LANES, ti.i32) for _ in range(2))
        # LLVM unrolls a loop whose length is a constant. Therefore the lengths are read from memory.
        self.lanes, self.axes = (ti.field(ti.i32) for _ in range(2))
        group = self._memory.fields.dense(ti.i, places).dense(ti.j, 1)
        for field in (self.o, self.d, self.i, self.n, self.f):
            group.dense(ti.k, 3).place(field)
        # Vectors that are stored together do not lie side by side, see ``packets.Packets``.
        group.place(self.x0, self.shear_x, self.x1, self.shear_y, self.x2, self.axis, self.pad)
        group.place(self.y0, self.reach, self.y1, self.is_undecided, self.y2)
        self._memory.fields.place(self.lanes, self.axes)  # behind the vectors, see ``packets.Packets``
        self._memory.allocate()
        self.lanes[None], self.axes[None] = LANES, 3
        self.spheres = SphereLanes(places)

    @ti.func
    def put(self, c, lane, origin, direction, reach):
        """Put a ray into a lane."""
        for k in ti.static(range(3)):
            self.o[c, ONLY, k][lane], self.d[c, ONLY, k][lane] = origin[k], direction[k]
        self.reach[c, ONLY][lane] = reach

    @ti.func
    def prepare(self, c, intersector: ti.template()):
        """Compute what depends on the rays only. A ray that is none (``is_legal``) reaches nothing."""
        low, high = tm.vec3(intersector.geometry.low), tm.vec3(intersector.geometry.high)
        self.pad[c, ONLY], total, length = lanes(0.0), lanes(0.0), lanes(0.0)
        for k in range(self.axes[None]):
            o = self.o[c, ONLY, k]
            self.pad[c, ONLY] = larger(self.pad[c, ONLY], larger(abs(low[k] - o), abs(high[k] - o)))
            total, length = total + abs(o), length + abs(self.d[c, ONLY, k])
        is_legal = (total + length < tm.inf) & (length > 0)
        self.reach[c, ONLY] = ti.select(is_legal, self.reach[c, ONLY], lanes(0.0))
        for k in range(self.axes[None]):
            o, inverse = self.o[c, ONLY, k], 1 / self.d[c, ONLY, k]
            pad = intersector.pad_factor * (self.pad[c, ONLY] + abs(o) / 4)
            towards = ti.select(inverse >= 0, pad, -pad)
            self.i[c, ONLY, k] = inverse
            self.n[c, ONLY, k] = o + towards
            self.f[c, ONLY, k] = o - towards
        dx, dy, dz = self.d[c, ONLY, 0], self.d[c, ONLY, 1], self.d[c, ONLY, 2]
        x, y, z = abs(dx), abs(dy), abs(dz)
        self.axis[c, ONLY] = ti.select((x > y) & (x > z), 0, ti.select(y > z, 1, 2))
        first, second, along = self.in_own_axes(c, dx, dy, dz)
        self.shear_x[c, ONLY], self.shear_y[c, ONLY] = first / along, second / along
        if ti.static(intersector.geometry.effects.spheres):
            self.spheres.take(c, dx, dy, dz)

    @ti.func
    def in_own_axes(self, c, x, y, z):
        """The components along the two smaller axes of each ray, and along its largest axis (``smaller_axes``)."""
        axis = self.axis[c, ONLY]
        is_x, is_y = axis == 0, axis == 1
        first = ti.select(is_x, lanes(y), ti.select(is_y, lanes(z), lanes(x)))
        second = ti.select(is_x, lanes(z), ti.select(is_y, lanes(x), lanes(y)))
        return first, second, ti.select(is_x, lanes(x), ti.select(is_y, lanes(y), lanes(z)))

    @ti.func
    def try_leaf(self, c, intersector: ti.template(), first, count):
        """Shorten the reach of the rays that any of the primitives blocks."""
        for place in range(first, first + count):
            low, high = intersector.leaf_box(place)
            t_near, t_far = self.box_interval(c, low, high)
            may_meet = (t_near <= t_far) & (t_far > 0) & (self.reach[c, ONLY] > 0)
            if any_lane(may_meet):
                if ti.static(intersector.is_plain_geometry):
                    self.try_triangle(c, intersector, place, may_meet, t_near, t_far)
                else:
                    self.try_special(c, intersector, place, may_meet, t_near, t_far)

    @ti.func
    def try_special(self, c, intersector: ti.template(), place, may_meet, t_near, t_far):
        """``try_triangle``; but a sphere has its own test, and a triangle that rays may pass is tried ray by ray."""
        primitive_id = intersector.blocks.primitive(place)
        if not intersector.is_special(primitive_id):
            self.try_triangle(c, intersector, place, may_meet, t_near, t_far)
        else:
            is_sphere = intersector.is_sphere(primitive_id)
            if ti.static(intersector.geometry.effects.spheres):
                if is_sphere:
                    self.try_sphere(c, *intersector.sphere(primitive_id), may_meet, t_near, t_far)
            if ti.static(intersector.has_special_triangles):
                if not is_sphere:
                    self.decide(c, intersector, place, may_meet)

    @ti.func
    def try_sphere(self, c, centre, radius, may_meet, t_near, t_far):
        """``RayIntersector.sphere_candidate`` of sixteen rays."""
        ox, oy, oz = self.o[c, ONLY, 0], self.o[c, ONLY, 1], self.o[c, ONLY, 2]
        may_meet = may_meet & self.spheres.may_meet(c, ox, oy, oz, centre, radius, t_near)
        if any_lane(may_meet):
            is_met, entry, exit = self.spheres.solve(c, radius)
            t = sphere_distance(entry, exit, t_near, t_far, 0.0)
            self.block(c, is_met & may_meet & (t > 0))

    @ti.func
    def try_triangle(self, c, intersector: ti.template(), place, may_meet, t_near, t_far):
        """``RayIntersector.candidate`` of sixteen rays."""
        is_inside, is_undecided, t, _, _ = intersector.solve_packet(self, c, ONLY, 0, intersector.blocks, place)
        t = ti.select(t < t_near, t_near, ti.select(t > t_far, t_far, t))
        self.block(c, is_inside & may_meet & (t > 0))
        if ti.static(runtime.can_widen() and intersector.triangle_test == "watertight"):
            if any_lane(is_undecided):
                self.decide(c, intersector, place, is_undecided & may_meet)

    @ti.func
    def box_interval(self, c, low, high):
        """``box_interval`` of sixteen rays and one box, for any t."""
        t_near, t_far = lanes(-tm.inf), lanes(tm.inf)
        for k in range(self.axes[None]):
            inverse = self.i[c, ONLY, k]
            near_plane, far_plane = ti.select(inverse >= 0, low[k], high[k]), ti.select(inverse >= 0, high[k], low[k])
            near, far = (near_plane - self.n[c, ONLY, k]) * inverse, (far_plane - self.f[c, ONLY, k]) * inverse
            t_near, t_far = larger(near, t_near), smaller(far, t_far)
        return t_near, t_far

    @ti.func
    def project(self, c, g, common, blocks: ti.template(), place, corner: ti.template()):
        """A vertex on the plane of the two smaller axes of each ray, sheared along its largest axis (Woop et al.)."""
        v = blocks.vertex(place, corner)
        ox, oy, oz = self.o[c, g, 0], self.o[c, g, 1], self.o[c, g, 2]
        x, y, along = self.in_own_axes(c, v.x - ox, v.y - oy, v.z - oz)
        return x - self.shear_x[c, g] * along, y - self.shear_y[c, g] * along

    @ti.func
    def origin(self, c, g, common, axis):
        """A component of the origins."""
        return self.o[c, g, axis]

    @ti.func
    def block(self, c, is_blocked):
        """Something is in the way in these lanes."""
        self.reach[c, ONLY] = ti.select(is_blocked, lanes(-tm.inf), self.reach[c, ONLY])

    @ti.func
    def decide(self, c, intersector: ti.template(), place, is_asked):
        """Let the plain form decide in these lanes, one by one."""
        self.is_undecided[c, ONLY] = ti.select(is_asked, flags(1), flags(0))
        v0, v1, v2 = intersector.blocks.triangle(place)
        for lane in range(self.lanes[None]):
            if self.is_undecided[c, ONLY][lane] != 0:
                o, d = tm.vec3(0), tm.vec3(0)
                for k in ti.static(range(3)):
                    o[k], d[k] = self.o[c, ONLY, k][lane], self.d[c, ONLY, k][lane]
                ray = Ray(origin=o, direction=d)
                primitive_id = intersector.blocks.primitive(place)
                t, _, _ = intersector.try_primitive(ray, intersector.ray_bounds(ray), primitive_id, v0, v1, v2, 0.0)
                if t > 0:
                    self.reach[c, ONLY][lane] = -tm.inf


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
        self._memory = memory.Memory(scratch="ShadowLanes")
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
