"""Assignment a4 as student two writes it."""

import taichi as ti
import taichi.math as tm

import taichi_tracer as tt
from taichi_tracer.ray import offset_origin


@ti.data_oriented
class A4Renderer(tt.A4Renderer):
    @ti.func
    def next_throughput(self, throughput, f_r, cosine, pdf):
        new_throughput = tm.vec3(0)
        for k in ti.static(range(3)):
            new_throughput[k] = throughput[k] * f_r[k] / pdf * cosine
        return new_throughput

    @ti.func
    def play_roulette(self, throughput, q):
        ends = ti.random() < q
        return ti.select(ends, tm.vec3(0), throughput / (1 - q))

    @ti.func
    def sample_light(self, hit, x, w_o):
        choice = self.scene_data.lamps.choice
        w_i, triangle_id = choice.sample_mesh_lights(x)
        seen = self.scene_data.ray_intersector.query_ray(tt.Ray(origin=x, direction=w_i))
        light = tm.vec3(0)
        cosine = tm.dot(hit.normal, w_i)
        if cosine > 0:
            if seen.is_hit and seen.triangle_id == triangle_id and not seen.is_backfacing:
                cos_light = -tm.dot(seen.normal, w_i)
                pdf = choice.evaluate_probability() * seen.distance**2 / cos_light  # per solid angle
                m = self.scene_data.material_library.materials[hit.material_id]
                light = m.Ke * 0 + self.emitted(seen) * tt.BRDF.evaluate_brdf(m, w_o, w_i, hit.normal) * cosine / pdf
        return light

    @ti.func
    def shade_ray(self, ray):
        radiance = tm.vec3(0)
        if ti.static(self.active.name == "implicit"):
            radiance = self.path(ray, True)
        else:
            radiance = self.path(ray, False)
        return radiance

    @ti.func
    def path(self, ray, is_implicit: ti.template()):
        radiance, weight = tm.vec3(0), tm.vec3(1)
        origin, direction = ray.origin, ray.direction
        goes_on = True
        for k in range(self.max_bounces + 1):
            if goes_on:
                hit = self.scene_data.ray_intersector.query_ray(tt.Ray(origin=origin, direction=direction))
                goes_on = hit.is_hit != 0 and k < self.max_bounces
                if hit.is_hit and (is_implicit or k == 0):
                    radiance += weight * self.emitted(hit)
                if goes_on:
                    material = self.scene_data.material_library.materials[hit.material_id]
                    w_o = -direction
                    origin = offset_origin(hit.position, hit.position_error, hit.normal)
                    if ti.static(not is_implicit):
                        radiance += weight * self.sample_light(hit, origin, w_o)
                    direction = tt.BRDF.sample_direction(material, w_o, hit.normal)
                    weight *= tt.BRDF.evaluate_brdf_factor(material, w_o, direction, hit.normal)
                    if k >= self.rr_start_bounce:
                        weight = self.play_roulette(weight, self.rr_termination_probability)
        return radiance
