"""Assignment a1 as student three writes it."""

import taichi as ti
import taichi.math as tm

import taichi_tracer as tt


@ti.data_oriented
class Camera(tt.Camera):
    @ti.func
    def generate_ndc_coords(self, pixel_x, pixel_y):
        size = tm.vec2(self.width, self.height)
        return (2 * tm.vec2(pixel_x, pixel_y) + 1 - size) / size


@ti.data_oriented
class RayIntersector(tt.BruteForceRayIntersector):
    @ti.func
    def intersect_triangle(self, ray, triangle_id):
        hit = tt.no_hit()
        v0, v1, v2 = self.geometry.triangle(triangle_id)
        n = tm.cross(v1 - v0, v2 - v0)
        facing = -tm.dot(n, ray.direction)
        if abs(facing) > 1e-9:
            t = tm.dot(ray.origin - v0, n) / facing
            p = ray.origin + t * ray.direction
            area = tm.dot(n, n)
            u = tm.dot(tm.cross(v0 - v2, p - v2), n) / area
            v = tm.dot(tm.cross(v1 - v0, p - v0), n) / area
            w = tm.dot(tm.cross(v2 - v1, p - v1), n) / area
            if t > 0 and ti.min(u, v, w) >= 0:
                ids = self.geometry.triangle_normal_ids[triangle_id]
                normal = w * self.geometry.normals[ids.x] + u * self.geometry.normals[ids.y]
                normal = tm.normalize(normal + v * self.geometry.normals[ids.z])
                hit.is_hit = 1
                hit.is_backfacing = ti.select(facing < 0, 1, 0)
                hit.triangle_id = triangle_id
                hit.distance = t
                hit.barycentric_coords = tm.vec2(u, v)
                hit.normal = ti.select(facing < 0, -normal, normal)
                hit.material_id = self.geometry.triangle_material_ids[triangle_id]
        return hit


@ti.data_oriented
class A1Renderer(tt.A1Renderer):
    @ti.func
    def shade_distance(self, hit_data):
        grey = ti.min(ti.max(hit_data.distance * (1 / self.max_distance), 0), 1)
        return ti.select(hit_data.is_hit, tm.vec3(grey, grey, grey), tm.vec3(0))
