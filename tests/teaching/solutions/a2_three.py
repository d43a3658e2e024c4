"""Assignment a2 as student three writes it."""

import taichi as ti
import taichi.math as tm
from sampler import UniformSampler

import taichi_tracer as tt


@ti.data_oriented
class A2Renderer(tt.A2Renderer):
    @ti.func
    def running_mean(self, mean, sample, count):
        return mean * (count / (count + 1)) + sample / (count + 1)

    @ti.func
    def shade_ray(self, ray):
        scene = self.scene_data
        light = scene.environment.query_ray(ray)
        hit = scene.ray_intersector.query_ray(ray)
        if hit.is_hit:
            light = tm.vec3(0)
            material = scene.material_library.materials[hit.material_id]
            direction = UniformSampler.sample_direction()
            pdf = UniformSampler.evaluate_probability()
            if ti.static(self.active.name != "uniform"):
                direction = BRDF.sample_direction(material, -ray.direction, hit.normal)
                pdf = BRDF.evaluate_probability(material, -ray.direction, direction, hit.normal)
            cosine = tm.dot(hit.normal, direction)
            if cosine > 0 and pdf > 0:
                f = BRDF.evaluate_brdf(material, -ray.direction, direction, hit.normal)
                shadow = tt.Ray(hit.position + 1e-4 * hit.normal, direction)
                if not scene.ray_intersector.query_ray(shadow).is_hit:
                    light = scene.environment.query_ray(shadow) * f * cosine / pdf
        return light


@ti.data_oriented
class BRDF(tt.BRDF):
    @staticmethod
    @ti.func
    def sample_direction(material, w_o, normal):
        w_i = normal
        if material.Ns > 1:
            w_r = 2 * tm.dot(normal, w_o) * normal - w_o
            sign = ti.select(w_r.z >= 0, 1.0, -1.0)
            a = -1 / (sign + w_r.z)
            b = w_r.x * w_r.y * a
            t1 = tm.vec3(1 + sign * w_r.x * w_r.x * a, sign * b, -sign * w_r.x)
            t2 = tm.vec3(b, sign + w_r.y * w_r.y * a, -w_r.y)
            z = ti.random() ** (1 / (material.Ns + 1))
            phi = 2 * tm.pi * ti.random()
            w_i = ti.sqrt(1 - z * z) * (ti.cos(phi) * t1 + ti.sin(phi) * t2) + z * w_r
        else:
            z = 2 * ti.random() - 1
            phi = 2 * tm.pi * ti.random()
            r = ti.sqrt(1 - z * z)
            w_i = tm.normalize(normal * 1.000001 + tm.vec3(r * ti.cos(phi), r * ti.sin(phi), z))
        return w_i
