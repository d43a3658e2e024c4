"""Light that bounces: paths from the eye over surfaces to a light (A4-1 … A4-5).

    L_o(x, ω_o) = L_e(x, ω_o) + ∫ L_i(x, ω_i) f_r(x, ω_o, ω_i) max(n·ω_i, 0) dω_i

L_i is again the L_o of another surface. A path takes one sample of each integral. It is a loop over surfaces, and its
state is three names: ``L``, the light found so far; ``throughput``, the product of the weights f_r cos θ_i / pdf; and
``depth``, the number of surfaces that have reflected.

The three integrators differ only in how a light is found. ``implicit`` waits until a ray hits one. ``explicit`` takes a
sample of the lights at every surface; a light that a ray hits then counts only where no such sample finds it. ``path``
does both, and weights them by a heuristic of both densities. All three have the same mean.
"""

from functools import cached_property
from typing import Any

import taichi as ti

from taichi_tracer.formulas import vector_math as tm
from taichi_tracer.integrators.base import Control, Integrator
from taichi_tracer.integrators.direct_light import sample_of_lights
from taichi_tracer.integrators.path_settings import PathSettings
from taichi_tracer.system.parts import overridable, register


@ti.data_oriented
class Paths(Integrator):
    """The loop. A subclass says by its attributes how lights are found.

    Attributes:
        samples_lights: whether every surface takes a sample of the lights.
        exponent: β of the heuristic with which this sample is weighted; 0 counts it fully.
    """

    what, exponent = "path", 0

    @cached_property
    def settings(self) -> PathSettings:
        """How long paths are. A renderer may give them its own."""
        return PathSettings()

    def prepare(self, scene, camera) -> None:
        """Give kernels the ``settings``."""
        self.settings.prepare()

    @property
    def version(self) -> int:  # type: ignore[override]
        """Counts the changes of ``settings``."""
        return self.settings.version

    def facts(self) -> dict:
        """Everything that the bits of a picture depend on, for checkpoints."""
        return self.settings.facts()

    def controls(self) -> tuple[Control, ...]:
        """Those of ``settings``."""
        return self.settings.controls()

    def change(self, name: str, value: Any) -> None:
        """Change a value of ``settings``, see ``PathSettings.set``."""
        self.settings.set(**{name: value})

    @ti.func
    def radiance(self, scene, ray, hit, rng):
        """One sample of the radiance that arrives along the ray."""
        L, throughput, depth = scene.emitted(ray, hit, rng) * self.settings.counts(0), tm.vec3(1), 0
        if ti.static(scene.effects.is_lit):
            is_going = hit.is_hit and self.settings.max_bounces() > 0
            while is_going:
                surface = scene.surface_at(ray, hit)
                depth += 1
                if ti.static(self.samples_lights):
                    L += throughput * self.light_sample(scene, surface, rng) * self.settings.counts(depth)
                if ti.static(len(scene.lights.single) > 0):
                    single = scene.reflected_single(surface, rng)
                    L += throughput * single * self.settings.counts(depth)

                w_i, n, pdf, is_delta = surface.sample(rng.next_2d()), surface.normal, 0.0, surface.is_delta()
                if ti.static(self.samples_lights):
                    pdf = surface.pdf(w_i)
                throughput *= surface.weight(w_i)
                is_going = tm.component_max(throughput) > 0 and surface.lets_pass(w_i)
                is_going = is_going and self.needs_hit(scene, surface, w_i, depth, is_delta)
                if is_going:
                    survival = self.settings.survival(depth, throughput)
                    if survival < 1:
                        is_going = rng.next_1d() < survival
                        throughput /= survival
                if is_going:
                    ray = surface.ray_along(w_i)
                    hit = scene.met(surface, ray)
                    light = scene.lights.arriving(ray, hit) * self.settings.counts(depth)
                    if tm.component_max(light) > 0:
                        L += throughput * light * self.share_of_hit(scene, ray, n, hit, pdf, is_delta)
                    is_going = hit.is_hit and depth < self.settings.max_bounces()
        return L

    @ti.func
    def light_sample(self, scene, surface, rng):
        """One sample of the lights, times its share where rays find the same light, too."""
        f_cos, light, pdf, pdf_brdf = sample_of_lights(scene, surface, rng.next_2d_of_term())
        value = f_cos * light / pdf
        if ti.static(self.exponent > 0):
            value *= self.heuristic(pdf, pdf_brdf)
        return value

    @ti.func
    def needs_hit(self, scene, surface, w_i, depth, is_delta):
        """Whether it matters what the next ray hits. The last ray of a path is traced only if it may find a light.

        In ``explicit``, what it finds counts only if a mirror sent it.
        """
        is_needed = depth < self.settings.max_bounces()
        if not is_needed:
            if ti.static(not self.samples_lights or self.exponent > 0) or is_delta:
                is_needed = scene.may_find_light(surface.ray_along(w_i))
        return is_needed

    @ti.func
    def share_of_hit(self, scene, ray, n, hit, pdf, is_delta):
        """The share with which a light counts that a ray hits: what samples of the lights leave to it.

        It is 1 for the ray of a mirror, which no sample of the lights can find, and where there are no such samples.
        Otherwise it is the heuristic of the density of the BRDF against the density of the lights; without a heuristic,
        samples of the lights find everything, and it is 0.

        Args:
            ray: it starts at a surface with the normal n. hit: what it hits.
            pdf: the density of the BRDF for its direction. is_delta: whether a mirror sent it.
        """
        share = 1.0
        if ti.static(self.samples_lights and scene.samples_lights):
            if not is_delta:
                share = 0.0
                if ti.static(self.exponent > 0):
                    share = self.heuristic(pdf, scene.lights.pdf(ray.origin, n, ray.direction, hit))
        return share


@register
@ti.data_oriented
class Implicit(Paths):
    """Light counts where a ray hits it (A4-1): simple, and good only if lights are large or surfaces are glossy."""

    name, label, samples_lights = "implicit", "Paths, implicit", False


@register
@ti.data_oriented
class Explicit(Paths):
    """Every surface takes a sample of the lights (A4-1). What a ray hits counts only if a mirror sent it."""

    name, label, samples_brdf = "explicit", "Paths, explicit", False


@register
@ti.data_oriented
@overridable("radiance", "light_sample", "needs_hit", "share_of_hit")
class WeightedPaths(Paths):
    """Samples of the lights and hits of the rays, weighted by the power heuristic (A3-4, A4-1)."""

    name, label, aliases, exponent = "path", "Paths, MIS", ("path_mis",), 2
