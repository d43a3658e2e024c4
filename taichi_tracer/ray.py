"""Rays and what they hit, inside kernels."""

import taichi as ti
import taichi.math as tm

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
    (C-17); both have unit length and face the ray's origin.
    """

    is_hit: ti.i32
    is_backfacing: ti.i32
    triangle_id: ti.i32
    distance: real
    barycentric_coords: tm.vec2
    normal: tm.vec3
    geometric_normal: tm.vec3
    material_id: ti.i32
