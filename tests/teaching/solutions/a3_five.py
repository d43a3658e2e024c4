"""Assignment a3 as student five writes it."""

import numpy as np
import taichi as ti
import taichi.math as tm

import taichi_tracer as tt
from taichi_tracer.ray import offset_origin


@ti.data_oriented
class MeshLightSampler(tt.MeshLightSampler):
    @ti.func
    def sample_emissive_triangle(self):
        chosen, area = 0, 0.0
        for k in range(self.n_emissive_triangles):
            area += self.areas[k]
            if ti.random() * area < self.areas[k]:
                chosen = k
        return chosen

    @ti.func
    def sample_mesh_lights(self, hit_point):
        triangle_id = self.emissive_triangle_ids[self.sample_emissive_triangle()]
        v0, v1, v2 = self.geometry.triangle(triangle_id)
        weights = -ti.log(1 - tm.vec3(ti.random(), ti.random(), ti.random()))
        weights /= weights.x + weights.y + weights.z
        y = ti.Matrix.cols([v0, v1, v2]) @ weights
        return tm.normalize(y - hit_point), triangle_id


class EnvironmentSampler:
    def evaluate_density(self, probabilities):
        h, w = probabilities.shape
        sines = np.array([np.sin(np.pi * (k + 0.5) / h) for k in range(h)])
        pixels = h * w
        return np.einsum("ij,i->ij", probabilities, pixels / (2 * np.pi * np.pi * sines))


@ti.data_oriented
class A3Renderer(tt.A3Renderer):
    @ti.func
    def to_solid_angle(self, pdf_area, distance, cos_light):
        logarithm = ti.log(pdf_area) + 2 * ti.log(distance) - ti.log(cos_light)
        return ti.exp(logarithm)

    @ti.func
    def power_heuristic(self, pdf, other_pdf):
        weight = 0.0
        if pdf > 0:
            weight = ti.pow(pdf, 2.0) / (ti.pow(pdf, 2.0) + ti.pow(other_pdf, 2.0))
        return weight

    @ti.func
    def shade_ray(self, ray):
        light = tm.vec3(0)
        first = self.scene_data.ray_intersector.query_ray(ray)
        if first.is_hit:
            light = self.emitted(first)
            origin = offset_origin(first.position, first.position_error, first.normal)
            lamp = self.scene_data.lamps.choice
            density = lamp.evaluate_probability()
            direction, id_of_triangle = lamp.sample_mesh_lights(origin)
            for k in range(2):
                shadow_ray = tt.Ray(origin=origin, direction=direction)
                second = self.scene_data.ray_intersector.query_ray(shadow_ray)
                counts = second.is_hit != 0
                if k == 0 and second.triangle_id != id_of_triangle:
                    counts = False
                if k == 1 and ti.static(self.active.name == "environment"):
                    counts = False
                light += counts * self.contribution(ray, first, second, direction, density, k)
                material = self.scene_data.material_library.materials[first.material_id]
                direction = tt.BRDF.sample_direction(material, -ray.direction, first.normal)
        return light

    @ti.func
    def contribution(self, ray, first, second, w_i, density, k):
        value = tm.vec3(0)
        if tm.dot(first.normal, w_i) > 0 and self.emitted(second).max() > 0:
            material = self.scene_data.material_library.materials[first.material_id]
            p0 = self.to_solid_angle(density, second.distance, -tm.dot(second.normal, w_i))
            p1 = tt.BRDF.evaluate_probability(material, -ray.direction, w_i, first.normal)
            f = tt.BRDF.evaluate_brdf(material, -ray.direction, w_i, first.normal)
            value = self.emitted(second) * f * tm.dot(first.normal, w_i)
            if ti.static(self.active.name == "environment"):
                value /= p0
            elif k == 0:
                value *= p0 / (p0 * p0 + p1 * p1)
            else:
                value *= p1 / (p0 * p0 + p1 * p1)
        return value
