"""The tests of spheres (``formulas.spheres``) and triangles (``formulas.triangles``) for sixteen rays at once.

They have the bits of the plain tests.
"""

import numpy as np
import taichi as ti
import taichi.math as tm

from taichi_tracer.fast.lanes import LANES, any_lane, components, flags, lanes, larger, shared, smaller
from taichi_tracer.formulas.spheres import sphere_normal, widened
from taichi_tracer.formulas.triangles import edge_functions, moller_trumbore, stable_normal, watertight
from taichi_tracer.system import memory, runtime

ROUNDING = 256  # units of rounding, far more than those of a discriminant


@ti.func
def dot(ax, ay, az, bx, by, bz):
    """``tm.dot`` of vectors whose components are lanes."""
    return ax * bx + ay * by + az * bz


@ti.data_oriented
class SphereLanes:
    """``sphere_roots`` for sixteen rays in each place.

    LLVM finds vector instructions only in short chains of operations. Therefore each step is stored. Fields of a place,
    sixteen lanes each, in f64 where there is f64:
        f: for each axis, the origin as seen from the centre. d: w, and size: s, of ``without_overflow``.
        a, b, c: of the quadratic equation. rest: its discriminant. root: the root of a times ``rest``.
        entry, exit: its solutions, in the precision of kernels.

    Args:
        places: the number of groups of rays that can be solved at the same time.
    """

    def __init__(self, places: int) -> None:
        self.divides = not runtime.can_widen()  # as ``without_overflow`` does
        wide = ti.f64 if runtime.has_f64() else float
        self.rounding = float(ROUNDING * np.finfo(np.float64 if runtime.has_f64() else runtime.dtype()).eps)
        self._memory = memory.Memory(scratch="SphereLanes")
        self.f, self.d, self.size, self.a, self.b, self.c = (ti.Vector.field(LANES, wide) for _ in range(6))
        self.rest, self.root = (ti.Vector.field(LANES, wide) for _ in range(2))
        self.entry, self.exit = (ti.Vector.field(LANES, float) for _ in range(2))
        place = self._memory.fields.dense(ti.i, places)
        place.dense(ti.j, 3).place(self.d, self.f)
        # Vectors that are stored together do not lie side by side, see ``packets.Packets``.
        place.place(self.size, self.b, self.entry, self.c, self.a, self.exit, self.rest, self.root)
        self._memory.allocate()

    @ti.func
    def take(self, place, dx, dy, dz):
        """Begin with sixteen rays, which have these directions."""
        self.d[place, 0], self.d[place, 1], self.d[place, 2] = widened(dx), widened(dy), widened(dz)
        if ti.static(self.divides):
            self.size[place] = larger(larger(abs(dx), abs(dy)), abs(dz))
            for axis in ti.static(range(3)):
                self.d[place, axis] = self.d[place, axis] / self.size[place]
        x, y, z = self.d[place, 0], self.d[place, 1], self.d[place, 2]
        self.a[place] = dot(x, y, z, x, y, z)

    @ti.func
    def may_meet(self, place, ox, oy, oz, centre, radius, t_near):
        """Whether the line of each ray may meet a sphere that is not behind the ray. It leaves no such sphere out.

        The discriminant b² − a c has no division, but a larger rounding error. So it may be a little below 0 here. If
        the origin is outside the sphere, and the foot of its centre is behind the origin, both roots are negative.

        Args:
            ox, oy, oz: the origins: sixteen lanes, or three numbers if all rays share their origin.
            t_near: where each ray enters the box of the sphere. A hit is never taken for nearer than that.
        """
        self.f[place, 0] = widened(lanes(ox)) - widened(centre.x)
        self.f[place, 1] = widened(lanes(oy)) - widened(centre.y)
        self.f[place, 2] = widened(lanes(oz)) - widened(centre.z)
        x, y, z = self.f[place, 0], self.f[place, 1], self.f[place, 2]
        wx, wy, wz = self.d[place, 0], self.d[place, 1], self.d[place, 2]
        r = widened(radius)
        self.b[place] = -dot(x, y, z, wx, wy, wz)
        self.c[place] = dot(x, y, z, x, y, z) - r * r
        a, b, c = self.a[place], self.b[place], self.c[place]
        discriminant, size = b * b - a * c, b * b + a * (abs(c) + 2 * (r * r))
        is_missed = discriminant < -self.rounding * size
        is_behind = (c > 0) & (b < 0) & (t_near <= 0)
        return ti.select(is_missed | is_behind, flags(0), flags(1))

    @ti.func
    def solve(self, place, radius):
        """(is_met, t_in, t_out) of ``sphere_roots`` for the sphere of ``may_meet``, in lanes."""
        x, y, z = self.f[place, 0], self.f[place, 1], self.f[place, 2]
        wx, wy, wz = self.d[place, 0], self.d[place, 1], self.d[place, 2]
        r = widened(radius)
        foot = self.b[place] / self.a[place]
        lx, ly, lz = x + foot * wx, y + foot * wy, z + foot * wz
        self.rest[place] = r * r - dot(lx, ly, lz, lx, ly, lz)
        is_met = self.rest[place] >= 0
        self.root[place] = ti.sqrt(self.a[place] * ti.select(is_met, self.rest[place], 0))
        b, root = self.b[place], self.root[place]
        q = ti.select(b >= 0, b + root, b - root)
        t0, t1 = self.c[place] / q, q / self.a[place]
        if ti.static(self.divides):
            t0, t1 = t0 / self.size[place], t1 / self.size[place]
        self.entry[place] = ti.cast(ti.select(t0 < t1, t0, t1), float)
        self.exit[place] = ti.cast(ti.select(t0 < t1, t1, t0), float)
        return is_met, self.entry[place], self.exit[place]


