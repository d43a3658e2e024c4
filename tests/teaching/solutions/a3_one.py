"""Assignment a3 as student one writes it."""

import numpy as np
import taichi as ti
import taichi.math as tm

import taichi_tracer as tt
from taichi_tracer.ray import offset_origin


@ti.data_oriented
class MeshLightSampler(tt.MeshLightSampler):
    @staticmethod
    @ti.func
    def compute_triangle_area(v0, v1, v2):
        return 0.5 * tm.length(tm.cross(v0 - v2, v1 - v2))

    @ti.kernel
    def compute_cdf(self):
        for i in range(self.n_emissive_triangles):
            total = 0.0
            for j in range(i + 1):
                total += self.areas[j]
            self.cdf[i] = total / self.total_area

    @ti.func
    def sample_emissive_triangle(self):
        xi = ti.random()
        i = 0
        while i < self.n_emissive_triangles - 1 and xi >= self.cdf[i]:
            i += 1
        return i

    @ti.func
    def evaluate_probability(self):
        return 1.0 / self.total_area

    @ti.func
    def sample_mesh_lights(self, hit_point):
        i = self.sample_emissive_triangle()
        triangle = self.emissive_triangle_ids[i]
        a, b, c = self.geometry.triangle(triangle)
        root = ti.sqrt(ti.random())
        v = ti.random()
        point = (1 - root) * a + root * (1 - v) * b + root * v * c
        to_light = point - hit_point
        return to_light / to_light.norm(), triangle


class EnvironmentSampler:
    def compute_probabilities(self, image):
        height, width, _ = image.shape
        weights = np.zeros((height, width))
        for row in range(height):
            for column in range(width):
                r, g, b = image[row, column]
                weights[row, column] = (0.2126 * r + 0.7152 * g + 0.0722 * b) * np.sin(np.pi * (row + 0.5) / height)
        return weights / np.sum(weights)

    def evaluate_density(self, probabilities):
        height, width = probabilities.shape
        density = np.empty((height, width))
        for row in range(height):
            sine = np.sin(np.pi * (row + 0.5) / height)
            density[row] = probabilities[row] * width * height / (2 * np.pi**2 * sine)
        return density


@ti.data_oriented
class Environment(tt.Environment):
    @ti.kernel
    def precompute_scalar(self):
        for x, y in ti.ndrange(self.x_resolution, self.y_resolution):
            c = self.image[x, y]
            latitude = (y + 0.5) / self.y_resolution - 0.5
            self.image_scalar[x, y] = ti.cos(tm.pi * latitude) * (0.2126 * c.r + 0.7152 * c.g + 0.0722 * c.b)

    @ti.func
    def importance_sample_envmap(self):
        u1, u2 = ti.random(), ti.random()
        row, low, high = 0, 0, self.y_resolution - 1
        while low < high:
            middle = (low + high) // 2
            if self.cdf_ptheta[middle] > u1:
                high = middle
            else:
                low = middle + 1
        row = low
        column = 0
        for i in range(self.x_resolution - 1):
            if self.cdf_p_phi_given_theta[i, row] <= u2:
                column = i + 1
        return tm.vec2(column + ti.random(), row + ti.random()) / tm.vec2(self.x_resolution, self.y_resolution)


@ti.data_oriented
class A3Renderer(tt.A3Renderer):
    @ti.func
    def to_solid_angle(self, pdf_area, distance, cos_light):
        d2 = distance * distance
        return pdf_area * d2 * (1.0 / cos_light)

    @ti.func
    def power_heuristic(self, pdf, other_pdf):
        f = pdf * pdf
        g = other_pdf * other_pdf
        return f / (f + g)

    @ti.func
    def shade_ray(self, ray):
        scene = self.scene_data
        colour = tm.vec3(0.0, 0.0, 0.0)
        hit = scene.ray_intersector.query_ray(ray)
        if hit.is_hit:
            colour += self.emitted(hit)
            mat = scene.material_library.materials[hit.material_id]
            n, wo = hit.normal, -ray.direction
            origin = offset_origin(hit.position, hit.position_error, n)
            # the lights
            wi, light_id = scene.lamps.choice.sample_mesh_lights(origin)
            shadow = scene.ray_intersector.query_ray(tt.Ray(origin, wi))
            if shadow.is_hit and shadow.triangle_id == light_id and not shadow.is_backfacing and tm.dot(n, wi) > 0:
                p_area = scene.lamps.choice.evaluate_probability()
                p_light = self.to_solid_angle(p_area, shadow.distance, tm.dot(shadow.normal, -wi))
                light = self.emitted(shadow) * tt.BRDF.evaluate_brdf(mat, wo, wi, n) * tm.dot(n, wi) / p_light
                if ti.static(self.active.name == "mis"):
                    light *= self.power_heuristic(p_light, tt.BRDF.evaluate_probability(mat, wo, wi, n))
                colour += light
            # the BRDF
            if ti.static(self.active.name == "mis"):
                wi = tt.BRDF.sample_direction(mat, wo, n)
                p_brdf = tt.BRDF.evaluate_probability(mat, wo, wi, n)
                found = scene.ray_intersector.query_ray(tt.Ray(origin, wi))
                if found.is_hit and not found.is_backfacing and tm.dot(n, wi) > 0 and p_brdf > 0:
                    p_area = scene.lamps.choice.evaluate_probability()
                    p_light = self.to_solid_angle(p_area, found.distance, tm.dot(found.normal, -wi))
                    light = self.emitted(found) * tt.BRDF.evaluate_brdf(mat, wo, wi, n) * tm.dot(n, wi) / p_brdf
                    colour += light * self.power_heuristic(p_brdf, p_light)
        return colour
