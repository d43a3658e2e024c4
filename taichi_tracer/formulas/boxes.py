"""The part of a ray that lies inside an axis-aligned box: the slab test, made safe against rounding."""

import taichi as ti

from taichi_tracer.formulas import vector_math as tm


@ti.dataclass
class RayBounds:
    """A ray prepared for box tests: 1/d, and the origin moved by ``pad`` forwards (near) and backwards (far).

    The two moved origins widen every box by the rounding error of a triangle test on this ray. Therefore the ray never
    misses the box of a triangle that it hits.
    """

    inverse: tm.vec3
    near_origin: tm.vec3
    far_origin: tm.vec3


@ti.func
def box_interval(bounds, low, high, t_near, t_far):
    """The part of [t_near, t_far] in which the ray is inside the box. It is empty if t_near > t_far in the result.

    The sign of 1/d decides which plane of a slab is near. The sign of d would not work, because 0 and −0 are equal. A
    NaN (0 · ∞, for a ray in the plane of a face) leaves the interval unchanged. Every operation is monotonic, also with
    rounding: the interval of a box lies within the interval of every box that contains it.
    """
    is_forward = bounds.inverse >= 0
    near = (ti.select(is_forward, low, high) - bounds.near_origin) * bounds.inverse
    far = (ti.select(is_forward, high, low) - bounds.far_origin) * bounds.inverse
    for k in ti.static(range(3)):
        t_near = ti.select(near[k] > t_near, near[k], t_near)
        t_far = ti.select(far[k] < t_far, far[k], t_far)
    return t_near, t_far


@ti.func
def triangle_interval(bounds, v0, v1, v2):
    """(t_near, t_far) of the ray in the box of a triangle; t_near is larger if the ray misses the box."""
    return box_interval(bounds, ti.min(v0, v1, v2), ti.max(v0, v1, v2), -tm.inf, tm.inf)


@ti.func
def within_box(bounds, t, v0, v1, v2):
    """The t of a ray on a triangle, clamped to the triangle's box; −∞ if the ray misses this box.

    If the triangle's plane is almost parallel to the ray, the quotient t is only rounding noise. The hierarchies use
    the same boxes and the same arithmetic. Therefore they never skip a hit.
    """
    t_near, t_far = triangle_interval(bounds, v0, v1, v2)
    clamped = ti.select(t < t_near, t_near, ti.select(t > t_far, t_far, t))
    return ti.select(t_near <= t_far, clamped, -tm.inf)
