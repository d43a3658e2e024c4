"""Assignment a1 as student five writes it."""

import taichi as ti
import taichi.math as tm
from renderer import id_color

import taichi_tracer as tt


@ti.data_oriented
class Camera(tt.Camera):
    @ti.func
    def generate_ray(self, pixel_x, pixel_y):
        c = self.generate_camera_coords(self.generate_ndc_coords(pixel_x, pixel_y))
        m = self.camera_to_world[None]
        d = tm.vec3(0)
        for k in ti.static(range(3)):
            d[k] = m[k, 0] * c.x + m[k, 1] * c.y + m[k, 2] * c.z
        return tt.Ray(self.eye, d / ti.sqrt(d.x**2 + d.y**2 + d.z**2))


@ti.data_oriented
class RayIntersector(tt.BruteForceRayIntersector):
    @ti.func
    def query_ray(self, ray):
        nearest = tt.no_hit()
        t_min = tm.inf
        triangle = -1
        for i in range(self.geometry.n_triangles):
            hit = self.intersect_triangle(ray, i)
            if hit.is_hit and hit.distance < t_min:
                t_min, triangle = hit.distance, i
        if triangle >= 0:
            nearest = self.intersect_triangle(ray, triangle)
        return nearest


@ti.data_oriented
class A1Renderer(tt.A1Renderer):
    @ti.func
    def shade_barycentric(self, hit_data):
        uv = hit_data.barycentric_coords
        return ti.select(hit_data.is_hit != 0, 1, 0) * tm.vec3(uv, 1 - uv.x - uv.y)

    @ti.func
    def shade_material_id(self, hit_data):
        return hit_data.is_hit * id_color(ti.max(hit_data.material_id, 0))
