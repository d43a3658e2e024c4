"""Packets: sixty-four rays at once that go in almost the same direction, with the arithmetic of the plain form.

A packet consists of four groups of sixteen rays. All of its rays go down the tree together, into every box that at
least one of them may meet. The box of a triangle decides which groups try the triangle. There, the formulas are those
of ``ray_intersector``. They work on vectors of sixteen lanes instead of single numbers, in the same order of
operations, so that both forms give the same bits. Conditions are written with ``select``, and results are stored as
sixteen neighbours in memory, because then the compiler uses vector instructions (Wald et al., "Interactive rendering
with coherent ray tracing", 2001).

What the rays have in common is computed once, and not in every lane (Boulos et al., "Interactive distribution ray
tracing", 2006). A *heading* is the set of rays whose directions have the same signs and the same largest component. A
packet works on the lanes of one heading at a time; most packets have only one heading. If all rays start at one point,
everything that depends only on this point is a single number.
"""

import taichi as ti
import taichi.math as tm

from taichi_tracer.fast.bvh_build import BLOCK, BLOCK_BITS
from taichi_tracer.fast.lanes import (
    LANE_BITS,
    LANES,
    any_lane,
    first_lane,
    flags,
    greatest,
    lanes,
    lanes_of,
    larger,
    least,
    smaller,
)
from taichi_tracer.fast.packet_shapes import SphereLanes, sphere_distance
from taichi_tracer.ray import Ray
from taichi_tracer.system import memory, runtime
from taichi_tracer.system.blocks import in_own_block

TILE_BITS = LANE_BITS // 2
TILE = 1 << TILE_BITS  # TILE × TILE pixels form a group of sixteen
SIDE_BITS = 1
SIDE = 1 << SIDE_BITS  # SIDE × SIDE groups form a packet
GROUP_BITS = 2 * SIDE_BITS
GROUPS = 1 << GROUP_BITS


@ti.func
def slab(to_near, to_far, low, high, t_near, t_far):
    """One axis of ``box_interval`` for all rays with 1/d between ``low`` and ``high``.

    The result contains the interval of each of these rays. ``to_near`` and ``to_far`` are the planes as seen from the
    moved origins. All may be vectors, with a lane for each of several boxes.
    """
    near, far = smaller(to_near * low, to_near * high), larger(to_far * low, to_far * high)
    return larger(near, t_near), smaller(far, t_far)


@ti.func
def smaller_axes(heading):
    """The axes x, y, z of the sheared coordinates: the two smaller axes of the directions, and the largest axis."""
    z = heading >> 3
    return ti.select(z == 2, 0, z + 1), ti.select(z == 0, 2, z - 1), z


@ti.func
def heading_signs(heading):
    """The sign of the direction along each axis, 1 or −1."""
    signs = tm.vec3(1)
    for k in ti.static(range(3)):
        signs[k] = ti.select((heading >> k) & 1, -1.0, 1.0)
    return signs


@ti.dataclass
class Common:
    """What the rays of one heading have in common.

    heading: the signs of 1/d (bits 0 to 2), and the number of the largest axis (from bit 3 on).
    low, high: for each axis, the smallest and the largest 1/d.
    near_origin, far_origin: for each axis, the extremes of the moved origins of ``RayBounds``: the one that reaches a
    plane first, and the one that reaches it last.
    origin: the common origin, if there is one. sheared_origin: the same in the order of ``smaller_axes``.
    """

    heading: ti.i32
    low: tm.vec3
    high: tm.vec3
    near_origin: tm.vec3
    far_origin: tm.vec3
    origin: tm.vec3
    sheared_origin: tm.vec3


