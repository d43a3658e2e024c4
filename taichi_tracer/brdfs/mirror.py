"""The limit of Phong's lobe for Ns → ∞: a reflection into the single direction ω_r, with Phong's weight (C-3)."""

import taichi as ti

from taichi_tracer.brdfs.base import DeltaBrdf
from taichi_tracer.brdfs.phong import MIRROR_FROM
from taichi_tracer.formulas import vector_math as tm
from taichi_tracer.formulas.frames import mirrored
from taichi_tracer.system.parts import overridable, register


@register
@ti.data_oriented
@overridable()
class Mirror(DeltaBrdf):
    """f_r = Kd δ(ω_i − ω_r)."""

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
