"""Estimators of direct light in scenes whose only light is far away: the same bits, and the code of one shadow ray.

A plain estimator sends a shadow ray wherever it needs one, and its kernel has the search of the tree as often. Here,
the directions of a sample are drawn in a loop, whose body alone sends a ray. The estimator need not know what the ray
finds, so that another class may let the light wait: see ``tiles``.
"""

from typing import Any

import taichi as ti
import taichi.math as tm

from taichi_tracer.brdfs.surface import Surface
from taichi_tracer.formulas.heuristics import heuristic
from taichi_tracer.integrators import direct_light
from taichi_tracer.integrators.base import Integrator
from taichi_tracer.system.seams import called, in_kernels, is_as_written


@in_kernels
def with_brdfs(surface: Surface, are_delta: bool) -> Surface:
    """A surface with its delta BRDFs alone, or with the others, where it is known that it has one of these."""
    some = {i: b for i, b in zip(surface.numbers, surface.brdfs, strict=True) if b.is_delta == are_delta}
    return Surface(some, surface.brdf_id, surface.material, surface.origin, surface.hit, surface.w_o)


@ti.data_oriented
class FarLight(Integrator):
    """The form of an estimator that draws one direction by its method ``sample``.

    Args:
        plain: the estimator, one of ``integrators.direct_light``.

    Attributes:
        techniques: the number of directions in one sample.
    """

    techniques = 1

    def __init__(self, plain: direct_light.DirectLight) -> None:
        self.plain: Any = plain
        self.name = plain.name
        self.samples_lights, self.samples_brdf = plain.samples_lights, plain.samples_brdf

    @ti.func
    def radiance(self, scene, ray, hit, rng):
        """One sample of the radiance that arrives along the ray, as ``DirectLight.radiance``."""
        L = self.emitted(scene, ray, hit, rng)
        if hit.is_hit:
            surface = scene.surface_at(ray, hit)
            xi_brdf, xi_light = rng.next_2d_of_term(), tm.vec2(0)
            if ti.static(self.samples_lights):
                xi_light = rng.next_2d()
            else:
                rng.skip_2d()
            for technique in range(self.techniques):
                w_i, f_cos_over_pdf = self.direction(scene, surface, technique, xi_brdf, xi_light)
                L += f_cos_over_pdf * self.visible_radiance(scene, surface, w_i, f_cos_over_pdf)
            if ti.static(len(scene.lights.single) > 0):
                L += scene.reflected_single(surface, rng)
        return L

    @ti.func
    def direction(self, scene, surface, technique, xi_brdf, xi_light):
        """``sample``; but a mirror always gives ω_r, with its weight for technique 0 and with 0 for the others."""
        w_i, f_cos_over_pdf = tm.vec3(0), tm.vec3(0)
        if ti.static(surface.may_be_delta):
            if surface.is_delta():
                mirror = with_brdfs(surface, True)
                w_i = mirror.sample(xi_brdf)
                if technique == 0:
                    f_cos_over_pdf = mirror.weight(w_i)
            elif ti.static(scene.effects.scatters):
                w_i, f_cos_over_pdf = self.sample(scene, with_brdfs(surface, False), technique, xi_brdf, xi_light)
        else:
            w_i, f_cos_over_pdf = self.sample(scene, surface, technique, xi_brdf, xi_light)
        return w_i, f_cos_over_pdf

    @ti.func
    def sample(self, scene, surface, technique, xi_brdf, xi_light):
        """(w_i, f_r cos θ_i / pdf) of one direction."""
        return called(self.plain.sample, scene, surface, xi=xi_brdf)

    # ── what another class may do later ──

    @ti.func
    def emitted(self, scene, ray, hit, rng):
        """Radiance along an eye ray without any reflection."""
        return scene.emitted(ray, hit, rng)

    @ti.func
    def visible_radiance(self, scene, surface, w_i, factor):
        """``SceneInKernels.visible_radiance``."""
        return scene.visible_radiance(surface, w_i, factor)

    @ti.func
    def light_direction(self, scene, surface, xi):
        """(w_i, pdf) of a direction to the light."""
        return scene.lights.from_far.sample_direction(surface.origin, xi)


@ti.data_oriented
class FarEnvironment(FarLight):
    """The form of ``EnvironmentSampling``."""

    @ti.func
    def sample(self, scene, surface, technique, xi_brdf, xi_light):
        """(w_i, f_r cos θ_i / pdf) of a direction to the light."""
        w_i, pdf = self.light_direction(scene, surface, xi_light)
        return w_i, surface.eval_cosine(w_i) / pdf


@ti.data_oriented
class FarMis(FarLight):
    """The form of ``MultipleImportanceSampling``."""

    techniques = 2

    @ti.func
    def sample(self, scene, surface, technique, xi_brdf, xi_light):
        """(w_i, heuristic · f_r cos θ_i / pdf): technique 0 samples the BRDF, technique 1 the light."""
        w_i, f_cos_over_pdf = tm.vec3(0), tm.vec3(0)
        if technique == 0:
            w_i, f_cos_over_pdf = self.brdf_direction(scene, surface, xi_brdf)
        else:
            w_i, pdf = self.light_direction(scene, surface, xi_light)
            share = heuristic(pdf, surface.pdf(w_i), self.plain.exponent)
            f_cos_over_pdf = surface.eval_cosine(w_i) / pdf * share
        return w_i, f_cos_over_pdf

    @ti.func
    def brdf_direction(self, scene, surface, xi):
        """Technique 0 of ``sample``."""
        w_i = surface.sample(xi)
        pdf_light = scene.lights.from_far.pdf(surface.origin, w_i, surface.hit)
        return w_i, surface.weight(w_i) * heuristic(surface.pdf(w_i), pdf_light, self.plain.exponent)


FORMS: dict[type, type[FarLight]] = {
    direct_light.UniformSphere: FarLight,
    direct_light.UniformHemisphere: FarLight,
    direct_light.BrdfSampling: FarLight,
    direct_light.EnvironmentSampling: FarEnvironment,
    direct_light.MultipleImportanceSampling: FarMis,
}


def form_class(scene: Any, integrator: Integrator) -> type[FarLight] | None:
    """The class of the form that stands in for an integrator in a scene, a ``SceneInKernels``; None if there is none.

    A method that a student wrote in place of the package's might do something else with the light: then there is none.
    """
    lights = scene.lights
    is_far = len(lights.far) > 0 and not lights.has_lamps and scene.effects.is_lit
    return FORMS.get(type(integrator)) if is_far and is_as_written(integrator, direct_light.__name__) else None
