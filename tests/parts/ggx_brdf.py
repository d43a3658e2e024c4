"""A rough mirror: a microfacet BRDF (Walter et al., EGSR 2007), for materials whose file says ``roughness``."""

import taichi as ti
import taichi.math as tm

import taichi_tracer as tt


@tt.register
class GGX(tt.Brdf):
    """f_r = F D G / (4 n·ω_o n·ω_i): a surface of tiny mirrors, whose normals h have the density D."""

    name = "ggx"
    parameters = {"roughness": 0.5}  # a key of MTL files, and what counts where it is missing; α = roughness²

    def describes(self, material, dtype):
        """Materials whose file has the key."""
        return "roughness" in material.extra

    @ti.func
    def eval(self, material, w_o, w_i, n):
        """f_r, with Schlick's F from ``Ks``, and Smith's G / (4 n·ω_o n·ω_i) as a product of two factors."""
        f = tm.vec3(0)
        if tm.dot(n, w_o) > 0 and tm.dot(n, w_i) > 0:
            h = tm.normalize(w_o + w_i)
            F = material.Ks + (1 - material.Ks) * (1 - tm.dot(w_o, h)) ** 5
            f = F * self.D(material, n, h) * self.lit(material, n, w_o) * self.lit(material, n, w_i)
        return f

    @ti.func
    def D(self, material, n, h):
        """α² / (π (α² cos² + sin²)²), per solid angle of h; sin² is that of a cross product, which keeps its digits."""
        alpha2 = material.roughness**4
        return alpha2 / (tm.pi * (alpha2 * tm.dot(n, h) ** 2 + tm.cross(n, h).norm_sqr()) ** 2)

    @ti.func
    def lit(self, material, n, w):
        """G₁(ω) / (2 n·ω): the part of the mirrors that is not hidden from a direction, over its cosine."""
        alpha2, cosine = material.roughness**4, tm.dot(n, w)
        return 1 / (cosine + ti.sqrt(alpha2 + (1 - alpha2) * cosine**2))

    @ti.func
    def pdf(self, material, w_o, w_i, n):
        """G₁ D / (4 n·ω_o): the density of the mirrors that ω_o sees, times |dh/dω_i|; also below the horizon."""
        h, pdf = tm.normalize(w_o + w_i), 0.0
        if tm.dot(n, h) > 0:
            pdf = self.D(material, n, h) * self.lit(material, n, w_o) / 2
        return pdf

    @ti.func
    def sample(self, material, w_o, n, xi):
        """ω_o mirrored in a normal that it sees: α stretches all to a hemisphere (Dupuy & Benyoub, HPG 2023)."""
        alpha = material.roughness**2
        x = tm.normalize(tm.cross(n, ti.select(abs(n.x) < 0.5, tm.vec3(1, 0, 0), tm.vec3(0, 1, 0))))
        y = tm.cross(n, x)
        v = tm.normalize(tm.vec3(alpha * tm.dot(w_o, x), alpha * tm.dot(w_o, y), tm.dot(w_o, n)))
        z, phi = (1 - xi.x) * (1 + v.z) - v.z, 2 * tm.pi * xi.y
        v += tm.vec3(ti.sqrt(ti.max(0, 1 - z * z)) * tm.vec2(ti.cos(phi), ti.sin(phi)), z)
        h = tm.normalize(alpha * v.x * x + alpha * v.y * y + v.z * n)
        return tm.normalize(2 * tm.dot(w_o, h) * h - w_o)
