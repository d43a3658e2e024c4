"""Where a ray is inside a box whose sides are parallel to the axes: the slab test, made safe against rounding."""

import taichi as ti
import taichi.math as tm


@ti.dataclass
class RayBounds:
    """A ray prepared for boxes: reciprocal direction, and the origin moved towards and away from where it goes.

    Moving it by ``pad`` both ways widens every box by the rounding error of a triangle test on this ray, so that no box
    is missed whose triangle is hit.
    """

    inverse: tm.vec3
    near_origin: tm.vec3
    far_origin: tm.vec3


@ti.func
def box_interval(bounds, low, high, t_near, t_far):
    """The part of [t_near, t_far] in which the ray is in the box, empty when the first exceeds the second.

    Slabs by the sign of 1/d, not of d, because of −0; a NaN (0 · ∞, a ray in the plane of a face) changes nothing.
    Each operation is monotonic: a box within another has an interval within the other's, to the last bit.
    """
    for k in ti.static(range(3)):
        is_forward = bounds.inverse[k] >= 0
        near = (ti.select(is_forward, low[k], high[k]) - bounds.near_origin[k]) * bounds.inverse[k]
        far = (ti.select(is_forward, high[k], low[k]) - bounds.far_origin[k]) * bounds.inverse[k]
        t_near = ti.select(near > t_near, near, t_near)
        t_far = ti.select(far < t_far, far, t_far)
    return t_near, t_far
