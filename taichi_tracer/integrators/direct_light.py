"""Direct light by Monte Carlo: six estimators for the integral of A2-3.

    L_o(x, ω_o) = ∫ L(ω_i) V(x, ω_i) f_r(x, ω_o, ω_i) max(n·ω_i, 0) dω_i

An estimator draws ω_i from a density, and returns ω_i together with the factor f_r cos θ_i / pdf, by which the light
from ω_i is multiplied. All estimators are unbiased. There are two special cases. Only a mirror's own density finds its
direction ω_r; therefore every estimator samples a mirror by its BRDF. Only a sample of the light finds a point light;
therefore every estimator samples such lights in the same way.

The light from ω_i is that of a lamp (a surface with Ke > 0), if the ray along ω_i hits one, and that of the
environment, if the ray hits nothing. A sample of the lights comes from the mixture of both (A3-4).

Direct light and paths are made of two steps, ``sample_of_lights`` and ``light_along``. Both know two densities: that of
the lights, with which ``scene.lights.sample`` finds a direction, and that of the BRDF. Where both steps can find the
same light, the caller multiplies each by a heuristic of the two densities; the sum is then unbiased (Veach & Guibas
1995).
"""

import taichi as ti

from taichi_tracer.formulas import vector_math as tm
from taichi_tracer.formulas.warps import uniform_hemisphere
from taichi_tracer.integrators.base import Integrator
from taichi_tracer.sampler import UniformSampler
from taichi_tracer.system.parts import call_with_known_args, overridable, register

# ── light at a surface: the two steps of every estimator ──


@ti.func
def sample_of_lights(scene: ti.template(), surface, xi):
    """(f_r cos θ, L, pdf of the lights, pdf of the BRDF) of a direction that is drawn from the lights.

    L is 0 if something blocks the light. For a mirror, f_r cos θ is always 0: only its own direction finds light. If
    all surfaces of the scene are mirrors, no sample is taken.
    """
    f_cos, light, pdf, pdf_brdf = tm.vec3(0), tm.vec3(0), 1.0, 0.0
    if ti.static(scene.samples_lights):
        w_i, distance, unblocked, pdf_lights = scene.lights.sample(surface.origin, surface.normal, xi)
        pdf, pdf_brdf = pdf_lights, surface.pdf(w_i)
        if tm.component_max(unblocked) > 0 and tm.dot(surface.geometric_normal, w_i) > 0:
            f_cos = surface.eval_cosine(w_i)
            if tm.component_max(f_cos) > 0:
                if not scene.is_blocked(surface, w_i, distance):
                    light = unblocked
    return f_cos, light, pdf, pdf_brdf


@ti.func
def light_along(scene: ti.template(), surface, w_i, factor):
    """(L, pdf of the lights) of the light that arrives at a surface from the direction w_i without any reflection.

    The caller multiplies L by ``factor``. If ``factor`` is 0, no ray is sent, and L is 0.
    """
    light, hit = scene.visible(surface, w_i, factor)
    if ti.static(scene.samples_lights):
        return light, scene.lights.pdf(surface.origin, surface.normal, w_i, hit)
    return light, 0.0


@ti.func
def pairs(scene: ti.template(), rng):
    """(ξ for the BRDF, ξ for the lights) of an estimator that samples both.

    The pair that is even together with the point in the pixel goes to lamps, if the scene has some, because near lamps
    make most of the noise; otherwise to the BRDF.
    """
    xi_brdf, xi_light = rng.next_2d_of_term(), rng.next_2d()
    if ti.static(scene.lights.has_lamps):
        xi_brdf, xi_light = xi_light, xi_brdf
    return xi_brdf, xi_light


# ── estimators ──


@ti.data_oriented
@overridable(radiance="vec3", reflected="vec3")
class DirectLight(Integrator):
    """Emitted light (or the background) plus one sample of the reflected light. A subclass defines ``sample``."""

    @ti.func
    def radiance(self, scene, ray, hit, rng):
        """One sample of the radiance that arrives along the ray (A2-9)."""
        L = scene.emitted(ray, hit, rng)
        if ti.static(scene.effects.is_lit):
            if hit.is_hit:
                surface = scene.surface_at(ray, hit)
                if ti.static(scene.lights.can_be_met):
                    L += self.reflected(scene, surface, rng)
                if ti.static(len(scene.lights.single) > 0):
                    L += scene.reflected_single(surface, rng)
        return L

    @ti.func
    def reflected(self, scene, surface, rng):
        """One sample of the light that a surface reflects: from the direction of ``sample``, or from a mirror's own."""
        xi = rng.next_2d_of_term()
        rng.dimension += 1  # the pair for a sample of the lights, which only other estimators take
        w_i, f_cos_over_pdf = self.sample(scene, surface, xi)
        if surface.is_delta():
            w_i = surface.sample(xi)
            f_cos_over_pdf = surface.weight(w_i)
        return f_cos_over_pdf * scene.visible_radiance(surface, w_i, f_cos_over_pdf)

    @ti.func
    def sample(self, scene, surface, xi):
        """(w_i, f_r cos θ_i / pdf) for one direction, made of ``xi`` in [0, 1)²."""
        ti.static_assert(False, "an estimator must say what sample(self, scene, surface, ...) is")


