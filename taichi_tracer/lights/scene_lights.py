"""All lights of a scene together: what a ray sees of them, and how directions to them are sampled.

A ray that hits nothing sees the sum of all lights that are infinitely far away. A sample of these lights chooses one of
them, all with equal probability, and takes its direction. Every integrator samples each of the other lights separately.
Delta lights are among the others, because no random direction finds them.
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
        effects: the effects that the scene calls for.

    Attributes:
        far: the lights that a ray may see if it hits nothing. single: the lights that are sampled one by one.
    """

    def __init__(self, lights: list[Light], effects) -> None:
        self.effects = effects
        self.far = tuple(light for light in lights if light.is_far and not light.is_delta)
        self.single = tuple(light for light in lights if not light.is_far or light.is_delta)
        self._prepared: list[Light] = []

    def prepare(self, draws_far: bool = True) -> None:
        """Build the tables with which the lights are sampled, unless they were built already.

        Args:
            draws_far: whether directions are drawn from the far lights; from the others every estimator draws them.
        """
        for light in (*(self.far if draws_far else ()), *self.single):
            if light not in self._prepared:
                light.prepare()
                self._prepared.append(light)

    @ti.func
    def seen(self, ray, hit):
        """Radiance that a ray sees directly from the lights; ``hit`` is what the ray hits."""
        light = tm.vec3(0)
        for one in ti.static(self.far):
            light += one.radiance(ray, hit)
        for one in ti.static(self.single):
            light += one.radiance(ray, hit)
        return light

    @ti.func
    def sample_far(self, x, xi):
        """(w_i, pdf) of a direction towards a far light; the pdf is the mean of the densities of all far lights."""
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
        """(w_i, pdf) of one far light. Its radiance is looked up later, and only if it contributes."""
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
        """Radiance that arrives at a surface from far away, from the direction w_i; 0 if something blocks it.

        The caller multiplies the result by ``factor``. If ``factor`` or the light is 0, no shadow ray is sent.
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
        """Light of the ``single`` lights that a surface reflects to the viewer: one sample of each light."""
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
