"""Assignment a4 as student three writes it."""

import taichi as ti
import taichi.math as tm

import taichi_tracer as tt
from taichi_tracer.ray import offset_origin


@ti.data_oriented
class A4Renderer(tt.A4Renderer):
    @ti.func
    def next_throughput(self, throughput, f_r, cosine, pdf):
        inverse = 1.0 / pdf
        return throughput * inverse * f_r * cosine

    @ti.func
    def play_roulette(self, throughput, q):
        xi = ti.random()
        goes_on = ti.floor(xi + 1 - q)  # 1 with the probability 1 - q
        return throughput * goes_on / (1 - q)

    @ti.func
    def sample_light(self, hit, x, w_o):
        light = tm.vec3(0)
        w_i, lamp = self.scene_data.lamps.choice.sample_mesh_lights(x)
        other = self.scene_data.ray_intersector.query_ray(tt.Ray(x, w_i))
        if other.is_hit:
            if other.triangle_id == lamp:
                to_lamp = other.position - x
                r2 = tm.dot(to_lamp, to_lamp)
                w = to_lamp / ti.sqrt(r2)
                cosines = ti.max(0, tm.dot(hit.normal, w)) * ti.max(0, -tm.dot(other.normal, w))
                material = self.scene_data.material_library.materials[hit.material_id]
                f = tt.BRDF.evaluate_brdf(material, w_o, w_i, hit.normal)
                light = self.emitted(other) * f * cosines / r2 / self.scene_data.lamps.choice.evaluate_probability()
        return light

    @ti.func
    def shade_ray(self, ray):
        radiance = tm.vec3(0)
        throughput = tm.vec3(1)
        current = ray
        hit = self.scene_data.ray_intersector.query_ray(current)
        radiance += self.emitted(hit)
        bounce = 0
        while bounce < self.max_bounces and hit.is_hit and throughput.max() > 0:
            w_o = -current.direction
            material = self.scene_data.material_library.materials[hit.material_id]
            x = offset_origin(hit.position, hit.position_error, hit.normal)
            if ti.static(self.active.name == "explicit"):
                radiance += throughput * self.sample_light(hit, x, w_o)
            w_i = tt.BRDF.sample_direction(material, w_o, hit.normal)
            pdf = tt.BRDF.evaluate_probability(material, w_o, w_i, hit.normal)
            f_r = tt.BRDF.evaluate_brdf(material, w_o, w_i, hit.normal)
            cosine = ti.max(tm.dot(hit.normal, w_i), 0.0)
            if pdf > 0 and cosine > 0:
                throughput = self.next_throughput(throughput, f_r, cosine, pdf)
            else:
                throughput = tm.vec3(0)
            bounce += 1
            if bounce > self.rr_start_bounce:
                throughput = self.play_roulette(throughput, self.rr_termination_probability)
            current = tt.Ray(origin=x, direction=w_i)
            hit = self.scene_data.ray_intersector.query_ray(current)
            if ti.static(self.active.name == "implicit"):
                radiance += throughput * self.emitted(hit)
        return radiance
