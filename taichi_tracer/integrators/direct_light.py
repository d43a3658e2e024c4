"""Direct light by Monte Carlo: six estimators for the integral of A2-3.

    L_o(x, ω_o) = ∫ L(ω_i) V(x, ω_i) f_r(x, ω_o, ω_i) max(n·ω_i, 0) dω_i

An estimator draws ω_i from a density, and returns ω_i together with the factor f_r cos θ_i / pdf, by which the light
from ω_i is multiplied. All estimators are unbiased. There are two special cases. Only a mirror's own density finds its
direction ω_r; therefore every estimator samples a mirror by its BRDF. Only a sample of the light finds a point light;
therefore every estimator samples such lights in the same way.

Without lamps, light arrives only along rays that hit nothing, so that a shadow ray is enough. With lamps (surfaces with
Ke > 0), the estimators follow the direction to what it hits, which may be a lamp, and sample the mixture of lamps and
environment (A3-4).
"""

import taichi as ti
import taichi.math as tm

from taichi_tracer.formulas.heuristics import heuristic
from taichi_tracer.formulas.warps import uniform_hemisphere
from taichi_tracer.integrators.base import Integrator
from taichi_tracer.integrators.next_event import light_along, sample_of_lights
from taichi_tracer.sampler import UniformSampler
from taichi_tracer.system.registry import register
from taichi_tracer.system.seams import called, is_as_written, replaced, seams


@ti.data_oriented
@seams("radiance", "reflected", "direction")
class DirectLight(Integrator):
    """Emitted light (or the background) plus one sample of the reflected light. A subclass defines ``sample``.

    Attributes:
        techniques: the number of directions in one sample; the same code sends the shadow ray of each direction.
    """

    techniques = 1

    @property
    def adds_up(self) -> bool:  # type: ignore[override]
        """Whether a sample is a plain sum: as written here, and not by a method that a student put in its place."""
        return is_as_written(self, __name__)

    @ti.func
    def radiance(self, scene, ray, hit, rng):
        """One sample of the radiance that arrives along the ray (A2-9)."""
        L = scene.emitted(ray, hit, rng)
        if ti.static(scene.effects.is_lit):
            if hit.is_hit:
                surface = scene.surface_at(ray, hit)
                L += self.reflected(scene, surface, rng)
        return L

    @ti.func
    def reflected(self, scene, surface, rng):
        """One sample of the light that a surface reflects to the viewer."""
        L = tm.vec3(0)
        if ti.static(scene.lights.has_lamps):
            L = self.reflected_with_lamps(scene, surface, rng)
        elif ti.static(len(scene.lights.far) > 0):
            xi_brdf, xi_light = self.random_pairs(rng)
            for technique in range(self.techniques):
                w_i, f_cos_over_pdf = self.direction(scene, surface, technique, xi_brdf, xi_light)
                L += f_cos_over_pdf * scene.visible_radiance(surface, w_i, f_cos_over_pdf)
        if ti.static(len(scene.lights.single) > 0):
            L += scene.lights.reflected_single(scene.ray_intersector, surface, rng)
        return L

    @ti.func
    def reflected_with_lamps(self, scene, surface, rng):
        """One sample of the light from lamps and from far away: what the direction of ``sample`` leads to."""
        xi_brdf, xi_light = self.random_pairs(rng)
        w_i, f_cos_over_pdf = self.direction(scene, surface, 0, xi_brdf, xi_light)
        L = tm.vec3(0)
        if f_cos_over_pdf.max() > 0:
            light, _ = light_along(scene, surface, w_i, False)
            L = f_cos_over_pdf * light
        return L

    @ti.func
    def random_pairs(self, rng):
        """(ξ for the BRDF, ξ for the lights). The second is not computed for an estimator of this file without it."""
        xi_brdf, xi_light = rng.next_2d_of_term(), tm.vec2(0)
        if ti.static(self.samples_lights or not self.adds_up):
            xi_light = rng.next_2d()
        else:
            rng.skip_2d()
        return xi_brdf, xi_light

    @ti.func
    def direction(self, scene, surface, technique, xi_brdf, xi_light):
        """``sample``; but a mirror always gives ω_r, with its weight for technique 0 and with 0 for the others."""
        w_i, f_cos_over_pdf = tm.vec3(0), tm.vec3(0)
        if ti.static(surface.may_be_delta):
            if surface.is_delta():
                mirror = surface.not_scattering()
                w_i = mirror.sample(xi_brdf)
                if technique == 0:
                    f_cos_over_pdf = mirror.weight(w_i)
            elif ti.static(scene.effects.scatters):
                w_i, f_cos_over_pdf = self.sample(scene, surface.scattering(), technique, xi_brdf, xi_light)
        else:
            w_i, f_cos_over_pdf = self.sample(scene, surface, technique, xi_brdf, xi_light)
        return w_i, f_cos_over_pdf

    @ti.func
    def sample(self, scene, surface, technique, xi_brdf, xi_light):
        """(w_i, f_r cos θ_i / pdf) for one direction."""
        ti.static_assert(False, "an estimator must say what sample(self, scene, surface, ...) is")
        return surface.normal, tm.vec3(0)


