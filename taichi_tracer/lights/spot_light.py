"""A point that shines into a cone (RT-10)."""

import numpy as np
import taichi as ti

from taichi_tracer.formulas import vector_math as tm
from taichi_tracer.lights.given import GivenLight
from taichi_tracer.lights.point_light import fall, towards
from taichi_tracer.system.errors import InputError
from taichi_tracer.system.memory import varying
from taichi_tracer.system.parts import overridable, register
from taichi_tracer.system.types import Numbers


@register
@ti.data_oriented
@overridable()
class SpotLight(GivenLight):
    """A point light with the factor s(θ), where θ is the angle at the light between its axis and the point that is lit.

    s is 1 up to the angle ``falloff``, 0 from the angle ``cutoff`` on, and linear in θ in between.

    Args:
        position: in world space.
        target: a point on the axis.
        intensity: linear RGB on the axis, or one number.
        cutoff, falloff: degrees, with 0 ≤ falloff ≤ cutoff ≤ 180.
        attenuation: as for ``PointLight``.
    """

    name, is_delta = "spot", True

    def __init__(
        self,
        position: Numbers = (0.0, 3.0, 0.0),
        target: Numbers = (0.0, 0.0, 0.0),
        intensity: float | Numbers = 10.0,
        cutoff: float = 30.0,
        falloff: float = 20.0,
        attenuation: Numbers = (0.0, 0.0, 1.0),
    ) -> None:
        self.position = self._three("position", position)
        self.target = self._three("target", target)
        self.intensity = self._three("intensity", intensity, 0)
        if not 0 <= falloff <= cutoff <= 180:
            raise InputError(f"spot light: 0 <= falloff <= cutoff <= 180 degrees, not {falloff!r} and {cutoff!r}")
        self.cutoff, self.falloff = varying(float(cutoff)), varying(float(falloff))
        self.attenuation = self._attenuation(attenuation)
        self._axis = self._unit("the way to its target", np.subtract(self.target, self.position))

    @ti.func
    def sample(self, x, xi):
        """(ω_i, r, s(θ) I/(Kc + Kl r + Kq r²), 1) from the point x."""
        w_i, r = towards(x, tm.vec3(self.position))
        axis = tm.vec3(self._axis)
        # The tangent is accurate near 0 and 180 degrees, too (Kahan 2006).
        theta = tm.degrees(ti.atan2(tm.cross(axis, -w_i).norm(), tm.dot(axis, -w_i)))
        edge = ti.max(0.0, (self.cutoff - theta) / (self.cutoff - self.falloff))
        s = ti.select(theta <= self.falloff, 1.0, edge)
        return w_i, r, s * (tm.vec3(self.intensity) / fall(tm.vec3(self.attenuation), r)), 1.0
