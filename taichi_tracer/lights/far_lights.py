"""All lights that are infinitely far away, as one light: rays that hit nothing see their sum."""

import taichi as ti
import taichi.math as tm

from taichi_tracer.lights.base import Light
from taichi_tracer.ray import Ray, no_hit


@ti.data_oriented
class FarLights(Light):
    """The sum of several lights. A sample chooses one of them, all with equal probability, and takes its direction.

    Args:
        lights: those that are far away, and no delta lights.
    """

    is_far = True

    def __init__(self, lights: tuple[Light, ...]) -> None:
        self.lights = lights

    @ti.func
    def radiance(self, ray, hit):
        """Radiance along a ray that hits nothing."""
        light = tm.vec3(0)
        for one in ti.static(self.lights):
            light += one.radiance(ray, no_hit())
        return light

    @ti.func
    def sample(self, x, xi):
        """(w_i, ∞, radiance, pdf) of a direction towards one of the lights."""
        w_i, pdf = self.sample_direction(x, xi)
        return w_i, tm.inf, self.radiance(Ray(origin=x, direction=w_i), no_hit()), pdf

    @ti.func
    def sample_direction(self, x, xi):
        """(w_i, pdf) of ``sample``; the pdf is the mean of the densities of all lights."""
        w_i, pdf = tm.vec3(0, 1, 0), 1.0
        if ti.static(len(self.lights) == 1):
            w_i, pdf = self.direction_of(0, x, xi)
        else:
            count = ti.static(len(self.lights))
            chosen = ti.min(ti.cast(xi.x * count, ti.i32), count - 1)
            for i in ti.static(range(len(self.lights))):
                if chosen == i:
                    w_i, pdf = self.direction_of(i, x, tm.vec2(xi.x * count - i, xi.y))
            pdf = self.pdf(x, w_i, no_hit())
        return w_i, pdf

    @ti.func
    def direction_of(self, i: ti.template(), x, xi):
        """(w_i, pdf) of one of the lights. Its radiance is looked up later, and only if it contributes."""
        w_i, pdf = tm.vec3(0, 1, 0), 1.0
        if ti.static(hasattr(self.lights[i], "sample_direction")):
            w_i, pdf = self.lights[i].sample_direction(xi)
        else:
            w_i, distance, light, pdf = self.lights[i].sample(x, xi)
        return w_i, pdf

    @ti.func
    def pdf(self, x, w_i, hit):
        """The density of ``sample`` at w_i, per solid angle."""
        total = 0.0
        for one in ti.static(self.lights):
            total += one.pdf(x, w_i, no_hit())
        return total / ti.static(max(1, len(self.lights)))
