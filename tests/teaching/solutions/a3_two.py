"""Assignment a3 as student two writes it."""

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
        e1, e2 = v1 - v0, v2 - v0
        return ti.sqrt(ti.max(e1.dot(e1) * e2.dot(e2) - e1.dot(e2) ** 2, 0.0)) / 2

    @ti.kernel
    def compute_cdf(self):
        self.cdf[0] = self.areas[0] / self.total_area
        ti.loop_config(serialize=True)
        for i in range(1, self.n_emissive_triangles):
            self.cdf[i] = self.cdf[i - 1] + self.areas[i] / self.total_area

    @ti.func
    def sample_emissive_triangle(self):
        xi = ti.random()
        chosen = 0
        for k in range(self.n_emissive_triangles - 1):
            if xi >= self.cdf[k]:
                chosen = k + 1
        return chosen

    @ti.func
    def evaluate_probability(self):
        area = 0.0
        for k in range(self.n_emissive_triangles):
            area += self.areas[k]
        return 1 / area

    @ti.func
    def sample_mesh_lights(self, hit_point):
        triangle_id = self.emissive_triangle_ids[self.sample_emissive_triangle()]
        v0, v1, v2 = self.geometry.triangle(triangle_id)
        s, t = ti.random(), ti.random()
        if s + t > 1.0:
            s, t = 1.0 - s, 1.0 - t
        y = v0 + s * (v1 - v0) + t * (v2 - v0)
        return (y - hit_point).normalized(), triangle_id


class EnvironmentSampler:
    def compute_probabilities(self, image):
        height = image.shape[0]
        red, green, blue = np.moveaxis(image, 2, 0)
        light = 0.2126 * red + 0.7152 * green + 0.0722 * blue
        angles = np.linspace(0.5, height - 0.5, height) * np.pi / height
        light = light * np.sin(angles).reshape(-1, 1)
        return light / light.sum()

    def evaluate_density(self, probabilities):
        height, width = probabilities.shape
        d_phi, d_theta = 2 * np.pi / width, np.pi / height
        rows = (np.arange(height) + 0.5) * d_theta
        return probabilities / (d_phi * d_theta * np.tile(np.sin(rows)[:, None], (1, width)))


@ti.data_oriented
class Environment(tt.Environment):
    @ti.kernel
    def precompute_scalar(self):
        for x in range(self.x_resolution):
            for y in range(self.y_resolution):
                sin_theta = tm.sin((2 * y + 1) * tm.pi / (2 * self.y_resolution))
                self.image_scalar[x, y] = self.image[x, y].dot(tm.vec3([0.2126, 0.7152, 0.0722])) * sin_theta

    @ti.func
    def importance_sample_envmap(self):
        p, q = ti.random(), ti.random()
        y = 0
        while self.cdf_ptheta[y] < p and y + 1 < self.y_resolution:
            p0 = self.cdf_ptheta[y]
            y += 1
        p0 = ti.select(y > 0, self.cdf_ptheta[ti.max(y - 1, 0)], 0.0)
        x = 0
        while self.cdf_p_phi_given_theta[x, y] < q and x + 1 < self.x_resolution:
            x += 1
        q0 = ti.select(x > 0, self.cdf_p_phi_given_theta[ti.max(x - 1, 0), y], 0.0)
        v = y + (p - p0) / (self.cdf_ptheta[y] - p0)
        u = x + (q - q0) / (self.cdf_p_phi_given_theta[x, y] - q0)
        return tm.vec2([u / float(self.x_resolution), v / float(self.y_resolution)])


@ti.data_oriented
class A3Renderer(tt.A3Renderer):
    @ti.func
    def to_solid_angle(self, pdf_area, distance, cos_light):
        return pdf_area / (cos_light / ti.pow(distance, 2))

    @ti.func
    def power_heuristic(self, pdf, other_pdf):
        ratio = other_pdf / pdf
        return 1.0 / (1.0 + ratio * ratio)

    @ti.func
    def shade_ray(self, ray):
        radiance = tm.vec3(0.0)
        hit = self.scene_data.ray_intersector.query_ray(ray)
        if hit.is_hit:
            radiance = self.emitted(hit) + self.from_lights(ray, hit)
            if ti.static(self.active.name != "environment"):
                radiance += self.from_brdf(ray, hit)
        return radiance

    @ti.func
    def from_lights(self, ray, hit):
        result = tm.vec3(0.0)
        material = self.scene_data.material_library.materials[hit.material_id]
        x = offset_origin(hit.position, hit.position_error, hit.normal)
        w_i, triangle_id = self.scene_data.lamps.choice.sample_mesh_lights(x)
        y = self.seen_from(hit, w_i)
        cos_x, cos_y = tm.dot(hit.normal, w_i), -tm.dot(y.normal, w_i)
        if y.is_hit and y.triangle_id == triangle_id and cos_x > 0 and not y.is_backfacing:
            p_area = self.scene_data.lamps.choice.evaluate_probability()
            f_r = tt.BRDF.evaluate_brdf(material, -ray.direction, w_i, hit.normal)
            result = self.emitted(y) * f_r * cos_x * cos_y / (p_area * y.distance**2)
            if ti.static(self.active.name != "environment"):
                q = tt.BRDF.evaluate_probability(material, -ray.direction, w_i, hit.normal)
                result = result * self.power_heuristic(p_area * y.distance**2 / cos_y, q)
        return result

    @ti.func
    def seen_from(self, hit, w_i):
        x = offset_origin(hit.position, hit.position_error, hit.normal)
        return self.scene_data.ray_intersector.query_ray(tt.Ray(origin=x, direction=w_i))

    @ti.func
    def from_brdf(self, ray, hit):
        result = tm.vec3(0.0)
        material = self.scene_data.material_library.materials[hit.material_id]
        w_i = tt.BRDF.sample_direction(material, -ray.direction, hit.normal)
        y = self.seen_from(hit, w_i)
        cos_y = -tm.dot(y.normal, w_i)
        if y.is_hit and not y.is_backfacing and self.emitted(y).sum() > 0:
            q = tt.BRDF.evaluate_probability(material, -ray.direction, w_i, hit.normal)
            p = self.to_solid_angle(self.scene_data.lamps.choice.evaluate_probability(), y.distance, cos_y)
            if q > 0:
                factor = tt.BRDF.evaluate_brdf_factor(material, -ray.direction, w_i, hit.normal)
                result = self.emitted(y) * factor * self.power_heuristic(q, p)
        return result
