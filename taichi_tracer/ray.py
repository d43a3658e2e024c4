"""Rays and what they hit, inside kernels."""

import taichi as ti
import taichi.math as tm

from taichi_tracer.system import runtime

# The scalar type of tm.vec3, which follows the running precision; ``float`` in a dataclass stays what it was on import.
real = tm.vec3.dtype


@ti.dataclass
class Ray:
    """r(t) = origin + t direction (A1-10). A direction of any non-zero length is legal; t counts in units of it."""

    origin: tm.vec3
    direction: tm.vec3

    @ti.func
    def at(self, t):
        """The point r(t)."""
        return self.origin + t * self.direction


@ti.dataclass
class HitData:
    """What a ray met (A1-12). Where ``is_hit`` is 0: distance infinite, ids −1, vectors 0.

    ``distance`` is t, in units of the direction's length. ``barycentric_coords`` = (u, v) weigh v1 and v2, 1 − u − v
    weighs v0. ``normal`` is interpolated from the vertex normals, ``geometric_normal`` is that of the triangle's plane
    (C-17); both have unit length and face the ray's origin. ``position`` is the point on the surface, and
    ``position_error`` a bound of its rounding error by component, for ``offset_origin``.

    The first seven members are the handout's. A method of your own may begin with
    ``hit = HitData()`` and fill in the handout's members one by one: what it leaves out is added.
    ``triangle_id`` is the number of the primitive in the file's order; spheres are counted with the triangles.
    """

    is_hit: ti.i32
    is_backfacing: ti.i32
    triangle_id: ti.i32
    distance: real
    barycentric_coords: tm.vec2
    normal: tm.vec3
    material_id: ti.i32
    geometric_normal: tm.vec3
    position: tm.vec3
    position_error: tm.vec3


@ti.func
def no_hit():
    """HitData of a ray that met nothing."""
    return HitData(
        is_hit=0,
        is_backfacing=0,
        triangle_id=-1,
        distance=tm.inf,
        barycentric_coords=tm.vec2(0),
        normal=tm.vec3(0),
        geometric_normal=tm.vec3(0),
        material_id=-1,
        position=tm.vec3(0),
        position_error=tm.vec3(0),
    )


@ti.func
def offset_origin(p, error, n):
    """``p`` moved along the unit vector n until it lies off its surface for certain (PBR, 4th edition, section 6.8.6).

    The step is the error bound's extent along n, so it is as small as the point's own rounding, at any scale; then each
    component is rounded outwards.
    """
    step = tm.dot(abs(n), error)
    moved = p + step * n
    for k in ti.static(range(3)):
        ulp = abs(moved[k]) * ti.static(2 * runtime.epsilon())
        moved[k] += ti.select(n[k] > 0, ulp, ti.select(n[k] < 0, -ulp, 0.0))
    return moved
