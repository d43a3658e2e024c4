"""An integrator: one sample of the radiance that arrives along a ray."""

import taichi as ti
import taichi.math as tm

import taichi_tracer as tt


@tt.register
class Mine(tt.Integrator):
    """Emitted light, and the light of one direction that is drawn from the BRDF.

    L_o = L_e + ∫ L(ω_i) f_r cos θ dω_i, per channel, linear RGB. ``scene`` has the lights, the surfaces and what is in
    the way; ``hit`` is what the ray hit. ``rng.next_2d()`` gives two random numbers in [0, 1). The film computes the
    mean of the samples.
    """

    name, label, samples_lights = "mine", "Mine", False

    @ti.func
    def radiance(self, scene, ray, hit, rng):
        """One sample, a vec3; a miss sees what is behind the scene."""
        L = scene.emitted(ray, hit, rng)
        if hit.is_hit:
            surface = scene.surface_at(ray, hit)
            w_i = surface.sample(rng.next_2d())
            f_cos_over_pdf = surface.weight(w_i)
            L += f_cos_over_pdf * scene.visible_radiance(surface, w_i, f_cos_over_pdf)
            L += scene.reflected_single(surface, rng)  # of lights that no direction of a BRDF meets
        return tm.vec3(L)
