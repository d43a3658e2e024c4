"""The surface of glTF files: a mixture of a metal and of a diffuse base under a rough layer (glTF 2.0, appendix B.2).

A file gives a base colour c, a metalness m and a roughness r. They become Kd = (1 − m) c, F0 = (1 − m) 0.04 + m c and
α = r². The metal and the layer reflect as ``microfacet`` does, with one F, because F is linear in F0:

    f_r = (1 − F_l(n·ω_o))(1 − F_l(n·ω_i)) Kd/π + D F(ω_o·ω_m) G/(4 cos θ_i cos θ_o)

    F(c) = F0 + (1 − F0)(1 − c)⁵,     F_l(c) = 0.04 + 0.96 (1 − c)⁵

The base gets what passes the layer, and lets out what passes it again. (The file format has 1 − F(ω_o·ω_m) there, which
reflects up to 16 % more light than arrives at grazing angles.) A pure metal, m = 1, is a plain ``Microfacet``.
"""

import taichi as ti

from taichi_tracer.brdfs.base import Brdf
from taichi_tracer.brdfs.diffuse import Diffuse
from taichi_tracer.brdfs.microfacet import LAYERED, Microfacet, schlick
from taichi_tracer.formulas import vector_math as tm
from taichi_tracer.system.parts import overridable, register

BASE, LAYER = Diffuse(), Microfacet()
LAYER_F0 = 0.04  # an index of refraction of 1.5
LEAST, MOST = 0.1, 0.9  # of the samples: so many go to the layer at least, and at most


@register
@ti.data_oriented
@overridable()
class RoughLayer(Brdf):
    """A diffuse base ``Kd`` under a layer with ``alpha_x``, ``alpha_y`` and ``F0``."""

    name = "layered"
    reaches_all = True
    needs = "a material of a glTF file that is no pure metal"

    def describes(self, material, dtype: type) -> bool:
        """A roughness, and the key ``layered``."""
        return material.is_rough and material.value(LAYERED, 0.0) == 1

    @ti.func
    def eval(self, material, w_o, w_i, n):
        """What the base and the layer reflect."""
        value = tm.vec3(0)
        if tm.dot(n, w_o) > 0 and tm.dot(n, w_i) > 0:
            passes = (1 - schlick(LAYER_F0, tm.dot(n, w_o))) * (1 - schlick(LAYER_F0, tm.dot(n, w_i)))
            value = passes * BASE.eval(material, w_o, w_i, n) + LAYER.eval(material, w_o, w_i, n)
        return value

    @ti.func
    def share(self, material, w_o, n):
        """The probability with which a sample goes to the layer: about its share of the reflected light."""
        of_layer = tm.component_sum(schlick(material.F0, tm.dot(n, w_o)))
        of_base = tm.component_sum((1 - LAYER_F0) * material.Kd)
        return tm.clamp(of_layer / ti.max(of_layer + of_base, 1e-6), LEAST, MOST)

    @ti.func
    def pdf(self, material, w_o, w_i, n):
        """The mixture of the densities of layer and base."""
        p = self.share(material, w_o, n)
        return p * LAYER.pdf(material, w_o, w_i, n) + (1 - p) * BASE.pdf(material, w_o, w_i, n)

    @ti.func
    def sample(self, material, w_o, n, xi):
        """A direction of the layer if ξ_1 < p, otherwise of the base."""
        p = self.share(material, w_o, n)
        w_i = n
        if xi.x < p:
            w_i = LAYER.sample(material, w_o, n, tm.vec2(xi.x / p, xi.y))
        else:
            w_i = BASE.sample(material, w_o, n, tm.vec2((xi.x - p) / (1 - p), xi.y))
        return w_i
