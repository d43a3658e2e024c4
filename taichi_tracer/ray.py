"""Rays, and what they hit, inside kernels."""

from typing import TYPE_CHECKING, Any, TypedDict

import taichi as ti
import taichi.math as tm

from taichi_tracer.system import runtime

# tm.vec3 follows the precision that Taichi runs with. ``float`` in a ti.dataclass does not: it keeps the type that it
# had when this file was imported. Therefore the members take their scalar type from tm.vec3.
real = tm.vec3.dtype

if TYPE_CHECKING:
    from typing_extensions import Unpack

    class Members(TypedDict, total=False):
        """The members of ``HitData``, as editors know them; those that are not given are 0."""

        is_hit: Any
        is_backfacing: Any
        triangle_id: Any
        distance: Any
        barycentric_coords: Any
        normal: Any
        material_id: Any
        geometric_normal: Any
        position: Any
        position_error: Any


@ti.dataclass
class Ray:
    """r(t) = origin + t direction (A1-10). The direction may have any length except 0; t is in units of that length."""

    origin: tm.vec3
    direction: tm.vec3

    if TYPE_CHECKING:  # what ti.dataclass adds, for editors

        def __init__(self, origin: Any = 0, direction: Any = 0) -> None: ...

    @ti.func
    def at(self, t):
        """The point r(t)."""
        return self.origin + t * self.direction


@ti.dataclass
class HitData:
    """What a ray hit (A1-12). If ``is_hit`` is 0, the distance is infinite, the ids are −1 and the vectors are 0.

    ``distance`` is t, in units of the direction's length. ``barycentric_coords`` = (u, v) are the weights of v1 and v2;
    the weight of v0 is 1 − u − v. ``normal`` is interpolated from the vertex normals, and ``geometric_normal`` is the
    normal of the triangle's plane (C-17). Both have unit length and face the ray's origin. ``position`` is the point on
    the surface. ``position_error`` bounds the rounding error of each of its components; ``offset_origin`` needs it.

    The first seven members are those of the handout. Your own method may begin with ``hit = HitData()`` and then set
    the handout's members one by one; the package adds the members that are missing. ``triangle_id`` is the number of
    the primitive in the order of the file. Spheres are counted together with the triangles.
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

    if TYPE_CHECKING:  # what ti.dataclass adds, for editors

        def __init__(self, *members: Any, **named: "Unpack[Members]") -> None: ...


@ti.func
def no_hit():
    """The HitData of a ray that hits nothing."""
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
    """``p``, moved along the unit vector n until it certainly lies off its surface (PBR, 4th edition, section 6.8.6).

    The step is the extent of the error bound along n. It is as small as the rounding error of the point, at any scale.
    Then each component is rounded outwards.
    """
    step = tm.dot(abs(n), error)
    moved = p + step * n
    for k in ti.static(range(3)):
        ulp = abs(moved[k]) * ti.static(2 * runtime.epsilon())
        moved[k] += ti.select(n[k] > 0, ulp, ti.select(n[k] < 0, -ulp, 0.0))
    return moved
