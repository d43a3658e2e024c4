"""Assignment 1, part 2: what does a ray hit? The test of one triangle, and the nearest of all triangles."""

import taichi as ti
import taichi.math as tm

import taichi_tracer as tt


@ti.data_oriented
class RayIntersector(tt.BruteForceRayIntersector):
    """Finds what a ray hits.

    In kernels, ``self.geometry`` has the fields of the scene: ``vertices[i]`` and ``normals[i]`` are vec3;
    ``triangle_vertex_ids[triangle_id]`` and ``triangle_normal_ids[triangle_id]`` are three ids, one for each corner;
    ``triangle_material_ids[triangle_id]`` is one id. ``self.geometry.n_triangles`` is the number of triangles.
    """

    @ti.func
    def intersect_triangle(self, ray, triangle_id):
        """The hit of a ray on one triangle (``tt.HitData``), by the test of Möller and Trumbore.

        With the corners v0, v1, v2, and e1 = v1 − v0, e2 = v2 − v0 (``tm.cross`` and ``tm.dot``):

            det = e1 · (d × e2)
            u   = (o − v0) · (d × e2) / det
            v   = d · ((o − v0) × e1) / det
            w   = 1 − u − v
            t   = e2 · ((o − v0) × e1) / det

        The ray hits the triangle if |det| > ε, u ≥ 0, v ≥ 0, u + v ≤ 1 and t > ε, with ε = ``self.EPSILON``. The
        direction d may have any length; t counts in lengths of d. If det < 0, the ray meets the back of the triangle.
        The normal is w n0 + u n1 + v n2, normalised, and turned round if the ray meets the back.

        A hit has seven members to be set: ``is_hit`` (1), ``is_backfacing`` (1 if the ray meets the back), and
        ``triangle_id``, ``distance`` (t), ``barycentric_coords`` (u, v), ``normal`` and ``material_id``.
        """
        hit = tt.no_hit()
        ### BEGIN SOLUTION
        vertex_ids = self.geometry.triangle_vertex_ids[triangle_id]
        v0 = self.geometry.vertices[vertex_ids.x]
        v1 = self.geometry.vertices[vertex_ids.y]
        v2 = self.geometry.vertices[vertex_ids.z]
        o = ray.origin
        d = ray.direction
        e1 = v1 - v0
        e2 = v2 - v0
        det = tm.dot(e1, tm.cross(d, e2))
        if abs(det) > self.EPSILON:
            u = tm.dot(o - v0, tm.cross(d, e2)) / det
            v = tm.dot(d, tm.cross(o - v0, e1)) / det
            t = tm.dot(e2, tm.cross(o - v0, e1)) / det
            w = 1 - u - v
            if u >= 0 and v >= 0 and u + v <= 1 and t > self.EPSILON:
                normal_ids = self.geometry.triangle_normal_ids[triangle_id]
                n0 = self.geometry.normals[normal_ids.x]
                n1 = self.geometry.normals[normal_ids.y]
                n2 = self.geometry.normals[normal_ids.z]
                normal = tm.normalize(w * n0 + u * n1 + v * n2)
                is_backfacing = det < 0
                if is_backfacing:
                    normal = -normal
                hit.is_hit = True
                hit.is_backfacing = is_backfacing
                hit.triangle_id = triangle_id
                hit.distance = t
                hit.barycentric_coords = tm.vec2(u, v)
                hit.normal = normal
                hit.material_id = self.geometry.triangle_material_ids[triangle_id]
        ### END SOLUTION
        return hit

    @ti.func
    def query_ray(self, ray):
        """The nearest hit of a ray (``tt.HitData``); ``tt.no_hit()`` if it hits nothing.

        Call ``self.intersect_triangle(ray, triangle_id)`` for every triangle_id, and keep the hit with the smallest
        distance.
        """
        nearest = tt.no_hit()
        ### BEGIN SOLUTION
        for triangle_id in range(self.geometry.n_triangles):
            hit = self.intersect_triangle(ray, triangle_id)
            if hit.is_hit and hit.distance < nearest.distance:
                nearest = hit
        ### END SOLUTION
        return nearest
