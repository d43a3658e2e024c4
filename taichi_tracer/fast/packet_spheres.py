"""The sphere test of ``formulas.spheres`` for sixteen rays at once, with the same bits."""

import numpy as np
import taichi as ti
import taichi.math as tm

from taichi_tracer.fast.lanes import LANES, flags, lanes, larger
from taichi_tracer.formulas.spheres import sphere_normal, widened
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
        self._memory = memory.Memory()
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
