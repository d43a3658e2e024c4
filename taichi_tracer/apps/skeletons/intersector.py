"""An intersector: what a ray hits."""

import taichi as ti
import taichi.math as tm

import taichi_tracer as tt


@tt.register
class Mine(tt.RayIntersector):
    """One triangle by the method of Möller and Trumbore; the search over all triangles is that of the base class.

    ``query_ray(self, ray)`` may be written, too. ``ray`` has ``origin`` and ``direction``, of any length, in world
    space. ``self.geometry`` has the arrays of the mesh, whose ids count from 0.
    """

    name = "mine"

    @ti.func
    def intersect_triangle(self, ray, triangle_id):
        """The tt.HitData of the ray on one triangle; ``is_hit`` is 0 where it misses, or lies behind the origin."""
        hit = tt.no_hit()
        ids = self.geometry.triangle_vertex_ids[triangle_id]
        v0, v1, v2 = self.geometry.vertices[ids[0]], self.geometry.vertices[ids[1]], self.geometry.vertices[ids[2]]
        e1, e2, s = v1 - v0, v2 - v0, ray.origin - v0
        det = tm.dot(e1, tm.cross(ray.direction, e2))
        u = tm.dot(s, tm.cross(ray.direction, e2)) / det
        v = tm.dot(ray.direction, tm.cross(s, e1)) / det
        t = tm.dot(e2, tm.cross(s, e1)) / det
        if u >= 0 and v >= 0 and u + v <= 1 and t > 0:
            n = tm.normalize(tm.cross(e1, e2))
            hit.is_hit, hit.is_backfacing, hit.triangle_id, hit.distance = 1, ti.cast(det < 0, ti.i32), triangle_id, t
            hit.barycentric_coords, hit.normal = tm.vec2(u, v), ti.select(det < 0, -n, n)
            hit.material_id = self.geometry.triangle_material_ids[triangle_id]
        return hit
