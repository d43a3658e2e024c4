"""Assignment a2 as student five writes it."""

import taichi as ti
import taichi.math as tm

import taichi_tracer as tt
from taichi_tracer.sampler import ortho_frames


@ti.data_oriented
class UniformSampler(tt.UniformSampler):
    @staticmethod
    @ti.func
    def sample_direction():
        a, b, c = ti.randn(), ti.randn(), ti.randn()
        return tm.normalize(tm.vec3(a, b, c))

    @staticmethod
    @ti.func
    def evaluate_probability():
        return 0.25 / tm.pi


@ti.data_oriented
class BRDF(tt.BRDF):
    @staticmethod
    @ti.func
    def evaluate_brdf_factor(material, w_o, w_i, normal):
        cosine = ti.max(tm.dot(w_i, normal), 0.0)
        return ti.select(material.Ns > 1, material.Kd * cosine, material.Kd)


@ti.data_oriented
class MicrofacetBRDF(tt.MicrofacetBRDF):
    @staticmethod
    @ti.func
    def sample_direction(material, w_o, normal):
        frame = ortho_frames(normal)
        o = tm.normalize(frame.transpose() @ w_o)
        v = tm.normalize(tm.vec3(material.alpha_x * o.x, material.alpha_y * o.y, o.z))
        side = ortho_frames(v)
        radius, angle = ti.sqrt(ti.random()), 2 * tm.pi * ti.random()
        disk = tm.vec2(radius * ti.cos(angle), radius * ti.sin(angle))
        up = v.z * v - tm.vec3(0, 0, 1)
        n = disk.x * side[:, 0] + disk.y * side[:, 1] + ti.sqrt(ti.max(0.0, 1 - radius**2)) * v
        if up.norm() > 1e-6:
            side_y = -tm.normalize(up)
            side_x = tm.cross(side_y, v)
            s = (1 + v.z) / 2
            y = (1 - s) * ti.sqrt(1 - disk.x**2) + s * disk.y
            n = disk.x * side_x + y * side_y + ti.sqrt(ti.max(0.0, 1 - disk.x**2 - y**2)) * v
        m = tm.normalize(tm.vec3(material.alpha_x * n.x, material.alpha_y * n.y, ti.max(n.z, 0.0)))
        return frame @ (-tm.reflect(o, m))

    @staticmethod
    @ti.func
    def evaluate_probability(material, w_o, w_i, normal):
        m = (w_o + w_i).normalized()
        cos_m, cos_o = m.dot(normal), w_o.dot(normal)
        a2 = material.alpha_x * material.alpha_y
        D = a2 / (tm.pi * (cos_m**2 * (a2 - 1) + 1) ** 2)
        G1 = 2 * cos_o / (cos_o + ti.sqrt(a2 + (1 - a2) * cos_o**2))
        return G1 * D / (4 * cos_o)

    @staticmethod
    @ti.func
    def evaluate_brdf(material, w_o, w_i, normal):
        m = (w_o + w_i).normalized()
        cos_m, cos_o, cos_i = m.dot(normal), w_o.dot(normal), w_i.dot(normal)
        a2 = material.alpha_x * material.alpha_y
        D = a2 / (tm.pi * (cos_m**2 * (a2 - 1) + 1) ** 2)
        s_o, s_i = ti.sqrt(a2 + (1 - a2) * cos_o**2), ti.sqrt(a2 + (1 - a2) * cos_i**2)
        c = 1 - m.dot(w_o)
        F = material.F0 + (1 - material.F0) * c * c * c * c * c
        return F * D / (2 * (cos_i * s_o + cos_o * s_i))

    @staticmethod
    @ti.func
    def evaluate_brdf_factor(material, w_o, w_i, normal):
        cos_o, cos_i = w_o.dot(normal), w_i.dot(normal)
        a2 = material.alpha_x * material.alpha_y
        s_o, s_i = ti.sqrt(a2 + (1 - a2) * cos_o**2), ti.sqrt(a2 + (1 - a2) * cos_i**2)
        c = 1 - w_o.dot((w_o + w_i).normalized())
        F = material.F0 + (1 - material.F0) * c**5
        return F * cos_i * (cos_o + s_o) / (cos_i * s_o + cos_o * s_i)
