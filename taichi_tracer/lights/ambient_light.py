"""The same light everywhere, which nothing blocks (RT-10)."""

import taichi as ti

from taichi_tracer.formulas import vector_math as tm
from taichi_tracer.lights.given import GivenLight
from taichi_tracer.system.parts import overridable, register
from taichi_tracer.system.types import Numbers


@register
@ti.data_oriented
@overridable(reflected="vec3")
class AmbientLight(GivenLight):
    """A stand-in for light that bounces: every surface shows I_a k_a, and k_a is the ambient colour Ka of its material.

    Args:
        intensity: I_a, linear RGB, or one number.
    """

    name, is_delta, is_ambient = "ambient", True, True

    def __init__(self, intensity: float | Numbers = 0.2) -> None:
        self.intensity = self._three("intensity", intensity, 0)

    @ti.func
    def reflected(self, material):
        """I_a k_a."""
        return tm.vec3(self.intensity) * material.Ka
