"""Sixteen rays at once: the plain form's arithmetic, lane by lane, for rays that go almost the same way.

The formulas are those of ``ray_intersector`` with sixteen lanes in place of one number and the same order of
operations, so that both forms give the same bits. Conditions become ``select``, and results are stored in memory as
sixteen neighbours: that is how a CPU's compiler sees that one vector instruction will do (Wald et al., "Interactive
rendering with coherent ray tracing", 2001).

What the rays have in common is taken out of the lanes: a packet works on the lanes of one *heading* at a time, which
have the same signs and the same largest component of their directions. Most packets have one heading.
"""

import taichi as ti
import taichi.math as tm

from taichi_tracer import runtime
from taichi_tracer.ray import Ray
from taichi_tracer.ray_intersector import stable_normal

TILE_BITS = 2
TILE = 1 << TILE_BITS  # a packet is a tile of TILE × TILE pixels
LANES = TILE * TILE

lanes = ti.types.vector(LANES, float)


@ti.func
def larger(a, b):
    """max, in the form that stays packed."""
    return ti.select(a > b, a, b)


@ti.func
def smaller(a, b):
    """min, in the form that stays packed."""
    return ti.select(a < b, a, b)


@ti.func
def any_lane(condition):
    """Whether a condition holds in any lane: a chain of ``|``, which becomes one test of a mask register."""
    found = condition[0]
    for k in ti.static(range(1, LANES)):
        found = found | condition[k]
    return found


@ti.dataclass
class CommonBounds:
    """What the rays of one heading have in common (Boulos et al., "Interactive distribution ray tracing", 2006).

    low, high: the smallest and largest 1/d on each axis. near_origin, far_origin: of the origins in ``RayBounds``,
    those of the rays that come first to a plane and that leave it last.
    """

    low: tm.vec3
    high: tm.vec3
    near_origin: tm.vec3
    far_origin: tm.vec3


