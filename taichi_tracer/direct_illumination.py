"""Direct illumination by the environment: five ways to take one sample of the integral of A2-3.

    L_o(x, ω_o) = ∫ L(ω_i) V(x, ω_i) f_r(x, ω_o, ω_i) max(n·ω_i, 0) dω_i

An estimator draws ω_i from some density and returns what arrives from there, over that density. It is a class with a
``name`` and a ``direct``; one added to ``ALL`` is known to the renderer, the command line, the window and the tests.
All are unbiased. No density but its own meets the lobe of a mirror, so that every estimator samples that by its BRDF.
"""

import taichi as ti
import taichi.math as tm

from taichi_tracer import brdf, sampler
from taichi_tracer.ray import Ray


@ti.dataclass
class SurfacePoint:
    """Where light is reflected: the origin of rays that leave, the normals on the viewer's side, w_o to the viewer."""

    origin: tm.vec3
    normal: tm.vec3
    geometric_normal: tm.vec3
    w_o: tm.vec3


@ti.data_oriented
class Lighting:
    """What estimators ask of a scene: its reflection, its light, and whether the light arrives.

    Each question is compiled for the effects of the scene.
    """

    def __init__(self, scene_data, samples) -> None:
        self.effects = scene_data.effects
        self.environment = scene_data.environment
        self.intersector = scene_data.ray_intersector
        self.sampler = samples

    @ti.func
    def arriving(self, point, w_i, value):
        """``value`` times the radiance from w_i, if nothing is in the way. Where that is 0, no shadow ray is sent."""
        light = tm.vec3(0)
        if value.max() > 0 and tm.dot(point.geometric_normal, w_i) > 0:
            light = value * self.radiance(w_i)
            if light.max() > 0:
                if self.intersector.is_blocked(Ray(origin=point.origin, direction=w_i), 0.0, tm.inf):
                    light = tm.vec3(0)
        return light

    @ti.func
    def radiance(self, direction):
        """Radiance from far away along a unit direction."""
        light = tm.vec3(0)
        if ti.static(self.effects.environment == "image"):
            light = self.environment.radiance(direction)
        elif ti.static(self.effects.environment == "constant"):
            light = self.environment.constant_radiance()
        return light

    @ti.func
    def eval_cosine(self, kind: ti.template(), material, point, w_i):
        """f_r max(n·ω_i, 0)."""
        return kind.eval(material, point.w_o, w_i, point.normal) * ti.max(0.0, tm.dot(point.normal, w_i))


class UniformSphere:
    """ω_i uniform on the sphere: half of the samples lie under the horizon (A2-6)."""

    name, label, aliases = "uniform", "Uniform sphere", ("uniform_sphere",)

    @staticmethod
    @ti.func
    def direct(lighting: ti.template(), kind: ti.template(), material, point, key):
        """One sample; pdf 1/(4π)."""
        xi = sampler.get_2d(lighting.sampler, key, sampler.BRDF_DIRECTION)
        w_i = sampler.uniform_sphere(xi)
        return lighting.arriving(point, w_i, lighting.eval_cosine(kind, material, point, w_i) * (4 * tm.pi))


class UniformHemisphere:
    """ω_i uniform on the hemisphere about n."""

    name, label, aliases = "hemisphere", "Uniform hemisphere", ("uniform_hemisphere",)

    @staticmethod
    @ti.func
    def direct(lighting: ti.template(), kind: ti.template(), material, point, key):
        """One sample; pdf 1/(2π)."""
        xi = sampler.get_2d(lighting.sampler, key, sampler.BRDF_DIRECTION)
        w_i = sampler.uniform_hemisphere(point.normal, xi)
        return lighting.arriving(point, w_i, lighting.eval_cosine(kind, material, point, w_i) * (2 * tm.pi))


class BrdfSampling:
    """ω_i in proportion to the BRDF: best where the light is even or the surface glossy (A2-7, A2-8)."""

    name, label, aliases = "brdf", "BRDF", ()

    @staticmethod
    @ti.func
    def direct(lighting: ti.template(), kind: ti.template(), material, point, key):
        """One sample, with the weight f_r cos θ_i / pdf cancelled (C-3)."""
        xi = sampler.get_2d(lighting.sampler, key, sampler.BRDF_DIRECTION)
        w_i = kind.sample(material, point.w_o, point.normal, xi)
        return lighting.arriving(point, w_i, kind.weight(material, point.w_o, w_i, point.normal))


