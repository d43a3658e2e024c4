"""Assignment a2 as student one writes it."""

import taichi as ti
import taichi.math as tm

import taichi_tracer as tt


@ti.data_oriented
class Camera(tt.Camera):
    @ti.func
    def generate_ndc_coords(self, pixel_x, pixel_y, jitter=False):
        x, y = pixel_x + 0.5, pixel_y + 0.5
        if jitter:
            y += ti.random() - 0.5
            x += ti.random() - 0.5
        return tm.vec2(2 * x / self.width - 1, 2 * y / self.height - 1)


@ti.data_oriented
class Environment(tt.Environment):
    @ti.func
    def query_ray(self, ray):
        d = ray.direction
        u = (ti.atan2(d.z, d.x) / tm.pi + 1.0) * 0.5
        v = ti.asin(tm.clamp(d.y, -1.0, 1.0)) / tm.pi + 0.5
        x = tm.clamp(ti.floor(u * self.width), 0, self.width - 1)
        y = tm.clamp(ti.floor((1.0 - v) * self.height), 0, self.height - 1)
        return self.texels[ti.cast(y, int), ti.cast(x, int)]


@ti.data_oriented
class A2Renderer(tt.A2Renderer):
    @ti.func
    def running_mean(self, mean, sample, count):
        return mean + (sample - mean) / (count + 1)


@ti.data_oriented
class UniformSampler(tt.UniformSampler):
    @staticmethod
    @ti.func
    def sample_direction():
        phi = 2 * tm.pi * ti.random()
        y = 1 - 2 * ti.random()
        r = ti.sqrt(ti.max(0.0, 1 - y**2))
        return tm.vec3(r * ti.sin(phi), y, r * ti.cos(phi))


@ti.data_oriented
class BRDF(tt.BRDF):
    @staticmethod
    @ti.func
    def evaluate_probability(material, w_o, w_i, normal):
        probability = ti.max(normal.dot(w_i), 0) / tm.pi
        if material.Ns > 1:
            mirrored = tm.normalize(2 * normal.dot(w_o) * normal - w_o)
            probability = (material.Ns + 1) / 2 / tm.pi * ti.exp(material.Ns * ti.log(ti.max(mirrored.dot(w_i), 1e-30)))
        return probability

    @staticmethod
    @ti.func
    def evaluate_brdf(material, w_o, w_i, normal):
        value = material.Kd / tm.pi
        if material.Ns > 1:
            w_r = -tm.reflect(w_o, normal)
            value = (material.Ns + 1) / (2 * tm.pi) * material.Kd * ti.max(tm.dot(w_r, w_i), 0.0) ** material.Ns
        return value
