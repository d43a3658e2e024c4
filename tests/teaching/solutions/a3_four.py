"""Assignment a3 as student four writes it."""

import numpy as np
import taichi as ti
import taichi.math as tm

import taichi_tracer as tt


@ti.data_oriented
class MeshLightSampler(tt.MeshLightSampler):
    @staticmethod
    @ti.func
    def compute_triangle_area(v0, v1, v2):
        a, b, c = (v1 - v0).norm(), (v2 - v1).norm(), (v0 - v2).norm()
        longest, shortest = ti.max(a, b, c), ti.min(a, b, c)
        middle = a + b + c - longest - shortest
        product = (longest + (middle + shortest)) * (shortest - (longest - middle))
        product *= (shortest + (longest - middle)) * (longest + (middle - shortest))
        return ti.sqrt(ti.max(product, 0.0)) / 4

    @ti.kernel
    def compute_cdf(self):
        for _ in range(1):
            sum_of_areas = 0.0
            for i in range(self.n_emissive_triangles):
                sum_of_areas += self.areas[i]
                self.cdf[i] = sum_of_areas
            for i in range(self.n_emissive_triangles):
                self.cdf[i] /= sum_of_areas

    @ti.func
    def sample_emissive_triangle(self):
        xi = ti.random()
        first, after = 0, self.n_emissive_triangles
        while after - first > 1:
            half = first + (after - first) // 2
            if self.cdf[half - 1] <= xi:
                first = half
            else:
                after = half
        return first

    @ti.func
    def sample_mesh_lights(self, hit_point):
        index = self.sample_emissive_triangle()
        triangle_id = self.emissive_triangle_ids[index]
        v0, v1, v2 = self.geometry.triangle(triangle_id)
        a, b = ti.random(), ti.random()
        low, high = ti.min(a, b), ti.max(a, b)
        y = low * v0 + (high - low) * v1 + (1 - high) * v2
        d = y - hit_point
        d /= ti.sqrt(d.x * d.x + d.y * d.y + d.z * d.z)
        return d, triangle_id


class EnvironmentSampler:
    def compute_probabilities(self, image):
        height, width = image.shape[:2]
        cos_edges = np.cos(np.pi * np.arange(height + 1) / height)
        solid_angle = cos_edges[:-1] - cos_edges[1:]  # of a row: in proportion to the sine in its middle
        weights = (image * [0.2126, 0.7152, 0.0722]).sum(-1) * solid_angle[:, None]
        return weights / weights.sum()


@ti.data_oriented
class A3Renderer(tt.A3Renderer):
    @ti.func
    def power_heuristic(self, pdf, other_pdf):
        return 1 - other_pdf**2 / (pdf**2 + other_pdf**2)

    @ti.func
    def shade_ray(self, ray):
        radiance = tm.vec3(0)
        hit = self.scene_data.ray_intersector.query_ray(ray)
        if not hit.is_hit:
            pass
        else:
            radiance += self.emitted(hit)
            lights = self.scene_data.lamps.choice
            material = self.scene_data.material_library.materials[hit.material_id]
            w_o = -tm.normalize(ray.direction)
            x = hit.position + 1e-4 * hit.normal
            if ti.static(self.active.name != "environment"):
                w_i = tt.BRDF.sample_direction(material, w_o, hit.normal)
                light_hit = self.scene_data.ray_intersector.query_ray(tt.Ray(origin=x, direction=w_i))
                pdf = tt.BRDF.evaluate_probability(material, w_o, w_i, hit.normal)
                if light_hit.is_hit and self.emitted(light_hit).norm() > 0 and pdf > 0:
                    cos_light = abs(tm.dot(light_hit.normal, w_i))
                    other = self.to_solid_angle(lights.evaluate_probability(), light_hit.distance, cos_light)
                    f = tt.BRDF.evaluate_brdf(material, w_o, w_i, hit.normal) * ti.max(0.0, tm.dot(hit.normal, w_i))
                    radiance += self.power_heuristic(pdf, other) / pdf * f * self.emitted(light_hit)
            w_i, triangle_id = lights.sample_mesh_lights(x)
            light_hit = self.scene_data.ray_intersector.query_ray(tt.Ray(origin=x, direction=w_i))
            is_visible = light_hit.is_hit and light_hit.triangle_id == triangle_id
            cos_light = tm.dot(light_hit.normal, -w_i)
            if is_visible and cos_light > 0:
                pdf = self.to_solid_angle(lights.evaluate_probability(), light_hit.distance, cos_light)
                weight = 1.0
                if ti.static(self.active.name != "environment"):
                    weight = self.power_heuristic(pdf, tt.BRDF.evaluate_probability(material, w_o, w_i, hit.normal))
                f = tt.BRDF.evaluate_brdf(material, w_o, w_i, hit.normal)
                radiance += f * self.emitted(light_hit) * ti.max(tm.dot(w_i, hit.normal), 0.0) * weight / pdf
        return radiance