class EnvironmentSampling:
    """ω_i in proportion to the environment's light: best where the light is uneven and the surface matte."""

    name, label, aliases = "environment", "Environment", ("light",)

    @staticmethod
    @ti.func
    def direct(lighting: ti.template(), kind: ti.template(), material, point, key):
        """One sample."""
        xi = sampler.get_2d(lighting.sampler, key, sampler.LIGHT_DIRECTION)
        w_i, pdf = lighting.environment.sample(xi)
        return lighting.arriving(point, w_i, lighting.eval_cosine(kind, material, point, w_i) / pdf)


class MultipleImportanceSampling:
    """One sample of the BRDF and one of the environment, each weighted by how likely the other was to find it.

    Veach & Guibas, "Optimally combining sampling techniques for Monte Carlo rendering", SIGGRAPH 1995. Two shadow rays.
    """

    def __init__(self, name: str, label: str, exponent: int, aliases: tuple[str, ...] = ()) -> None:
        self.name, self.label, self.exponent, self.aliases = name, label, exponent, aliases

    @ti.func
    def direct(self, lighting: ti.template(), kind: ti.template(), material, point, key):
        """One sample: the sum of both."""
        xi = sampler.get_2d(lighting.sampler, key, sampler.BRDF_DIRECTION)
        w_i = kind.sample(material, point.w_o, point.normal, xi)
        pdf_brdf = kind.pdf(material, point.w_o, w_i, point.normal)
        heuristic = self.heuristic(pdf_brdf, lighting.environment.pdf(w_i))
        value = kind.weight(material, point.w_o, w_i, point.normal) * heuristic
        L = lighting.arriving(point, w_i, value)

        xi = sampler.get_2d(lighting.sampler, key, sampler.LIGHT_DIRECTION)
        w_i, pdf = lighting.environment.sample(xi)
        heuristic = self.heuristic(pdf, kind.pdf(material, point.w_o, w_i, point.normal))
        value = lighting.eval_cosine(kind, material, point, w_i) / pdf * heuristic
        return L + lighting.arriving(point, w_i, value)

    @ti.func
    def heuristic(self, pdf, other):
        """pdf^β / (pdf^β + other^β), as 1/(1 + r^β), which does not overflow."""
        ratio = other / pdf
        weight = 1 / (1 + ratio)
        if ti.static(self.exponent == 2):
            weight = 1 / (1 + ratio * ratio)
        return ti.select(pdf > 0, weight, 0.0)


ALL = (
    UniformSphere(),
    UniformHemisphere(),
    BrdfSampling(),
    EnvironmentSampling(),
    MultipleImportanceSampling("mis", "MIS, power", 2, aliases=("mis_power",)),
    MultipleImportanceSampling("mis_balance", "MIS, balance", 1),
)


@ti.func
def reflected(lighting: ti.template(), estimator: ti.template(), material, kind_of_material, point, key):
    """Light from far away that a surface reflects to the viewer: one sample, by the BRDF that the material has."""
    L = tm.vec3(0)
    for i in ti.static(lighting.effects.brdfs):
        if ti.static(len(lighting.effects.brdfs) == 1) or kind_of_material == i:
            L = by_kind(lighting, estimator, brdf.ALL[i], material, point, key)
    return L


@ti.func
def by_kind(lighting: ti.template(), estimator: ti.template(), kind: ti.template(), material, point, key):
    """``estimator.direct``, but for a mirror, which only its own sampling meets."""
    L = tm.vec3(0)
    if ti.static(kind.is_delta):
        w_i = kind.sample(material, point.w_o, point.normal, tm.vec2(0.5))
        L = lighting.arriving(point, w_i, kind.weight(material, point.w_o, w_i, point.normal))
    else:
        L = estimator.direct(lighting, kind, material, point, key)
    return L