@register
@ti.data_oriented
class UniformSphere(DirectLight):
    """ω_i uniform on the sphere: half of the samples lie below the horizon (A2-6).

    Args:
        directions: the source of the directions: the handout's ``UniformSampler``, or a class that replaces it.
    """

    name, label, aliases = "uniform", "Uniform sphere", ("uniform_sphere",)
    samples_lights, samples_brdf = False, False

    def __init__(self, directions: UniformSampler | None = None) -> None:
        self.directions = UniformSampler() if directions is None else directions

    @ti.func
    def sample(self, scene, surface, technique, xi_brdf, xi_light):
        """(w_i, f_r cos θ_i / pdf) with pdf 1/(4π)."""
        w_i = called(self.directions.sample_direction, xi=xi_brdf)
        f_cos_over_pdf = surface.eval_cosine(w_i) * (4 * tm.pi)
        if ti.static(len(replaced(self.directions)) > 0):
            f_cos_over_pdf = surface.eval_cosine(w_i) / called(self.directions.evaluate_probability)
        return w_i, f_cos_over_pdf


@register
@ti.data_oriented
class UniformHemisphere(DirectLight):
    """ω_i uniform on the hemisphere around n."""

    name, label, aliases = "hemisphere", "Uniform hemisphere", ("uniform_hemisphere",)
    samples_lights, samples_brdf = False, False

    @ti.func
    def sample(self, scene, surface, technique, xi_brdf, xi_light):
        """(w_i, f_r cos θ_i / pdf) with pdf 1/(2π)."""
        w_i = uniform_hemisphere(surface.normal, xi_brdf)
        return w_i, surface.eval_cosine(w_i) * (2 * tm.pi)


@register
@ti.data_oriented
class BrdfSampling(DirectLight):
    """ω_i drawn from the density of the BRDF: best if the light is even or the surface is glossy (A2-7, A2-8)."""

    name, label, samples_lights = "brdf", "BRDF", False

    @ti.func
    def sample(self, scene, surface, technique, xi_brdf, xi_light):
        """(w_i, f_r cos θ_i / pdf), where the quotient is cancelled (C-3)."""
        w_i = surface.sample(xi_brdf)
        return w_i, surface.weight(w_i)


@register
@ti.data_oriented
class EnvironmentSampling(DirectLight):
    """ω_i in proportion to the light of the environment, or to a lamp: best if the surface is matte."""

    name, label, aliases, samples_brdf = "environment", "Lights", ("light",), False

    @ti.func
    def sample(self, scene, surface, technique, xi_brdf, xi_light):
        """(w_i, f_r cos θ_i / pdf)."""
        w_i, pdf = scene.lights.sample_far(surface.origin, xi_light)
        return w_i, surface.eval_cosine(w_i) / pdf

    @ti.func
    def reflected_with_lamps(self, scene, surface, rng):
        """One sample of the lights; a mirror is sampled by its BRDF."""
        L, _, _ = sample_of_lights(scene, surface, rng)
        w_i = surface.sample(rng.next_2d())
        if surface.is_delta():
            light, _ = light_along(scene, surface, w_i, False)
            L = surface.weight(w_i) * light
        return L


@ti.data_oriented
@seams("sample", "sample_brdf", "reflected_with_lamps")
class MultipleImportanceSampling(DirectLight):
    """One sample of the BRDF and one of the environment, each weighted by a heuristic of both densities.

    Veach & Guibas, "Optimally combining sampling techniques for Monte Carlo rendering", SIGGRAPH 1995. It sends two
    shadow rays.

    Args:
        exponent: β of the heuristic: 2 for the power heuristic, 1 for the balance heuristic.
    """

    techniques = 2

    def __init__(self, name: str, label: str, exponent: int, aliases: tuple[str, ...] = ()) -> None:
        self.name, self.label, self.exponent, self.aliases = name, label, exponent, aliases

    @property
    def compensates(self) -> bool:  # type: ignore[override]
        """Whether it is as written here, so that both samples are weighted."""
        return self.adds_up

    @ti.func
    def sample(self, scene, surface, technique, xi_brdf, xi_light):
        """(w_i, heuristic · f_r cos θ_i / pdf): technique 0 samples the BRDF, technique 1 the environment."""
        w_i, f_cos_over_pdf = tm.vec3(0), tm.vec3(0)
        if technique == 0:
            w_i, f_cos_over_pdf = self.sample_brdf(scene, surface, xi_brdf)
        else:
            w_i, pdf = scene.lights.sample_far(surface.origin, xi_light)
            f_cos_over_pdf = surface.eval_cosine(w_i) / pdf * heuristic(pdf, surface.pdf(w_i), self.exponent)
        return w_i, f_cos_over_pdf

    @ti.func
    def sample_brdf(self, scene, surface, xi):
        """Technique 0 of ``sample``."""
        w_i = surface.sample(xi)
        pdf_light = scene.lights.pdf_far(surface.origin, w_i)
        return w_i, surface.weight(w_i) * heuristic(surface.pdf(w_i), pdf_light, self.exponent)

    @ti.func
    def reflected_with_lamps(self, scene, surface, rng):
        """One sample of the lights and one of the BRDF; a mirror has its BRDF alone."""
        L, pdf, pdf_brdf = sample_of_lights(scene, surface, rng)
        L *= heuristic(pdf, pdf_brdf, self.exponent)
        w_i = surface.sample(rng.next_2d())
        light, pdf = light_along(scene, surface, w_i, True)
        share = heuristic(surface.pdf(w_i), pdf, self.exponent)
        return L + surface.weight(w_i) * light * ti.select(surface.is_delta(), 1.0, share)


register(MultipleImportanceSampling("mis", "MIS, power", 2, aliases=("mis_power",)))
register(MultipleImportanceSampling("mis_balance", "MIS, balance", 1))
