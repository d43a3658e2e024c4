"""A light: it can be sampled from a point, and a ray may see it."""

import taichi as ti
import taichi.math as tm

import taichi_tracer as tt


@tt.register
class Mine(tt.Light):
    """A point that shines into all directions, brighter upwards.

    x is in world space. w_i has unit length and leads from x to the light. Radiance is linear RGB, without a cosine and
    without shadows: the integrator looks whether something is in the way. ``is_delta`` says that all light comes from
    single directions. A light without it has two more methods: ``pdf(self, x, w_i, hit)``, the density of ``sample``
    per solid angle, and ``radiance(self, ray, hit)``, what a ray sees of it.
    """

    name, is_delta = "mine", True

    def __init__(self, position=(1.5, 3.0, 2.5), intensity=(30.0, 24.0, 18.0)):
        """``position`` in units of the scene; ``intensity`` in W/sr, linear RGB."""
        self.position, self.intensity = position, intensity

    @ti.func
    def sample(self, x, xi):
        """(w_i, distance, radiance, pdf), made of two random numbers xi in [0, 1)²; a delta light has the pdf 1."""
        to_light = tm.vec3(self.position) - x
        distance = to_light.norm()
        w_i = to_light / distance
        brightness = 1.5 - 0.5 * w_i.y  # seen from below, w_i points upwards, and the light shines downwards
        return w_i, distance, brightness * tm.vec3(self.intensity) / distance**2, 1.0
