"""Phong's lobe around the mirrored direction: the specular part of Lafortune & Willems 1994 (A2-4); and a mirror."""

import taichi as ti

from taichi_tracer.brdfs.base import Brdf, DeltaBrdf
from taichi_tracer.formulas import vector_math as tm
from taichi_tracer.formulas.frames import mirrored
from taichi_tracer.formulas.warps import power_cosine
from taichi_tracer.system.parts import overridable, register

# The exponent Ns at which the width of the lobe, about 1/√Ns, is the ε of f32: from here on, the lobe is a mirror's. A
# scene means the same in f64. Its directions are finer, but one of 2⁴⁶ samples of a light would fall into such a lobe:
# a path that finds lights only by such samples would show black instead of the mirrored lamp.
MIRROR_FROM = 2.0**46


@register
@ti.data_oriented
@overridable()
class Mirror(DeltaBrdf):
    """The limit of ``Phong`` for Ns → ∞, with its weight: f_r = Kd δ(ω_i − ω_r) (C-3)."""

    name = "mirror"
    needs = "a material with an Ns so large that it is a mirror"

    def describes(self, material, dtype: type) -> bool:
        """Ns so large that the lobe is narrower than the rounding error of a direction in f32."""
        return material.Ns >= MIRROR_FROM and not material.is_rough

    @ti.func
    def sample(self, material, w_o, n, xi):
        """ω_r."""
        return mirrored(w_o, n)

    @ti.func
    def weight(self, material, w_o, w_i, n):
        """Kd max(n·ω_i, 0)."""
        return material.Kd * ti.max(0.0, tm.dot(n, w_i))


@register
@ti.data_oriented
@overridable()
class Phong(Brdf):
    """f_r = Kd (Ns+1)/(2π) max(0, ω_r·ω_i)^Ns.

    With the cosine, it is not normalised in energy: at normal incidence, the albedo is Kd (Ns+1)/(Ns+2) (C-19).
    """

    name = "phong"
    reaches_all = True
    needs = "a material with Ns > 1"

    def describes(self, material, dtype: type) -> bool:
        """Ns > 1, and a lobe that is wider than the rounding error of a direction in f32."""
        return 1 < material.Ns < MIRROR_FROM and not material.is_rough

    @ti.func
    def eval(self, material, w_o, w_i, n):
        """f_r: Kd times the density of the lobe."""
        return material.Kd * self.lobe(material, w_o, w_i, n)

    @ti.func
    def pdf(self, material, w_o, w_i, n):
        """The density of the lobe."""
        return self.lobe(material, w_o, w_i, n)

    @ti.func
    def lobe(self, material, w_o, w_i, n):
        """(α+1)/(2π) max(0, ω_r·ω_i)^α, with cos^α = exp(α/2 log(1 − sin²)), because cos may round to 1 (C-2)."""
        w_r = mirrored(w_o, n)
        sine_squared = tm.cross(w_r, w_i).norm_sqr()
        lobe = 0.0
        if tm.dot(w_r, w_i) > 0 and sine_squared < 1:
            lobe = ti.exp(material.Ns / 2 * log1p_of_negative(sine_squared))
        return (material.Ns + 1) / (2 * tm.pi) * lobe

    @ti.func
    def sample(self, material, w_o, n, xi):
        """w_i, drawn from the lobe around ω_r (A2-7)."""
        return power_cosine(mirrored(w_o, n), material.Ns, xi)

    @ti.func
    def weight(self, material, w_o, w_i, n):
        """Kd max(n·ω_i, 0): the lobe cancels (A2-8)."""
        return material.Kd * ti.max(0.0, tm.dot(n, w_i))


@ti.func
def log1p_of_negative(x):
    """log(1 − x) for 0 ≤ x < 1, accurate even if 1 − x rounds to 1 (Kahan; Goldberg 1991, theorem 4)."""
    y = 1 - x
    return ti.select(y == 1, -x, ti.log(y) * -x / ti.select(y == 1, -1.0, y - 1))
