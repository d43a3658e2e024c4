"""Assignment a3 as student three writes it."""

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
        a = v1 - v0
        b = v2 - v0
        x = a.y * b.z - a.z * b.y
        y = a.z * b.x - a.x * b.z
        z = a.x * b.y - a.y * b.x
        return 0.5 * ti.sqrt(x * x + y * y + z * z)

    @ti.kernel
    def compute_cdf(self):
        for i in self.cdf:
            below = ti.cast(0.0, ti.f64)
            for j in range(self.n_emissive_triangles):
                if j <= i:
                    below += self.areas[j]
            self.cdf[i] = ti.cast(below / self.total_area, ti.f32)

    @ti.func
    def sample_emissive_triangle(self):
        xi, index = ti.random(), 0
        for k in range(self.n_emissive_triangles - 1):
            index += ti.cast(xi >= self.cdf[k], ti.i32)
        return index

    @ti.func
    def evaluate_probability(self):
        i = self.n_emissive_triangles - 1
        before = 0.0
        if i > 0:
            before = self.cdf[i - 1]
        return (self.cdf[i] - before) / self.areas[i]

    @ti.func
    def sample_mesh_lights(self, hit_point):
        triangle_id = self.emissive_triangle_ids[self.sample_emissive_triangle()]
        corners = self.geometry.triangle(triangle_id)
        weights = tm.vec3(1, 1, 1)
        while weights.x + weights.y > 1:
            weights.x = ti.random()
            weights.y = ti.random()
        weights.z = 1 - weights.x - weights.y
        y = tm.vec3(0)
        for k in ti.static(range(3)):
            y += weights[k] * corners[k]
        return tm.normalize(y - hit_point), triangle_id


class EnvironmentSampler:
    def compute_probabilities(self, image):
        image = image.astype(np.float32)
        height = image.shape[0]
        luminance = np.einsum("ijk,k->ij", image, np.array([0.2126, 0.7152, 0.0722], np.float32))
        theta = ((np.arange(height) + 0.5) / height * np.pi).astype(np.float32)
        weights = luminance * np.sin(theta)[:, np.newaxis]
        return weights * (1 / weights.sum())

    def evaluate_density(self, probabilities):
        height, width = probabilities.shape
        theta = np.float32(np.pi) * (np.arange(height, dtype=np.float32) + np.float32(0.5)) / np.float32(height)
        area = np.float32(2 * np.pi**2 / (width * height)) * np.sin(theta)
        return (probabilities.astype(np.float32).T / area).T


@ti.data_oriented
class Environment(tt.Environment):
    @ti.kernel
    def precompute_scalar(self):
        for x, y in self.image_scalar:
            theta = tm.pi - tm.pi * (y + 0.5) / self.y_resolution
            r, g, b = self.image[x, y].r, self.image[x, y].g, self.image[x, y].b
            self.image_scalar[x, y] = 10 * tm.sin(theta) * (0.2126 * r + 0.7152 * g + 0.0722 * b)

    @ti.func
    def importance_sample_envmap(self):
        xi = tm.vec2(ti.random(), ti.random())
        texel = ti.Vector([0, 0])
        for y in range(self.y_resolution - 1):
            texel.y += int(self.cdf_ptheta[y] <= xi.y)
        for x in range(self.x_resolution - 1):
            texel.x += int(self.cdf_p_phi_given_theta[x, texel.y] <= xi.x)
        return (texel + tm.vec2(ti.random(), ti.random())) / ti.Vector([self.x_resolution, self.y_resolution])


@ti.data_oriented
class A3Renderer(tt.A3Renderer):
    @ti.func
    def to_solid_angle(self, pdf_area, distance, cos_light):
        geometry = ti.abs(cos_light) / distance / distance
        return pdf_area / geometry

    @ti.func
    def power_heuristic(self, pdf, other_pdf):
        total = pdf + other_pdf
        p, q = pdf / total, other_pdf / total
        return p * p / (p * p + q * q)

    @ti.func
    def shade_ray(self, ray):
        total = tm.vec3(0)
        hit = self.scene_data.ray_intersector.query_ray(ray)
        if hit.is_hit:
            total += self.emitted(hit)
            m = self.scene_data.material_library.materials[hit.material_id]
            x = offset_origin(hit.position, hit.position_error, hit.normal)
            for strategy in ti.static(range(2)):
                if ti.static(strategy == 0 or self.active.name != "environment"):
                    w_i, chosen = self.scene_data.lamps.choice.sample_mesh_lights(x)
                    if ti.static(strategy == 1):
                        w_i = tt.BRDF.sample_direction(m, -ray.direction, hit.normal)
                    y = self.scene_data.ray_intersector.query_ray(tt.Ray(origin=x, direction=w_i))
                    is_found = y.is_hit
                    if ti.static(strategy == 0):
                        is_found = is_found and y.triangle_id == chosen
                    cosine = tm.dot(hit.normal, w_i)
                    if is_found and cosine > 0:
                        p_area = self.scene_data.lamps.choice.evaluate_probability()
                        pdf = tm.vec2(0, 0)
                        pdf[0] = self.to_solid_angle(p_area, y.distance, ti.max(tm.dot(y.normal, -w_i), 1e-6))
                        pdf[1] = tt.BRDF.evaluate_probability(m, -ray.direction, w_i, hit.normal)
                        weight = 1.0
                        if ti.static(self.active.name != "environment"):
                            weight = self.power_heuristic(pdf[strategy], pdf[1 - strategy])
                        f_r = tt.BRDF.evaluate_brdf(m, -ray.direction, w_i, hit.normal)
                        if pdf[strategy] > 0:
                            total += weight * cosine * f_r * self.emitted(y) / pdf[strategy]
        return total
