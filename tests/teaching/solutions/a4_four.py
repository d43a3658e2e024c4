"""Assignment a4 as student four writes it."""

import taichi as ti
import taichi.math as tm

import taichi_tracer as tt
from taichi_tracer.ray import offset_origin


@ti.data_oriented
class A4Renderer(tt.A4Renderer):
    @ti.func
    def next_throughput(self, throughput, f_r, cosine, pdf):
        return ti.Matrix([[f_r.x, 0, 0], [0, f_r.y, 0], [0, 0, f_r.z]]) @ throughput * cosine / pdf

    @ti.func
    def play_roulette(self, throughput, q):
        new_throughput = throughput
        if q > 0:
            if ti.random() <= q:
                new_throughput = tm.vec3(0)
            else:
                new_throughput *= 1 / (1 - q)
        return new_throughput

    @ti.func
    def sample_light(self, hit, x, w_o):
        return self.visible_light(hit, hit.position + 1e-4 * hit.normal, w_o) / self.pdf_of_light()

    @ti.func
    def pdf_of_light(self):
        return self.scene_data.lamps.choice.evaluate_probability()

    @ti.func
    def visible_light(self, hit, x, w_o):
        w_i, triangle_id = self.scene_data.lamps.choice.sample_mesh_lights(x)
        y = self.scene_data.ray_intersector.query_ray(tt.Ray(origin=x, direction=w_i))
        result = tm.vec3(0)
        if y.is_hit and y.triangle_id == triangle_id:
            material = self.scene_data.material_library.materials[hit.material_id]
            f = tt.BRDF.evaluate_brdf(material, w_o, w_i, hit.normal)
            result = self.emitted(y) * f * ti.max(0.0, hit.normal.dot(w_i)) * y.normal.dot(-w_i) / y.distance**2
        return result

    @ti.func
    def shade_ray(self, ray):
        radiance = tm.vec3(0)
        throughput = tm.vec3(1)
        current = tt.Ray(origin=ray.origin, direction=ray.direction)
        is_alive = True
        for bounce in range(1 + self.max_bounces):
            hit = self.scene_data.ray_intersector.query_ray(current)
            if not is_alive or not hit.is_hit:
                is_alive = False
                continue
            if self.active.name == "implicit" or bounce == 0:
                radiance += throughput * self.emitted(hit)
            if bounce >= self.max_bounces:
                continue
            x = offset_origin(hit.position, hit.position_error, hit.normal)
            if self.active.name == "explicit":
                radiance += throughput * self.sample_light(hit, x, -current.direction)
            material = self.scene_data.material_library.materials[hit.material_id]
            w_i = tt.BRDF.sample_direction(material, -current.direction, hit.normal)
            pdf = tt.BRDF.evaluate_probability(material, -current.direction, w_i, hit.normal)
            f_r = tt.BRDF.evaluate_brdf(material, -current.direction, w_i, hit.normal)
            throughput = self.next_throughput(throughput, f_r, ti.max(0.0, tm.dot(hit.normal, w_i)), pdf + 1e-12)
            if bounce + 1 > self.rr_start_bounce:
                throughput = self.play_roulette(throughput, self.rr_termination_probability)
            if throughput.norm() == 0:
                is_alive = False
            current = tt.Ray(origin=x, direction=w_i)
        return radiance