@ti.func
def sphere_normals(ox, oy, oz, dx, dy, dz, centre_x, centre_y, centre_z, radius, t):
    """``sphere_normal`` of sixteen rays: its components, in lanes. So are the arguments."""
    nx, ny, nz = lanes(0.0), lanes(0.0), lanes(0.0)
    for lane in range(LANES):
        o, d = tm.vec3(ox[lane], oy[lane], oz[lane]), tm.vec3(dx[lane], dy[lane], dz[lane])
        centre = tm.vec3(centre_x[lane], centre_y[lane], centre_z[lane])
        n = sphere_normal(widened(o), widened(d), widened(centre), widened(radius[lane]), t[lane])
        nx[lane], ny[lane], nz[lane] = n.x, n.y, n.z
    return nx, ny, nz


@ti.func
def sphere_distance(entry, exit, t_near, t_far, t_min):
    """t of ``RayIntersector.sphere_candidate``, from the entry, the exit, and the interval of the sphere's box."""
    entry = ti.select(entry < t_near, t_near, entry)
    return ti.select(entry > t_min, entry, ti.select(exit > t_far, t_far, exit))


@ti.func
def rays(p: ti.template(), c, g, common):
    """Origins and directions of a group."""
    o = components(p.origin(c, g, common, 0), p.origin(c, g, common, 1), p.origin(c, g, common, 2))
    return o, components(p.d[c, g, 0], p.d[c, g, 1], p.d[c, g, 2])


@ti.func
def packet_watertight(p: ti.template(), c, g, common, blocks: ti.template(), i):
    """``watertight`` of sixteen rays on one triangle: (is_inside, is_undecided, t, u, v), each with sixteen lanes.

    A lane is undecided if one of its edge functions is exactly 0. The plain form computes such lanes in f64.
    """
    p.x0[c, g], p.y0[c, g] = p.project(c, g, common, blocks, i, 0)
    p.x1[c, g], p.y1[c, g] = p.project(c, g, common, blocks, i, 1)
    p.x2[c, g], p.y2[c, g] = p.project(c, g, common, blocks, i, 2)
    u_edge, v_edge, w_edge = edge_functions(p.x0[c, g], p.y0[c, g], p.x1[c, g], p.y1[c, g], p.x2[c, g], p.y2[c, g])
    lowest, highest = smaller(u_edge, smaller(v_edge, w_edge)), larger(u_edge, larger(v_edge, w_edge))
    is_inside = (lowest >= 0) | (highest <= 0)
    is_undecided = lowest > highest  # a vector that is False in every lane
    t, u, v = lanes(0.0), lanes(0.0), lanes(0.0)
    if any_lane(is_inside):
        v0, v1, v2 = blocks.triangle(i)
        total = u_edge + v_edge + w_edge
        o, d = rays(p, c, g, common)
        n = shared(stable_normal(v0, v1, v2))
        det = -tm.dot(d, n)
        t = -tm.dot(shared(v0) - o, n) / det
        u, v = v_edge / total, w_edge / total
        if ti.static(runtime.can_widen()):
            is_undecided = is_inside & ((u_edge == 0) | (v_edge == 0) | (w_edge == 0))
            is_inside = is_inside & (u_edge != 0) & (v_edge != 0) & (w_edge != 0)
        is_inside = is_inside & (total != 0) & (det != 0)
    return is_inside, is_undecided, t, u, v


@ti.func
def packet_moller_trumbore(p: ti.template(), c, g, common, blocks: ti.template(), i):
    """``moller_trumbore`` of sixteen rays on one triangle; it returns the same as ``packet_watertight``."""
    v0, v1, v2 = blocks.triangle(i)
    o, d = rays(p, c, g, common)
    is_inside, t, u, v, det = moller_trumbore(o, d, shared(v0), shared(v1), shared(v2))
    return is_inside & (det != 0), det != det, t, u, v


PACKET_TESTS = {watertight: packet_watertight, moller_trumbore: packet_moller_trumbore}