@ti.data_oriented
class Packets:
    """Places for packets at work, each of sixteen rays and their nearest hits so far.

    Fields of one place, of sixteen lanes each:
        o, d, i, n, f: by axis, origin, direction, 1/d, and the origin moved towards and away from the goal
            (``RayBounds``).
        shear_x, shear_y: what the two smaller axes lose per unit of the largest, see ``ray_intersector.shear_axes``.
        heading: the signs of 1/d (bits 0 to 2) and the largest axis (from bit 3).
        t, triangle_id, u, v: the nearest hit. reach: t in the lanes of the heading at work, −∞ in the others.
        is_undecided: lanes that a triangle test in this precision cannot decide.
    """

    def __init__(self, places: int) -> None:
        self._memory = runtime.Memory()
        self.o, self.d, self.i, self.n, self.f = (ti.Vector.field(LANES, float) for _ in range(5))
        self.shear_x, self.shear_y, self.t, self.u, self.v = (ti.Vector.field(LANES, float) for _ in range(5))
        self.reach = ti.Vector.field(LANES, float)
        self.triangle_id, self.heading, self.is_undecided = (ti.Vector.field(LANES, ti.i32) for _ in range(3))
        self.count = ti.field(ti.i32)  # LANES, in memory: the compiler copies a loop out that it can count
        self._memory.fields.place(self.count)
        place = self._memory.fields.dense(ti.i, places)
        for by_axis in (self.o, self.d, self.i, self.n, self.f):
            place.dense(ti.j, 3).place(by_axis)
        place.place(self.shear_x, self.shear_y, self.t, self.u, self.v, self.reach)
        place.place(self.triangle_id, self.heading, self.is_undecided)
        self._memory.allocate()
        self.count[None] = LANES

    @ti.func
    def put_rays(self, c, ox, oy, oz, dx, dy, dz):
        """Sixteen rays; what they have in common may be one number."""
        self.o[c, 0], self.o[c, 1], self.o[c, 2] = lanes(ox), lanes(oy), lanes(oz)
        self.d[c, 0], self.d[c, 1], self.d[c, 2] = lanes(dx), lanes(dy), lanes(dz)

    @ti.func
    def prepare(self, c, low, high, pad_factor, t_max):
        """What ``ray_bounds`` and ``shear_axes`` compute; no hit so far."""
        reach = lanes(0.0)
        for k in ti.static(range(3)):
            reach = larger(reach, larger(abs(low[k] - self.o[c, k]), abs(high[k] - self.o[c, k])))
        heading = ti.Vector([0] * LANES)
        for k in ti.static(range(3)):
            inverse = 1 / self.d[c, k]
            is_forward = inverse >= 0
            pad = pad_factor * (reach + abs(self.o[c, k]) / 4)
            towards = ti.select(is_forward, pad, -pad)
            self.i[c, k] = inverse
            self.n[c, k] = self.o[c, k] + towards
            self.f[c, k] = self.o[c, k] - towards
            heading += ti.select(is_forward, 0, 1 << k)

        dx, dy, dz = self.d[c, 0], self.d[c, 1], self.d[c, 2]
        is_x = (abs(dx) > abs(dy)) & (abs(dx) > abs(dz))
        is_y = abs(dy) > abs(dz)
        self.heading[c] = heading + ti.select(is_x, 0, ti.select(is_y, 8, 16))
        self.shear_x[c] = ti.select(is_x, dy / dx, ti.select(is_y, dz / dy, dx / dz))
        self.shear_y[c] = ti.select(is_x, dz / dx, ti.select(is_y, dx / dy, dy / dz))

        self.t[c] = lanes(t_max)
        self.triangle_id[c] = ti.Vector([-1] * LANES)
        self.u[c] = lanes(0.0)
        self.v[c] = lanes(0.0)

    @ti.func
    def take_heading(self, c, heading):
        """Let the lanes of one heading work, and the others wait."""
        self.reach[c] = ti.select(self.heading[c] == heading, self.t[c], lanes(-tm.inf))

    @ti.func
    def box_interval(self, c, near_corner, far_corner, t_near, t_far):
        """``box_interval`` of sixteen rays, from the corners where rays of this heading come in and go out."""
        for k in ti.static(range(3)):
            near = (near_corner[k] - self.n[c, k]) * self.i[c, k]
            far = (far_corner[k] - self.f[c, k]) * self.i[c, k]
            t_near = ti.select(near > t_near, near, t_near)
            t_far = ti.select(far < t_far, far, t_far)
        return t_near, t_far

    @ti.func
    def common_bounds(self, c, heading):
        """What holds for all rays at work, for ``box_interval_of_all``: extremes of 1/d and of the moved origins."""
        low, high = tm.vec3(tm.inf), tm.vec3(-tm.inf)
        near_origin, far_origin = tm.vec3(tm.inf), tm.vec3(tm.inf)
        sign = tm.vec3(0)
        for k in ti.static(range(3)):
            sign[k] = ti.select((heading >> k) & 1, 1, -1)
        for lane in range(self.count[None]):
            if self.heading[c][lane] == heading:
                for k in ti.static(range(3)):
                    low[k] = smaller(self.i[c, k][lane], low[k])
                    high[k] = larger(self.i[c, k][lane], high[k])
                    near_origin[k] = smaller(sign[k] * self.n[c, k][lane], near_origin[k])
                    far_origin[k] = smaller(-sign[k] * self.f[c, k][lane], far_origin[k])
        return CommonBounds(low=low, high=high, near_origin=sign * near_origin, far_origin=-sign * far_origin)

    @ti.func
    def farthest(self, c):
        """The largest t at which a ray at work can still find a nearer hit."""
        farthest = -tm.inf
        for lane in range(self.count[None]):
            farthest = larger(self.reach[c][lane], farthest)
        return farthest

    @ti.func
    def try_primitive(self, c, heading, intersector: ti.template(), v0, v1, v2, triangle_id, t_min):
        """``try_triangle``; spheres, and triangles with one side, are met by one ray at a time."""
        if ti.static(intersector.geometry.is_plain):
            self.try_triangle(c, heading, intersector, v0, v1, v2, triangle_id, t_min)
        elif intersector.geometry.is_special(triangle_id):
            for lane in range(self.count[None]):
                self.try_one(c, lane, intersector, v0, v1, v2, triangle_id, t_min)
        else:
            self.try_triangle(c, heading, intersector, v0, v1, v2, triangle_id, t_min)

    @ti.func
    def try_triangle(self, c, heading, intersector: ti.template(), v0, v1, v2, triangle_id, t_min):
        """``candidate`` of sixteen rays, and its acceptance: keep it in the lanes where it is the nearest."""
        is_inside, is_undecided, t, u, v = intersector.solve_packet(self, c, heading, v0, v1, v2)
        if any_lane(is_inside):
            low, high = ti.min(v0, v1, v2), ti.max(v0, v1, v2)
            for k in ti.static(range(3)):
                if (heading >> k) & 1:
                    low[k], high[k] = high[k], low[k]
            t_near, t_far = self.box_interval(c, low, high, lanes(-tm.inf), lanes(tm.inf))
            t = ti.select(t < t_near, t_near, ti.select(t > t_far, t_far, t))
            reach, best_id = self.reach[c], self.triangle_id[c]
            is_nearer = (t < reach) | ((t == reach) & (triangle_id < best_id))
            taken = is_inside & (t_near <= t_far) & (t > t_min) & is_nearer
            self.reach[c] = ti.select(taken, t, reach)
            self.t[c] = ti.select(taken, t, self.t[c])
            self.triangle_id[c] = ti.select(taken, triangle_id, best_id)
            self.u[c] = ti.select(taken, u, self.u[c])
            self.v[c] = ti.select(taken, v, self.v[c])
        if ti.static(runtime.can_widen() and intersector.triangle_test == "watertight"):
            if any_lane(is_undecided):
                self.is_undecided[c] = ti.select(is_undecided, ti.Vector([1] * LANES), ti.Vector([0] * LANES))
                for lane in range(self.count[None]):
                    if self.is_undecided[c][lane] != 0:
                        self.try_one(c, lane, intersector, v0, v1, v2, triangle_id, t_min)

    @ti.func
    def project(self, c, heading, vertex):
        """A vertex on the plane of the two smaller axes of the rays, sheared along the largest (Woop et al.)."""
        kz = heading >> 3
        kx, ky = ti.select(kz == 2, 0, kz + 1), ti.select(kz == 0, 2, kz - 1)
        x = ti.select(kz == 2, vertex.x, ti.select(kz == 0, vertex.y, vertex.z))
        y = ti.select(kz == 1, vertex.x, ti.select(kz == 2, vertex.y, vertex.z))
        z = ti.select(kz == 0, vertex.x, ti.select(kz == 1, vertex.y, vertex.z))
        along = z - self.o[c, kz]
        return (x - self.o[c, kx]) - self.shear_x[c] * along, (y - self.o[c, ky]) - self.shear_y[c] * along

    @ti.func
    def try_one(self, c, lane, intersector: ti.template(), v0, v1, v2, triangle_id, t_min):
        """One lane by the plain form: for a sphere, and for a ray that passes a vertex or an edge exactly."""
        o, d = tm.vec3(0), tm.vec3(0)
        for k in ti.static(range(3)):
            o[k], d[k] = self.o[c, k][lane], self.d[c, k][lane]
        ray = Ray(origin=o, direction=d)
        t, u, v = -tm.inf, 0.0, 0.0
        if ti.static(intersector.geometry.is_plain):
            t, u, v = intersector.candidate(ray, intersector.ray_bounds(ray), v0, v1, v2)
        else:
            t, u, v = intersector.candidate_of(ray, intersector.ray_bounds(ray), triangle_id, v0, v1, v2, t_min)
        reach = self.reach[c][lane]
        if t > t_min and (t < reach or (t == reach and triangle_id < self.triangle_id[c][lane])):
            self.reach[c][lane], self.t[c][lane], self.triangle_id[c][lane] = t, t, triangle_id
            self.u[c][lane], self.v[c][lane] = u, v


