"""Assignment a1 as student one writes it."""

import taichi as ti
import taichi.math as tm

import taichi_tracer as tt


@ti.data_oriented
class Camera(tt.Camera):
    @ti.func
    def generate_ndc_coords(self, pixel_x, pixel_y):
        u = (pixel_x + 0.5) / self.width
        v = (pixel_y + 0.5) / self.height
        return tm.vec2(-1 + u + u, -1 + v + v)

    @ti.func
    def generate_camera_coords(self, ndc_coords):
        top = ti.sin(self.fov * (tm.pi / 360)) / ti.cos(self.fov * (tm.pi / 360))
        right = top * (self.width / self.height)
        return tm.vec4(right * ndc_coords.x, top * ndc_coords.y, 1.0, 0.0)


@ti.data_oriented
class RayIntersector(tt.BruteForceRayIntersector):
    @ti.func
    def intersect_triangle(self, ray, triangle_id):
        ids = self.geometry.triangle_vertex_ids[triangle_id]
        v0, v1, v2 = self.geometry.vertices[ids[0]], self.geometry.vertices[ids[1]], self.geometry.vertices[ids[2]]
        edge1, edge2 = v1 - v0, v2 - v0
        h = ray.direction.cross(edge2)
        a = edge1.dot(h)
        hit = tt.HitData()
        if a > self.EPSILON or a < -self.EPSILON:
            f = 1.0 / a
            s = ray.origin - v0
            u = f * s.dot(h)
            if 0.0 <= u <= 1.0:
                q = s.cross(edge1)
                v = f * ray.direction.dot(q)
                if v >= 0.0 and u + v <= 1.0:
                    t = f * edge2.dot(q)
                    if t > self.EPSILON:
                        n = self.geometry.triangle_normal_ids[triangle_id]
                        normal = (1 - u - v) * self.geometry.normals[n[0]] + u * self.geometry.normals[n[1]]
                        normal += v * self.geometry.normals[n[2]]
                        hit.is_hit = True
                        hit.is_backfacing = a < 0
                        hit.triangle_id = triangle_id
                        hit.distance = t
                        hit.barycentric_coords = tm.vec2(u, v)
                        hit.normal = normal.normalized() * (1.0 if a > 0 else -1.0)
                        hit.material_id = self.geometry.triangle_material_ids[triangle_id]
        return hit
