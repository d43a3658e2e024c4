"""A view: a colour for what a ray hit."""

import taichi as ti
import taichi.math as tm

import taichi_tracer as tt


@tt.register
class Mine(tt.View):
    """Bright where the ray meets the surface at a right angle, dark at the edges.

    ``hit`` is a ``tt.HitData``: ``distance`` in units of the ray's direction, ``normal`` and ``geometric_normal`` of
    unit length on the side of the ray's origin, ``barycentric_coords`` (u, v) of v1 and v2, ``position`` in world
    space, ``triangle_id`` and ``material_id`` from 0. A miss is black, and ``color`` is not asked.
    """

    name, label = "mine", "Mine"

    @ti.func
    def color(self, hit):
        """RGB in [0, 1], a vec3."""
        stripe = 0.5 + 0.5 * ti.sin(20 * hit.position.y)
        return tm.mix(abs(hit.normal), tm.vec3(1), 0.3 * stripe)
