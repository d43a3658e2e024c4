"""A point that shines equally in all directions (RT-10)."""

import taichi as ti

from taichi_tracer.formulas import vector_math as tm
from taichi_tracer.lights.given import GivenLight
from taichi_tracer.system.parts import overridable, register
from taichi_tracer.system.types import Numbers

LEAST = 1e-30  # of the divisor of an intensity: at the light itself, its radiance is huge but finite


@register
@ti.data_oriented
@overridable()
class PointLight(GivenLight):
    """I/(Kc + Kl r + Kq r²) at the distance r. A surface with the normal n gets this times n·ω_i.

    Args:
        position: in world space.
        intensity: I, linear RGB, or one number. With the usual attenuation, it is radiant intensity, in W/sr.
        attenuation: Kc, Kl, Kq. (0, 0, 1) is what a small lamp does. RT3's scenes have (1, 0, 0), if they do not say
            otherwise: the same light at all distances.
    """

    name, is_delta = "point", True

    def __init__(
        self,
        position: Numbers = (0.0, 2.0, 0.0),
        intensity: float | Numbers = 3.0,
        attenuation: Numbers = (0.0, 0.0, 1.0),
    ) -> None:
        self.position = self._three("position", position)
        self.intensity = self._three("intensity", intensity, 0)
        self.attenuation = self._attenuation(attenuation)

    @ti.func
    def sample(self, x, xi):
        """(ω_i, r, I/(Kc + Kl r + Kq r²), 1) from the point x."""
        w_i, r = towards(x, tm.vec3(self.position))
        return w_i, r, tm.vec3(self.intensity) / fall(tm.vec3(self.attenuation), r), 1.0


@ti.func
def towards(x, y):
    """(ω, r): the unit direction from x to y, and the distance. If both are the same point, ω is the y axis."""
    r = tm.length(y - x)
    return ti.select(r > 0, (y - x) / r, tm.vec3(0, 1, 0)), r


@ti.func
def fall(attenuation, r):
    """Kc + Kl r + Kq r², by which an intensity is divided."""
    return ti.max(attenuation.x + r * (attenuation.y + r * attenuation.z), LEAST)