@ti.data_oriented
class Packets:
    """Memory for the packets that are being traced: their rays, and the nearest hits so far. A place holds one packet.

    Fields of a group in a place, sixteen lanes each:
        o, n, f: for each axis, the origin, and the origin moved forwards and backwards (``RayBounds``). They exist only
            if the rays do not share their origin.
        d, i: for each axis, the direction and 1/d.
        heading: see ``Common``; −1 after its rays were traced.
        shear_x, shear_y: the shear of the two smaller axes per unit of the largest, see ``triangles.shear_axes``.
        x0 … y2: the vertices of a triangle in sheared coordinates.
        t, triangle_id, u, v: the nearest hit so far.
        reach: t in the lanes of the present heading, −∞ in the other lanes.
        is_undecided: the lanes that a triangle test cannot decide in this precision.
    Fields of a place:
        group_low, group_high: for each axis, the smallest and the largest 1/d of each group.
        near_plane, far_plane: of the boxes of the four triangles of the present block, for each axis, the planes where
            rays enter and leave.
        group_reach: the largest t at which an active ray of each group can still find a nearer hit.
        fetched: its first number is what ``WideBVH.fetch_leaves`` read.

    Args:
        places: the number of packets that can be traced at the same time.
        share_origin: whether all rays of a packet start at one point.
        has_spheres: whether there may be spheres among the primitives.
    """

    def __init__(self, places: int, share_origin: bool = False, has_spheres: bool = False) -> None:
        self.share_origin, self.has_spheres = share_origin, has_spheres
        self._memory = memory.Memory(scratch="Packets")
        self.d, self.i = (ti.Vector.field(LANES, float) for _ in range(2))
        self.shear_x, self.shear_y, self.t, self.u, self.v = (ti.Vector.field(LANES, float) for _ in range(5))
        self.x0, self.x1, self.x2, self.y0, self.y1, self.y2 = (ti.Vector.field(LANES, float) for _ in range(6))
        self.reach = ti.Vector.field(LANES, float)
        self.triangle_id, self.heading, self.is_undecided = (ti.Vector.field(LANES, ti.i32) for _ in range(3))
        self.group_low, self.group_high = (ti.Vector.field(GROUPS, float) for _ in range(2))
        self.group_reach = ti.Vector.field(GROUPS, float)
        self.fetched = ti.Vector.field(LANES - GROUPS, float)
        self.near_plane, self.far_plane = (ti.Vector.field(BLOCK, float) for _ in range(2))
        # LLVM unrolls a loop whose length is a constant, which makes the code much longer. Therefore the lengths are
        # read from memory.
        self.lanes, self.groups, self.axes = (ti.field(ti.i32) for _ in range(3))

        # A vector across the border of two lines of the cache takes two accesses. Therefore vectors of sixteen lanes
        # come first, and everything behind them fills whole lines too: four axes instead of three, and more numbers
        # for ``fetched`` than it needs.
        place = self._memory.fields.dense(ti.i, places)
        group = place.dense(ti.j, GROUPS)
        by_axis = [self.d, self.i]
        if not share_origin:
            self.o, self.n, self.f = (ti.Vector.field(LANES, float) for _ in range(3))
            by_axis += [self.o, self.n, self.f]
        for field in by_axis:
            group.dense(ti.k, 3).place(field)
        # The compiler may combine stores to neighbouring vectors into one that crosses their border, which is slower.
        # Therefore vectors that are stored together do not lie side by side.
        group.place(self.x0, self.shear_x, self.x1, self.shear_y, self.x2, self.t)
        group.place(self.y0, self.u, self.y1, self.v, self.y2, self.reach)
        group.place(self.triangle_id, self.heading, self.is_undecided)
        place.dense(ti.j, 4).place(self.near_plane, self.far_plane, self.group_low, self.group_high)
        place.place(self.group_reach, self.fetched)
        self._memory.fields.place(self.lanes, self.groups, self.axes)
        self._memory.allocate()
        self.lanes[None], self.groups[None], self.axes[None] = LANES, GROUPS, 3
        if has_spheres:
            self.spheres = SphereLanes(places)

    @ti.func
    def put_rays(self, c, g, ox, oy, oz, dx, dy, dz):
        """Put sixteen rays, without hits so far, into a group. A component that all rays share may be one number."""
        if ti.static(not self.share_origin):
            self.o[c, g, 0], self.o[c, g, 1], self.o[c, g, 2] = lanes(ox), lanes(oy), lanes(oz)
        self.d[c, g, 0], self.d[c, g, 1], self.d[c, g, 2] = lanes(dx), lanes(dy), lanes(dz)
        heading = flags(0)
        for k in ti.static(range(3)):
            inverse = 1 / self.d[c, g, k]
            self.i[c, g, k] = inverse
            heading += ti.select(inverse >= 0, 0, 1 << k)
        x, y, z = abs(self.d[c, g, 0]), abs(self.d[c, g, 1]), abs(self.d[c, g, 2])
        self.heading[c, g] = heading + ti.select((x > y) & (x > z), 0, ti.select(y > z, 8, 16))
        self.t[c, g], self.triangle_id[c, g] = lanes(tm.inf), flags(-1)
        self.u[c, g], self.v[c, g] = lanes(0.0), lanes(0.0)

    @ti.func
    @in_own_block(1)
    def next_heading(self, c):
        """A heading whose rays were not traced yet; −1 if there is none."""
        heading = self.heading[c, 0]
        for g in ti.static(range(1, GROUPS)):
            heading = larger(heading, self.heading[c, g])
        return greatest(heading)

    @ti.func
    def take_heading(self, c, heading, origin, intersector: ti.template()):
        """Make the lanes of one heading active and the others inactive. Returns what the active lanes have in common.

        The inactive lanes are computed too, but their reach of −∞ keeps every hit out.
        """
        x, y, z = smaller_axes(heading)
        common = Common(heading=heading, low=tm.vec3(tm.inf), high=tm.vec3(-tm.inf))
        common.origin, common.sheared_origin = origin, tm.vec3(origin[x], origin[y], origin[z])
        for g in range(self.groups[None]):
            is_at_work = self.heading[c, g] == heading
            self.reach[c, g] = ti.select(is_at_work, self.t[c, g], lanes(-tm.inf))
            self.group_reach[c][g] = greatest(self.reach[c, g])
            self.shear_x[c, g] = self.d[c, g, x] / self.d[c, g, z]
            self.shear_y[c, g] = self.d[c, g, y] / self.d[c, g, z]
            for k in range(self.axes[None]):
                low = least(ti.select(is_at_work, self.i[c, g, k], lanes(tm.inf)))
                high = greatest(ti.select(is_at_work, self.i[c, g, k], lanes(-tm.inf)))
                self.group_low[c, k][g], self.group_high[c, k][g] = low, high
                common.low[k], common.high[k] = smaller(low, common.low[k]), larger(high, common.high[k])
        if ti.static(self.share_origin):
            self.move_origin(common, intersector)
        else:
            self.move_origins(c, common, intersector)
        for g in ti.static(range(GROUPS)):
            self.heading[c, g] = ti.select(self.heading[c, g] == heading, -1, self.heading[c, g])
        return common

    @ti.func
    @in_own_block(0)
    def move_origin(self, common: ti.template(), intersector: ti.template()):
        """The moved origins of ``ray_bounds``, for an origin that all rays share."""
        bounds = intersector.ray_bounds(Ray(origin=common.origin, direction=heading_signs(common.heading)))
        common.near_origin, common.far_origin = bounds.near_origin, bounds.far_origin

    @ti.func
    @in_own_block(0)
    def move_origins(self, c, common: ti.template(), intersector: ti.template()):
        """The moved origins of ``ray_bounds`` for each ray, and their extremes."""
        low, high = tm.vec3(intersector.geometry.corners[0]), tm.vec3(intersector.geometry.corners[1])
        signs = heading_signs(common.heading)
        first, last = tm.vec3(-tm.inf), tm.vec3(tm.inf)
        for g in range(self.groups[None]):
            is_at_work = self.heading[c, g] == common.heading
            reach = lanes(0.0)
            for k in ti.static(range(3)):
                o = self.o[c, g, k]
                reach = larger(reach, larger(abs(low[k] - o), abs(high[k] - o)))
            for k in ti.static(range(3)):
                towards = signs[k] * (intersector.pad_factor * (reach + abs(self.o[c, g, k]) / 4))
                self.n[c, g, k] = self.o[c, g, k] + towards
                self.f[c, g, k] = self.o[c, g, k] - towards
                near = ti.select(is_at_work, signs[k] * self.n[c, g, k], lanes(-tm.inf))
                far = ti.select(is_at_work, signs[k] * self.f[c, g, k], lanes(tm.inf))
                first[k], last[k] = larger(first[k], greatest(near)), smaller(last[k], least(far))
        common.near_origin, common.far_origin = signs * first, signs * last

    @ti.func
    def origin(self, c, g, common, axis):
        """A component of the origins: one number if the rays share their origin, otherwise sixteen lanes."""
        if ti.static(self.share_origin):
            return common.origin[axis]
        return self.o[c, g, axis]

    @ti.func
    def moved_origins_of(self, c, g, common, axis):
        """The same component of the origins that were moved forwards, and of those that were moved backwards."""
        if ti.static(self.share_origin):
            return common.near_origin[axis], common.far_origin[axis]
        return self.n[c, g, axis], self.f[c, g, axis]

    @ti.func
    def box_interval(self, c, g, common, i):
        """``box_interval`` of sixteen rays and the box of the primitive at place i of the present block, for any t."""
        lane = i & (BLOCK - 1)
        t_near, t_far = lanes(-tm.inf), lanes(tm.inf)
        for k in ti.static(range(3)):
            near_origin, far_origin = self.moved_origins_of(c, g, common, k)
            near = (self.near_plane[c, k][lane] - near_origin) * self.i[c, g, k]
            far = (self.far_plane[c, k][lane] - far_origin) * self.i[c, g, k]
            t_near, t_far = larger(near, t_near), smaller(far, t_far)
        return t_near, t_far

    @ti.func
    def farthest(self, c):
        """The largest t at which an active ray can still find a nearer hit."""
        return self.group_reach[c].max()

    @ti.func
    def try_leaf(self, c, common, intersector: ti.template(), first, count, t_min):
        """Try each primitive of a leaf with the groups that may meet its box before their farthest hit so far."""
        for b in range((count + BLOCK - 1) >> BLOCK_BITS):
            block, used = (first >> BLOCK_BITS) + b, ti.min(count - (b << BLOCK_BITS), BLOCK)
            mask = self.meetings(c, common, intersector.blocks, block, used, t_min)
            while mask != 0:
                meeting = first_lane(mask)
                mask &= mask - 1
                g, lane = meeting >> BLOCK_BITS, meeting & (BLOCK - 1)
                self.try_primitive(c, g, common, intersector, (block << BLOCK_BITS) + lane, t_min)

    @ti.func
    def meetings(self, c, common, blocks: ti.template(), block, used, t_min):
        """Which groups may meet the boxes of which primitives of a block: ``lanes_of``, four bits for each group.

        All boxes are tested before all triangles, four boxes at a time. At an empty place, a box has no meaning.
        """
        for k in ti.static(range(3)):
            self.find_planes(c, common, blocks, block, k)
        mask = 0
        for g in range(self.groups[None]):
            mask |= (self.boxes_met(c, g, common, t_min) & ((2 << used) - 2)) << (BLOCK * g)
        return mask

    @ti.func
    @in_own_block(0)
    def find_planes(self, c, common, blocks: ti.template(), block, k: ti.template()):
        """Keep the planes of the four boxes of a block, along axis k, through which rays enter and leave."""
        low, high = blocks.extremes(block, k)
        is_forward = (common.heading >> k) & 1 == 0
        self.near_plane[c, k] = ti.select(is_forward, low, high)
        self.far_plane[c, k] = ti.select(is_forward, high, low)

    @ti.func
    @in_own_block(1)
    def boxes_met(self, c, g, common, t_min):
        """``lanes_of`` the boxes between the kept planes that a group may meet, nearer than its own hits."""
        t_near, t_far = ti.Vector([t_min] * BLOCK), ti.Vector([self.group_reach[c][g]] * BLOCK)
        for k in ti.static(range(3)):
            low = ti.Vector([self.group_low[c, k][g]] * BLOCK)
            high = ti.Vector([self.group_high[c, k][g]] * BLOCK)
            to_near = self.near_plane[c, k] - common.near_origin[k]
            to_far = self.far_plane[c, k] - common.far_origin[k]
            t_near, t_far = slab(to_near, to_far, low, high, t_near, t_far)
        return lanes_of(t_near <= t_far)

    @ti.func
    def try_primitive(self, c, g, common, intersector: ti.template(), i, t_min):
        """``try_triangle`` or ``try_sphere``; triangles that rays may pass are tried with one ray at a time."""
        is_special = False
        if ti.static(not intersector.is_plain_geometry):
            is_special = intersector.is_special(intersector.blocks.primitive(i))
            if is_special:
                self.try_special(c, g, common, intersector, i, t_min)
        if not is_special:
            self.try_triangle(c, g, common, intersector, i, t_min)

    @ti.func
    def try_special(self, c, g, common, intersector: ti.template(), i, t_min):
        """Try a sphere with sixteen rays at once, or a triangle that rays may pass with one ray after the other."""
        is_sphere = False
        if ti.static(self.has_spheres):
            is_sphere = intersector.is_sphere(intersector.blocks.primitive(i))
            if is_sphere:
                self.try_sphere(c, g, common, intersector, i, t_min)
        if ti.static(intersector.has_special_triangles or not self.has_spheres):
            if not is_sphere:
                for lane in range(self.lanes[None]):
                    self.try_one(c, g, lane, common, intersector, i, t_min)

    @ti.func
    def try_triangle(self, c, g, common, intersector: ti.template(), i, t_min):
        """``candidate`` of sixteen rays; the result is kept in the lanes where it is the nearest hit so far."""
        is_inside, is_undecided, t, u, v = intersector.solve_packet(self, c, g, common, intersector.blocks, i)
        if any_lane(is_inside):
            triangle_id = intersector.blocks.primitive(i)
            t_near, t_far = self.box_interval(c, g, common, i)
            t = ti.select(t < t_near, t_near, ti.select(t > t_far, t_far, t))
            self.keep(c, g, is_inside & (t_near <= t_far) & (t > t_min), t, triangle_id, u, v)
        if ti.static(runtime.can_widen() and intersector.triangle_test == "watertight"):
            if any_lane(is_undecided):
                self.is_undecided[c, g] = ti.select(is_undecided, flags(1), flags(0))
                for lane in range(self.lanes[None]):
                    if self.is_undecided[c, g][lane] != 0:
                        self.try_one(c, g, lane, common, intersector, i, t_min)

    @ti.func
    def keep(self, c, g, is_met, t, primitive_id, u, v):
        """Keep the hits of sixteen rays on one primitive where they are the nearest so far."""
        reach, best_id = self.reach[c, g], self.triangle_id[c, g]
        taken = is_met & ((t < reach) | ((t == reach) & (primitive_id < best_id)))
        self.reach[c, g] = ti.select(taken, t, reach)
        self.group_reach[c][g] = greatest(self.reach[c, g])
        self.t[c, g] = ti.select(taken, t, self.t[c, g])
        self.triangle_id[c, g] = ti.select(taken, primitive_id, best_id)
        self.u[c, g] = ti.select(taken, u, self.u[c, g])
        self.v[c, g] = ti.select(taken, v, self.v[c, g])

    @ti.func
    def try_sphere(self, c, g, common, intersector: ti.template(), i, t_min):
        """``sphere_candidate`` of sixteen rays; the result is kept in the lanes where it is the nearest hit so far."""
        primitive_id = intersector.blocks.primitive(i)
        centre, radius = intersector.sphere(primitive_id)
        t_near, t_far = self.box_interval(c, g, common, i)
        self.spheres.take(c, self.d[c, g, 0], self.d[c, g, 1], self.d[c, g, 2])
        ox, oy, oz = self.origin(c, g, common, 0), self.origin(c, g, common, 1), self.origin(c, g, common, 2)
        may_meet = self.spheres.may_meet(c, ox, oy, oz, centre, radius, t_near) & (t_near <= t_far)
        if any_lane(may_meet & (t_near <= self.reach[c, g])):
            is_met, entry, exit = self.spheres.solve(c, radius)
            t = sphere_distance(entry, exit, t_near, t_far, t_min)
            self.keep(c, g, is_met & (t_near <= t_far) & (t > t_min), t, primitive_id, lanes(0.0), lanes(0.0))

    @ti.func
    def project(self, c, g, common, blocks: ti.template(), i, corner: ti.template()):
        """A vertex on the plane of the two smaller axes of the rays, sheared along the largest axis (Woop et al.)."""
        kx, ky, kz = smaller_axes(common.heading)
        x, y = blocks.component(i, corner, kx), blocks.component(i, corner, ky)
        z = blocks.component(i, corner, kz)
        if ti.static(self.share_origin):
            x, y, z = x - common.sheared_origin.x, y - common.sheared_origin.y, z - common.sheared_origin.z
            return x - self.shear_x[c, g] * z, y - self.shear_y[c, g] * z
        from_x, from_y, along = x - self.o[c, g, kx], y - self.o[c, g, ky], z - self.o[c, g, kz]
        return from_x - self.shear_x[c, g] * along, from_y - self.shear_y[c, g] * along

    @ti.func
    def try_one(self, c, g, lane, common, intersector: ti.template(), i, t_min):
        """Compute one lane with the plain form: for spheres, and for rays exactly through an edge or a vertex."""
        v0, v1, v2 = intersector.blocks.triangle(i)
        triangle_id = intersector.blocks.primitive(i)
        o, d = common.origin, tm.vec3(0)
        for k in ti.static(range(3)):
            d[k] = self.d[c, g, k][lane]
            if ti.static(not self.share_origin):
                o[k] = self.o[c, g, k][lane]
        ray = Ray(origin=o, direction=d)
        t, u, v = intersector.try_primitive(ray, intersector.ray_bounds(ray), triangle_id, v0, v1, v2, t_min)
        reach = self.reach[c, g][lane]
        if t > t_min and (t < reach or (t == reach and triangle_id < self.triangle_id[c, g][lane])):
            self.reach[c, g][lane], self.t[c, g][lane], self.triangle_id[c, g][lane] = t, t, triangle_id
            self.u[c, g][lane], self.v[c, g][lane] = u, v
            self.group_reach[c][g] = greatest(self.reach[c, g])
