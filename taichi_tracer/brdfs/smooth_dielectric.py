"""A smooth surface of glass or water: it mirrors one part of the light and lets the rest through, refracted (A4-4).

The other BRDFs describe materials of glass, too. Of several BRDFs that describe a material, the one in the last file of
this folder counts.
"""

import taichi as ti

from taichi_tracer.brdfs.base import DeltaBrdf
from taichi_tracer.formulas import vector_math as tm
from taichi_tracer.formulas.frames import mirrored
from taichi_tracer.formulas.fresnel import fresnel_dielectric, refracted
from taichi_tracer.system.parts import overridable, register

GLASS = 7  # the ``illum`` of MTL files for "transparency: refraction on, reflection: Fresnel on and ray trace on"


@register
@ti.data_oriented
@overridable()
class Dielectric(DeltaBrdf):
    """Two directions: ω_r with the probability F of Fresnel's equations, the refracted one with 1 − F.

    The weight of both is 1, because F and 1 − F cancel. Radiance also changes by the factor η² where light enters a
    denser medium, and by 1/η² where it leaves it. Paths carry the radiance divided by η², which does not change, so
    that the factor is left out (PBR, 4th edition, section 9.5.2): lights and eye are outside the glass.
    """

    name = "dielectric"
    transmits = True
    needs = "a material with illum 7, or with d < 1 and Ni"

    def describes(self, material, dtype: type) -> bool:
        """illum 7, or d < 1 with an index of refraction Ni other than 1."""
        return material.value("illum", 0.0) == GLASS or (material.d < 1 and material.Ni != 1)

    @ti.func
    def sample(self, material, w_o, n, xi):
        """ω_r if ξ is less than F, otherwise the refracted direction; with total reflection, F is 1."""
        cosine = ti.min(ti.max(0.0, tm.dot(n, w_o)), 1.0)
        w_i = mirrored(w_o, n)
        if xi.x >= fresnel_dielectric(cosine, material.Ni):
            w_i = refracted(w_o, n, cosine, material.Ni)
        return w_i

    @ti.func
    def weight(self, material, w_o, w_i, n):
        """1."""
        return tm.vec3(1)
