"""Assignment a4 as student five writes it."""

import taichi as ti
import taichi.math as tm

import taichi_tracer as tt


@ti.data_oriented
class A4Renderer(tt.A4Renderer):
    @ti.func
    def next_throughput(self, throughput, f_r, cosine, pdf):
        weight = f_r * cosine
        weight /= pdf
        return weight * throughput

    @ti.func
    def play_roulette(self, throughput, q):
        new_throughput = tm.vec3(0.0)
        xi = ti.random()
        if xi > q or q == 0.0:
            new_throughput = throughput * (1.0 / (1.0 - q))
        return new_throughput

    @ti.func
    def sample_light(self, hit, x, w_o):
        light = tm.vec3(0)
        w_i, triangle_id = self.scene_data.lamps.choice.sample_mesh_lights(x)
        v0, v1, v2 = self.scene_data.geometry.triangle(triangle_id)
        n_y = tm.normalize(tm.cross(v1 - v0, v2 - v0))
        t = tm.dot(v0 - x, n_y) / tm.dot(w_i, n_y)
        cos_y = -tm.dot(n_y, w_i)
        if cos_y > 0:
            y = self.scene_data.ray_intersector.query_ray(tt.Ray(origin=x, direction=w_i))
            if y.is_hit and abs(y.distance - t) < 1e-3 * t:
                material = self.scene_data.material_library.materials[hit.material_id]
                f = tt.BRDF.evaluate_brdf(material, w_o, w_i, hit.normal)
                G = ti.max(tm.dot(hit.normal, w_i), 0.0) * cos_y / t**2
                light = G * f * self.emitted(y) / self.scene_data.lamps.choice.evaluate_probability()
        return light

    @ti.func
    def shade_ray(self, ray):
        radiance, throughput = tm.vec3(0), tm.vec3(1)
        w_o, x = -ray.direction, ray.origin
        for bounce in range(self.max_bounces + 1):
            hit = self.scene_data.ray_intersector.query_ray(tt.Ray(origin=x, direction=-w_o))
            if not hit.is_hit:
                break
            counts = 1.0
            if ti.static(self.active.name == "explicit"):
                counts = ti.select(bounce == 0, 1.0, 0.0)
            radiance += counts * throughput * self.emitted(hit)
            if bounce == self.max_bounces:
                break
            material = self.scene_data.material_library.materials[hit.material_id]
            x = hit.position + 1e-5 * hit.normal
            if ti.static(self.active.name == "explicit"):
                radiance += self.sample_light(hit, x, w_o) * throughput
            w_i = tt.BRDF.sample_direction(material, w_o, hit.normal)
            cosine = tm.dot(hit.normal, w_i)
            if cosine <= 0:
                break
            throughput = self.next_throughput(
                throughput,
                tt.BRDF.evaluate_brdf(material, w_o, w_i, hit.normal),
                cosine,
                tt.BRDF.evaluate_probability(material, w_o, w_i, hit.normal),
            )
            if bounce >= self.rr_start_bounce:
                throughput = self.play_roulette(throughput, self.rr_termination_probability)
            if throughput.max() == 0.0:
                break
            w_o = -w_i
        return radiance
