"""Lights without a surface: ambient, directional, of a point, and spots (RT-10). No ray can hit them."""

import numpy as np
import taichi as ti

from taichi_tracer.formulas import vector_math as tm
from taichi_tracer.lights.base import Light
from taichi_tracer.system.errors import InputError
from taichi_tracer.system.memory import varying
from taichi_tracer.system.parts import overridable, register
from taichi_tracer.system.types import Numbers

LEAST = 1e-30  # of the divisor of an intensity: at the light itself, its radiance is huge but finite


class GivenLight(Light):
    """A light that is described by a few numbers; other numbers compile nothing."""

    def __repr__(self) -> str:
        arguments = ", ".join(f"{name}={value!r}" for name, value in vars(self).items() if not name.startswith("_"))
        return f"tt.{type(self).__name__}({arguments})"

    def _three(self, what: str, given: float | Numbers, least: float = -np.inf) -> tuple[float, ...]:
        """Three finite numbers of at least ``least``; a single number means three equal ones."""
        try:
            values = np.broadcast_to(np.asarray(given, np.float64), 3)
        except (TypeError, ValueError):
            values = np.full(3, np.nan)
        if not (np.isfinite(values).all() and (values >= least).all()):
            bound = "" if least == -np.inf else f" of at least {least:g}"
            raise InputError(f"{self.name} light: {what} must be three finite numbers{bound}, not {given!r}")
        return varying(tuple(values.tolist()))

    def _unit(self, what: str, given: Numbers) -> tuple[float, ...]:
        """A vector divided by its length."""
        largest = np.abs(given).max()
        if not largest > 0:
            raise InputError(f"{self.name} light: {what} must have a length, not {tuple(map(float, given))}")
        vector = np.asarray(given) / largest
        return varying(tuple((vector / np.linalg.norm(vector)).tolist()))

    def _attenuation(self, given: Numbers) -> tuple[float, ...]:
        """Kc, Kl and Kq of ``fall``: none is negative, and one is positive."""
        values = self._three("attenuation", given, 0)
        if max(values) == 0:
            raise InputError(f"{self.name} light: one number of attenuation must be above 0, not {given!r}")
        return values


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
        theta = tm.degrees(ti.atan2(tm.length(tm.cross(axis, -w_i)), tm.dot(axis, -w_i)))
        edge = ti.max(0.0, (self.cutoff - theta) / (self.cutoff - self.falloff))
        s = ti.select(theta <= self.falloff, 1.0, edge)
        return w_i, r, s * (tm.vec3(self.intensity) / fall(tm.vec3(self.attenuation), r)), 1.0
