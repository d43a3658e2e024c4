"""Assignment a2 as student four writes it."""

import taichi as ti
import taichi.math as tm
from sampler import UniformSampler

import taichi_tracer as tt
from taichi_tracer.ray import offset_origin


@ti.data_oriented
class Camera(tt.Camera):
    @ti.func
    def generate_ray(self, pixel_x, pixel_y, jitter=False):
        c = self.generate_camera_coords(self.generate_ndc_coords(pixel_x, pixel_y, jitter))
        return tt.Ray(origin=self.eye, direction=(self.camera_to_world[None] @ c).xyz.normalized())


@ti.data_oriented
class A2Renderer(tt.A2Renderer):
    @ti.func
    def shade_ray(self, ray):
        radiance = tm.vec3(0)
        hit = self.scene_data.ray_intersector.query_ray(ray)
        if not hit.is_hit:
            radiance = self.scene_data.environment.query_ray(ray)
        else:
            material = self.scene_data.material_library.materials[hit.material_id]
            w_o = -ray.direction
            w_i = tm.vec3(0)
            weight = tm.vec3(0)
            if ti.static(self.active.name == "uniform"):
                w_i = UniformSampler.sample_direction()
                cosine = ti.max(hit.normal.dot(w_i), 0)
                weight = 4 * tm.pi * cosine * BRDF.evaluate_brdf(material, w_o, w_i, hit.normal)
            else:
                w_i = BRDF.sample_direction(material, w_o, hit.normal)
                weight = BRDF.evaluate_brdf_factor(material, w_o, w_i, hit.normal)
            shadow_ray = tt.Ray(offset_origin(hit.position, hit.position_error, hit.normal), w_i)
            if weight.max() > 0 and not self.scene_data.ray_intersector.query_ray(shadow_ray).is_hit:
                radiance = weight * self.scene_data.environment.query_ray(shadow_ray)
        return radiance


@ti.data_oriented
class BRDF(tt.BRDF):
    @staticmethod
    @ti.func
    def evaluate_probability(material, w_o, w_i, normal):
        pdf = tm.max(tm.dot(w_i, normal), 0.0) / tm.pi
        if material.Ns > 1:
            half = ti.max(tm.dot(2 * normal * tm.dot(w_o, normal) - w_o, w_i), 0.0)
            pdf = (1 + material.Ns) * half**material.Ns / 2 / tm.pi
        return pdf

    @staticmethod
    @ti.func
    def evaluate_brdf(material, w_o, w_i, normal):
        w_r = tm.normalize(2 * tm.dot(w_o, normal) * normal - w_o)
        lobe = (material.Ns + 1) / (2 * tm.pi) * ti.pow(ti.max(0.0, w_r.dot(w_i)), material.Ns)
        return material.Kd * ti.select(material.Ns > 1, lobe, 1 / tm.pi)

    @staticmethod
    @ti.func
    def evaluate_brdf_factor(material, w_o, w_i, normal):
        factor = material.Kd
        if material.Ns > 1:
            factor = material.Kd * tm.clamp(normal.dot(w_i), 0.0, 1.0)
        return factor
