"""Assignment a4 as student one writes it."""

import taichi as ti
import taichi.math as tm

import taichi_tracer as tt
from taichi_tracer.ray import offset_origin


@ti.data_oriented
class A4Renderer(tt.A4Renderer):
    @ti.func
    def next_throughput(self, throughput, f_r, cosine, pdf):
        return f_r * (cosine / pdf) * throughput

    @ti.func
    def play_roulette(self, throughput, q):
        result = tm.vec3(0.0, 0.0, 0.0)
        survival = 1.0 - q
        if ti.random() < survival:
            result = throughput / survival
        return result

    @ti.func
    def sample_light(self, hit, x, w_o):
        material = self.scene_data.material_library.materials[hit.material_id]
        w_i, lamp_id = self.scene_data.lamps.choice.sample_mesh_lights(x)
        y = self.scene_data.ray_intersector.query_ray(tt.Ray(origin=x, direction=w_i))
        visible = ti.select(y.is_hit != 0 and y.triangle_id == lamp_id, 1.0, 0.0)
        cos_x = ti.max(tm.dot(hit.normal, w_i), 0)
        cos_y = ti.max(tm.dot(y.normal, -w_i), 0)
        f_r = tt.BRDF.evaluate_brdf(material, w_o, w_i, hit.normal)
        r2 = ti.max(y.distance * y.distance, 1e-12)
        p_area = self.scene_data.lamps.choice.evaluate_probability()
        return visible * self.emitted(y) * f_r * (cos_x * cos_y / r2) / p_area

    @ti.func
    def shade_ray(self, ray):
        scene = self.scene_data
        L = tm.vec3(0)
        beta = tm.vec3(1)
        o, d = ray.origin, ray.direction
        depth = 0
        while depth <= self.max_bounces:
            hit = scene.ray_intersector.query_ray(tt.Ray(origin=o, direction=d))
            if not hit.is_hit:
                break
            if ti.static(self.active.name == "implicit"):
                L += beta * self.emitted(hit)
            else:
                if depth == 0:
                    L += self.emitted(hit)
            if depth == self.max_bounces:
                break
            m = scene.material_library.materials[hit.material_id]
            x = offset_origin(hit.position, hit.position_error, hit.normal)
            if ti.static(self.active.name != "implicit"):
                L += beta * self.sample_light(hit, x, -d)
            w = tt.BRDF.sample_direction(m, -d, hit.normal)
            pdf = tt.BRDF.evaluate_probability(m, -d, w, hit.normal)
            if pdf <= 0:
                break
            f = tt.BRDF.evaluate_brdf(m, -d, w, hit.normal)
            beta = self.next_throughput(beta, f, ti.max(tm.dot(w, hit.normal), 0.0), pdf)
            depth += 1
            if depth > self.rr_start_bounce:
                beta = self.play_roulette(beta, self.rr_termination_probability)
            if beta.max() <= 0:
                break
            o, d = x, w
        return L
