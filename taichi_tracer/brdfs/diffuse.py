"""The diffuse BRDF: a surface that looks equally bright from all directions (Lambert; A2-4)."""

import taichi as ti

from taichi_tracer.brdfs.base import Brdf
from taichi_tracer.formulas import vector_math as tm
from taichi_tracer.formulas.warps import cosine_hemisphere
from taichi_tracer.system.parts import overridable, register


@register
@ti.data_oriented
@overridable()
class Diffuse(Brdf):
    """f_r = Kd/π."""

    name = "diffuse"
    reaches_all = True
    needs = "a material with Ns of 1 or less"

    def describes(self, material, dtype: type) -> bool:
        """Ns of 1 or less, or no Ns in the file (C-4)."""
        return material.Ns <= 1

    @ti.func
    def eval(self, material, w_o, w_i, n):
        """Kd/π."""
        return material.Kd / tm.pi

    @ti.func
    def pdf(self, material, w_o, w_i, n):
        """max(0, n·ω_i)/π."""
        return ti.max(0.0, tm.dot(n, w_i)) / tm.pi

    @ti.func
    def sample(self, material, w_o, n, xi):
        """w_i, cosine-distributed around n (A2-7 with α = 1)."""
        return cosine_hemisphere(n, xi)

    @ti.func
    def weight(self, material, w_o, w_i, n):
        """Kd: π and the cosine cancel (A2-8)."""
        return material.Kd