@register
@ti.data_oriented
@overridable(sample="vec3 vec3")
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
    def sample(self, scene, surface, xi):
        """(w_i, f_r cos θ_i / pdf) with pdf 1/(4π)."""
        w_i = call_with_known_args(self.directions.sample_direction, xi=xi)
        return w_i, surface.eval_cosine(w_i) / call_with_known_args(self.directions.evaluate_probability)


@register
@ti.data_oriented
@overridable(sample="vec3 vec3")
class UniformHemisphere(DirectLight):
    """ω_i uniform on the hemisphere around n."""

    name, label, aliases = "hemisphere", "Uniform hemisphere", ("uniform_hemisphere",)
    samples_lights, samples_brdf = False, False

    @ti.func
    def sample(self, scene, surface, xi):
        """(w_i, f_r cos θ_i / pdf) with pdf 1/(2π)."""
        w_i = uniform_hemisphere(surface.normal, xi)
        return w_i, surface.eval_cosine(w_i) * (2 * tm.pi)


@register
@ti.data_oriented
@overridable(sample="vec3 vec3")
class BrdfSampling(DirectLight):
    """ω_i drawn from the density of the BRDF: best if the light is even or the surface is glossy (A2-7, A2-8)."""

    name, label, samples_lights = "brdf", "BRDF", False

    @ti.func
    def sample(self, scene, surface, xi):
        """(w_i, f_r cos θ_i / pdf), where the quotient is cancelled (C-3)."""
        w_i = surface.sample(xi)
        return w_i, surface.weight(w_i)


@register
@ti.data_oriented
@overridable()
class MicrofacetSampling(BrdfSampling):
    """``brdf``, where the roughness decides and not Ns, if a material has both (A2-12)."""

    name, label, microfacets = "microfacet", "Microfacets", True


@register
@ti.data_oriented
@overridable()
class EnvironmentSampling(DirectLight):
    """ω_i in proportion to the light of the environment, or to a lamp: best if the surface is matte."""

    name, label, aliases, samples_brdf = "environment", "Lights", ("light",), False

    @ti.func
    def reflected(self, scene, surface, rng):
        """One sample of the lights; a mirror is sampled by its BRDF."""
        xi_brdf, xi_light = pairs(scene, rng)
        f_cos, light, pdf, _ = sample_of_lights(scene, surface, xi_light)
        f_cos_over_pdf = f_cos / pdf
        if surface.is_delta():
            w_i = surface.sample(xi_brdf)
            f_cos_over_pdf = surface.weight(w_i)
            light = scene.visible_radiance(surface, w_i, f_cos_over_pdf)
        return f_cos_over_pdf * light


@ti.data_oriented
@overridable()
class MultipleImportanceSampling(DirectLight):
    """One sample of the BRDF and one of the lights, each weighted by a heuristic of both densities.

    Veach & Guibas, "Optimally combining sampling techniques for Monte Carlo rendering", SIGGRAPH 1995. It sends two
    shadow rays.

    Args:
        exponent: β of the heuristic: 2 for the power heuristic, 1 for the balance heuristic.
    """

    def __init__(self, name: str, label: str, exponent: int, aliases: tuple[str, ...] = ()) -> None:
        self.name, self.label, self.exponent, self.aliases = name, label, exponent, aliases

    @ti.func
    def reflected(self, scene, surface, rng):
        """The sum of both weighted samples; a mirror has the sample of its BRDF alone."""
        xi_brdf, xi_light = pairs(scene, rng)
        w_i = surface.sample(xi_brdf)
        f_cos_over_pdf = surface.weight(w_i)
        light, pdf = light_along(scene, surface, w_i, f_cos_over_pdf)
        share = ti.select(surface.is_delta(), 1.0, self.heuristic(surface.pdf(w_i), pdf))
        L = f_cos_over_pdf * share * light

        f_cos, light, pdf, pdf_brdf = sample_of_lights(scene, surface, xi_light)
        return L + f_cos / pdf * self.heuristic(pdf, pdf_brdf) * light


register(MultipleImportanceSampling("mis", "MIS, power", 2, aliases=("mis_power",)))
register(MultipleImportanceSampling("mis_balance", "MIS, balance", 1))
