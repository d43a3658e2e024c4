"""All lights of a scene together: what a ray sees of them, and a direction in which there may be light.

Lights that are infinitely far away lie over each other: a ray that meets nothing sees their sum, and one of them,
chosen with equal probability, is asked for a direction. The others are sampled one by one, by every integrator: a delta
light, because no other way finds it.
"""

import taichi as ti
import taichi.math as tm

from taichi_tracer.lights.base import Light
from taichi_tracer.ray import Ray, no_hit


@ti.data_oriented
class SceneLights:
    """The lights of one scene, as kernels ask for them.

    Args:
        lights: all of them.
        effects: what the scene calls for.

    Attributes:
        far: those that a ray may see where it meets nothing. single: those that are sampled one by one.
    """

    def __init__(self, lights: list[Light], effects) -> None:
        self.effects = effects
        self.far = tuple(light for light in lights if light.is_far and not light.is_delta)
        self.single = tuple(light for light in lights if not light.is_far or light.is_delta)

    def prepare(self) -> None:
        """Build what sampling the lights needs."""
        for light in (*self.far, *self.single):
            light.prepare()

    @ti.func
    def seen(self, ray, hit):
        """Radiance that a ray which meets ``hit`` sees of the lights themselves."""
        light = tm.vec3(0)
        for one in ti.static(self.far):
            light += one.radiance(ray, hit)
        for one in ti.static(self.single):
            light += one.radiance(ray, hit)
        return light

    @ti.func
    def sample_far(self, x, xi):
        """(w_i, pdf) of a direction in which there may be a far light; the density is that of all of them."""
        w_i, pdf = tm.vec3(0, 1, 0), 1.0
        if ti.static(len(self.far) == 1):
            w_i, pdf = self.direction_of(0, x, xi)
        else:
            count = ti.static(len(self.far))
            chosen = ti.min(ti.cast(xi.x * count, ti.i32), count - 1)
            for i in ti.static(range(len(self.far))):
                if chosen == i:
                    w_i, pdf = self.direction_of(i, x, tm.vec2(xi.x * count - i, xi.y))
            pdf = self.pdf_far(x, w_i)
        return w_i, pdf

    @ti.func
    def direction_of(self, i: ti.template(), x, xi):
        """(w_i, pdf) of one far light; its radiance is asked for when it is known whether it matters."""
        w_i, pdf = tm.vec3(0, 1, 0), 1.0
        if ti.static(hasattr(self.far[i], "sample_direction")):
            w_i, pdf = self.far[i].sample_direction(xi)
        else:
            w_i, distance, light, pdf = self.far[i].sample(x, xi)
        return w_i, pdf

    @ti.func
    def pdf_far(self, x, w_i):
        """The density of ``sample_far`` at w_i, per solid angle."""
        total = 0.0
        for one in ti.static(self.far):
            total += one.pdf(x, w_i, no_hit())
        return total / ti.static(max(1, len(self.far)))

    @ti.func
    def visible_far(self, intersector: ti.template(), surface, w_i, factor):
        """Radiance that arrives at a surface from far away along w_i; 0 where something is in the way.

        Where ``factor``, which the caller multiplies with, or the light itself is 0, no shadow ray is sent.
        """
        light = tm.vec3(0)
        if factor.max() > 0 and tm.dot(surface.geometric_normal, w_i) > 0:
            ray = Ray(origin=surface.origin, direction=w_i)
            for one in ti.static(self.far):
                light += one.radiance(ray, no_hit())
            if light.max() > 0:
                if intersector.is_occluded(ray, tm.inf):
                    light = tm.vec3(0)
        return light

    @ti.func
    def reflected_single(self, intersector: ti.template(), surface, rng):
        """Light of the lights that are sampled one by one, as a surface reflects it: one sample of each."""
        total = tm.vec3(0)
        for k in range(ti.static(len(self.single))):
            xi = rng.next_2d()
            w_i, distance, light, pdf = tm.vec3(0, 1, 0), tm.inf, tm.vec3(0), 1.0
            for i in ti.static(range(len(self.single))):
                if k == i:
                    w_i, distance, light, pdf = self.single[i].sample(surface.origin, xi)
            f_cos = surface.eval(w_i) * ti.max(0.0, tm.dot(surface.normal, w_i))
            light = f_cos * light / pdf
            if light.max() > 0 and tm.dot(surface.geometric_normal, w_i) > 0:
                ray = Ray(origin=surface.origin, direction=w_i)
                if not intersector.is_occluded(ray, distance):
                    total += light
        return total
