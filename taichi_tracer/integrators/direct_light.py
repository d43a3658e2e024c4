"""Direct illumination by the environment: five ways to take one sample of the integral of A2-3.

    L_o(x, ω_o) = ∫ L(ω_i) V(x, ω_i) f_r(x, ω_o, ω_i) max(n·ω_i, 0) dω_i

An estimator draws ω_i from some density, and says what the light from there is to be multiplied with: f_r cos θ_i over
the density. ``reflected`` does the rest. It is a class with a ``name`` and a ``sample``; one added to ``ALL`` is known
to the renderer, the command line, the window and the tests. All are unbiased. No density but its own meets the lobe of
a mirror, so that every estimator samples that by its BRDF.
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
        self.background = scene_data.background
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
    def behind(self, direction, x, y, width, height):
        """What pixel (x, y) of a frame shows where its ray meets nothing: the background, or light from far away."""
        value = tm.vec3(0)
        if ti.static(self.effects.background):
            value = self.background.color(x, y, width, height)
        else:
            value = self.radiance(direction)
        return value


class UniformSphere:
    """ω_i uniform on the sphere: half of the samples lie under the horizon (A2-6)."""

    name, label, aliases, techniques = "uniform", "Uniform sphere", ("uniform_sphere",), 1

    @ti.func
    def sample(self, lighting: ti.template(), kind: ti.template(), material, point, technique, key):
        """(w_i, f_r cos θ_i / pdf) with pdf 1/(4π)."""
        xi = sampler.get_2d(lighting.sampler, key, sampler.BRDF_DIRECTION)
        w_i = sampler.uniform_sphere(xi)
        return w_i, eval_cosine(kind, material, point, w_i) * (4 * tm.pi)


class UniformHemisphere:
    """ω_i uniform on the hemisphere about n."""

    name, label, aliases, techniques = "hemisphere", "Uniform hemisphere", ("uniform_hemisphere",), 1

    @ti.func
    def sample(self, lighting: ti.template(), kind: ti.template(), material, point, technique, key):
        """(w_i, f_r cos θ_i / pdf) with pdf 1/(2π)."""
        xi = sampler.get_2d(lighting.sampler, key, sampler.BRDF_DIRECTION)
        w_i = sampler.uniform_hemisphere(point.normal, xi)
        return w_i, eval_cosine(kind, material, point, w_i) * (2 * tm.pi)


class BrdfSampling:
    """ω_i in proportion to the BRDF: best where the light is even or the surface glossy (A2-7, A2-8)."""

    name, label, aliases, techniques = "brdf", "BRDF", (), 1

    @ti.func
    def sample(self, lighting: ti.template(), kind: ti.template(), material, point, technique, key):
        """(w_i, f_r cos θ_i / pdf), the quotient cancelled (C-3)."""
        xi = sampler.get_2d(lighting.sampler, key, sampler.BRDF_DIRECTION)
        w_i = kind.sample(material, point.w_o, point.normal, xi)
        return w_i, kind.weight(material, point.w_o, w_i, point.normal)


class EnvironmentSampling:
    """ω_i in proportion to the environment's light: best where the light is uneven and the surface matte."""

    name, label, aliases, techniques = "environment", "Environment", ("light",), 1

    @ti.func
    def sample(self, lighting: ti.template(), kind: ti.template(), material, point, technique, key):
        """(w_i, f_r cos θ_i / pdf)."""
        xi = sampler.get_2d(lighting.sampler, key, sampler.LIGHT_DIRECTION)
        w_i, pdf = lighting.environment.sample(xi)
        return w_i, eval_cosine(kind, material, point, w_i) / pdf


class MultipleImportanceSampling:
    """One sample of the BRDF and one of the environment, each weighted by how likely the other was to find it.

    Veach & Guibas, "Optimally combining sampling techniques for Monte Carlo rendering", SIGGRAPH 1995. Two shadow rays.
    """

    techniques = 2

    def __init__(self, name: str, label: str, exponent: int, aliases: tuple[str, ...] = ()) -> None:
        self.name, self.label, self.exponent, self.aliases = name, label, exponent, aliases

    @ti.func
    def sample(self, lighting: ti.template(), kind: ti.template(), material, point, technique, key):
        """(w_i, heuristic · f_r cos θ_i / pdf) of the BRDF's sample, technique 0, or of the environment's."""
        w_i, value = tm.vec3(0), tm.vec3(0)
        if technique == 0:
            xi = sampler.get_2d(lighting.sampler, key, sampler.BRDF_DIRECTION)
            w_i = kind.sample(material, point.w_o, point.normal, xi)
            pdf_brdf = kind.pdf(material, point.w_o, w_i, point.normal)
            weight = kind.weight(material, point.w_o, w_i, point.normal)
            value = weight * self.heuristic(pdf_brdf, lighting.environment.pdf(w_i))
        else:
            xi = sampler.get_2d(lighting.sampler, key, sampler.LIGHT_DIRECTION)
            w_i, pdf = lighting.environment.sample(xi)
            pdf_brdf = kind.pdf(material, point.w_o, w_i, point.normal)
            value = eval_cosine(kind, material, point, w_i) / pdf * self.heuristic(pdf, pdf_brdf)
        return w_i, value

    @ti.func
    def heuristic(self, pdf, other):
        """pdf^β / (pdf^β + other^β), as 1/(1 + r^β), which does not overflow."""
        ratio = other / pdf
        if ti.static(self.exponent == 2):
            ratio = ratio * ratio
        return ti.select(pdf > 0, 1 / (1 + ratio), 0.0)


ALL = (
    UniformSphere(),
    UniformHemisphere(),
    BrdfSampling(),
    EnvironmentSampling(),
    MultipleImportanceSampling("mis", "MIS, power", 2, aliases=("mis_power",)),
    MultipleImportanceSampling("mis_balance", "MIS, balance", 1),
)


@ti.func
def eval_cosine(kind: ti.template(), material, point, w_i):
    """f_r max(n·ω_i, 0)."""
    return kind.eval(material, point.w_o, w_i, point.normal) * ti.max(0.0, tm.dot(point.normal, w_i))


@ti.func
def reflected(lighting: ti.template(), estimator: ti.template(), material, kind_of_material, point, key):
    """Light from far away that a surface reflects to the viewer: one sample, by the BRDF that the material has."""
    L = tm.vec3(0)
    for technique in range(estimator.techniques):
        w_i, value = tm.vec3(0), tm.vec3(0)
        for i in ti.static(lighting.effects.brdfs):
            if ti.static(len(lighting.effects.brdfs) == 1) or kind_of_material == i:
                w_i, value = by_kind(lighting, estimator, brdf.ALL[i], material, point, technique, key)
        L += lighting.arriving(point, w_i, value)
    return L


@ti.func
def by_kind(lighting: ti.template(), estimator: ti.template(), kind: ti.template(), material, point, technique, key):
    """``estimator.sample``, but for a mirror, which no other density than its own meets."""
    w_i, value = tm.vec3(0), tm.vec3(0)
    if ti.static(kind.is_delta):
        w_i = kind.sample(material, point.w_o, point.normal, tm.vec2(0.5))
        if technique == 0:
            value = kind.weight(material, point.w_o, w_i, point.normal)
    else:
        w_i, value = estimator.sample(lighting, kind, material, point, technique, key)
    return w_i, value
