"""Assignment a2 as student two writes it."""

import taichi as ti
import taichi.math as tm

import taichi_tracer as tt


@ti.data_oriented
class Camera(tt.Camera):
    @ti.func
    def generate_ndc_coords(self, pixel_x, pixel_y, jitter=False):
        offset = tm.vec2(0.5)
        if jitter:
            offset = tm.vec2(ti.random(), ti.random())
        return 2.0 * (tm.vec2(pixel_x, pixel_y) + offset) / tm.vec2(self.width, self.height) - 1.0


@ti.data_oriented
class Environment(tt.Environment):
    @ti.func
    def query_ray(self, ray):
        d = ray.direction.normalized()
        phi = ti.atan2(d.z, d.x) + tm.pi
        theta = ti.acos(ti.max(-1.0, ti.min(1.0, d.y)))
        i = ti.cast(phi / (2 * tm.pi) * self.width, ti.i32) % self.width
        j = ti.cast(theta / tm.pi * self.height, ti.i32)
        return self.texels[ti.min(j, self.height - 1), i]


@ti.data_oriented
class UniformSampler(tt.UniformSampler):
    @staticmethod
    @ti.func
    def sample_direction():
        p = tm.vec3(2)
        while p.norm() > 1 or p.norm() < 1e-3:
            p = 2 * tm.vec3(ti.random(), ti.random(), ti.random()) - 1
        return p.normalized()


@ti.data_oriented
class BRDF(tt.BRDF):
    @staticmethod
    @ti.func
    def sample_direction(material, w_o, normal):
        axis, exponent = normal, 1.0
        if material.Ns > 1:
            axis, exponent = -tm.reflect(w_o, normal), material.Ns
        helper = tm.vec3(0, 0, 1)
        if abs(axis.z) > 0.7:
            helper = tm.vec3(1, 0, 0)
        x = tm.normalize(helper - tm.dot(helper, axis) * axis)
        y = tm.cross(axis, x)
        cos_theta = (1 - ti.random()) ** (1 / (exponent + 1))
        angle = tm.pi * (2 * ti.random() - 1)
        sin_theta = ti.sqrt(1 - cos_theta**2)
        return tm.normalize(x * sin_theta * ti.cos(angle) + y * sin_theta * ti.sin(angle) + axis * cos_theta)