@ti.func
def packet_watertight(p: ti.template(), c, heading, v0, v1, v2):
    """``watertight`` of sixteen rays on one triangle: (is_inside, is_undecided, t, u, v), each of sixteen lanes.

    Undecided are the lanes with an edge function of exactly 0, which the plain form computes in f64.
    """
    ax, ay = p.project(c, heading, v0)
    bx, by = p.project(c, heading, v1)
    cx, cy = p.project(c, heading, v2)

    u_edge = cx * by - cy * bx
    v_edge = ax * cy - ay * cx
    w_edge = bx * ay - by * ax
    lowest = smaller(u_edge, smaller(v_edge, w_edge))
    highest = larger(u_edge, larger(v_edge, w_edge))
    is_inside = (lowest >= 0) | (highest <= 0)
    is_undecided = lowest > highest  # in no lane
    if ti.static(runtime.can_widen()):
        is_undecided = (u_edge == 0) | (v_edge == 0) | (w_edge == 0)
        is_inside = is_inside & (u_edge != 0) & (v_edge != 0) & (w_edge != 0)

    t, u, v = lanes(0.0), lanes(0.0), lanes(0.0)
    if any_lane(is_inside):
        total = u_edge + v_edge + w_edge
        n = stable_normal(v0, v1, v2)
        det = -(p.d[c, 0] * n.x + p.d[c, 1] * n.y + p.d[c, 2] * n.z)
        t = -((v0.x - p.o[c, 0]) * n.x + (v0.y - p.o[c, 1]) * n.y + (v0.z - p.o[c, 2]) * n.z) / det
        u, v = v_edge / total, w_edge / total
        is_inside = is_inside & (total != 0) & (det != 0)
    return is_inside, is_undecided, t, u, v


@ti.func
def packet_moller_trumbore(p: ti.template(), c, heading, v0, v1, v2):
    """``moller_trumbore`` of sixteen rays on one triangle; what it returns is as for ``packet_watertight``."""
    e1 = v1 - v0
    e2 = v2 - v0
    dx, dy, dz = p.d[c, 0], p.d[c, 1], p.d[c, 2]
    sx, sy, sz = p.o[c, 0] - v0.x, p.o[c, 1] - v0.y, p.o[c, 2] - v0.z
    # d × e2 and s × e1
    px, py, pz = dy * e2.z - dz * e2.y, dz * e2.x - dx * e2.z, dx * e2.y - dy * e2.x
    qx, qy, qz = sy * e1.z - sz * e1.y, sz * e1.x - sx * e1.z, sx * e1.y - sy * e1.x

    det = e1.x * px + e1.y * py + e1.z * pz
    u = (sx * px + sy * py + sz * pz) / det
    v = (dx * qx + dy * qy + dz * qz) / det
    t = (e2.x * qx + e2.y * qy + e2.z * qz) / det

    is_inside = (u >= 0) & (v >= 0) & (u + v <= 1) & (det != 0)
    return is_inside, det != det, t, u, v


PACKET_TESTS = {"watertight": packet_watertight, "moller_trumbore": packet_moller_trumbore}
