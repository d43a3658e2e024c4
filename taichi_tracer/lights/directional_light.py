"""Parallel light, as from a sun that is a point (RT-10)."""

import taichi as ti

from taichi_tracer.formulas import vector_math as tm
from taichi_tracer.lights.given import GivenLight
from taichi_tracer.system.memory import varying
from taichi_tracer.system.parts import overridable, register
from taichi_tracer.system.types import Numbers


@register
@ti.data_oriented
@overridable()
class DirectionalLight(GivenLight):
    """Light that comes to every point from the same direction.

    Args:
        direction: in which the light goes, in world space, of any length.
        irradiance: of a surface that faces the light, linear RGB, or one number.
    """

    name, is_delta, is_far = "directional", True, True

    def __init__(self, direction: Numbers = (-0.4, -1.0, -0.6), irradiance: float | Numbers = 3.0) -> None:
        self.direction = self._three("direction", direction)
        self.irradiance = self._three("irradiance", irradiance, 0)
        self._to_light = varying(tuple(-one for one in self._unit("direction", self.direction)))

    @ti.func
    def sample(self, x, xi):
        """(ω_i, ∞, irradiance, 1): ω_i is opposite to the direction of the light."""
        return tm.vec3(self._to_light), tm.inf, tm.vec3(self.irradiance), 1.0
