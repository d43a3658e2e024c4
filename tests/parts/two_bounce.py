"""Direct light, and light that was reflected once before: what fills the shadows with the colour of the walls."""

import taichi as ti
import taichi.math as tm

import taichi_tracer as tt


@tt.register
class TwoBounce(tt.Integrator):
    """L = L_e + direct light + what one other surface sends on; both directions are drawn from the BRDF.

    Surfaces that emit are seen by the eye and from the first surface.
    """

    name, label, samples_lights = "two_bounce", "Two bounces", False

    @ti.func
    def radiance(self, scene, ray, hit, rng):
        """Radiance arriving along the ray: one sample."""
        L = scene.emitted(ray, hit, rng)
        if hit.is_hit:
            surface = scene.surface_at(ray, hit)
            L += self.direct(scene, surface, rng)

            # The same integral over the directions in which the ray meets something.
            w_i = surface.sample(rng.next_2d())
            bounce = tt.Ray(origin=surface.origin, direction=w_i)
            met = scene.ray_intersector.query_segment(bounce, 0.0, tm.inf)
            if met.is_hit and tm.dot(surface.geometric_normal, w_i) > 0:
                other = scene.surface_at(bounce, met)
                L += surface.weight(w_i) * (other.material.Ke + self.direct(scene, other, rng))
        return L

    @ti.func
    def direct(self, scene, surface, rng):
        """Light that a surface reflects of what comes straight from the lights: one sample."""
        w_i = surface.sample(rng.next_2d())
        f_cos_over_pdf = surface.weight(w_i)
        L = f_cos_over_pdf * scene.visible_radiance(surface, w_i, f_cos_over_pdf)
        return L + scene.reflected_single(surface, rng)
