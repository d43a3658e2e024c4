"""All lights of a scene together: what a ray sees of them, and how directions to them are sampled.

A ray that hits nothing sees the sum of all lights that are infinitely far away. A sample of these lights chooses one of
them, all with equal probability, and takes its direction. A ray that hits a surface with Ke > 0 sees a lamp. If a scene
has both, a sample is one of a mixture: with the probability ``FAR_SHARE`` it goes to a light that is far away,
otherwise to a lamp (A3-4). Every integrator samples each of the other lights separately. Delta lights are among the
others, because no random direction finds them.
"""

import taichi as ti

from taichi_tracer.formulas import vector_math as tm
from taichi_tracer.lights.base import Light
from taichi_tracer.lights.lamps import Lamps
from taichi_tracer.ray import Ray, no_hit

FAR_SHARE = 0.5  # of the samples of a scene with both: they go to what is far away


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
        """(w_i, ∞, radiance, pdf) of a direction towards one of the lights; the pdf is the mean of all densities."""
        if ti.static(len(self.lights) == 1):
            return self.lights[0].sample(x, xi)
        w_i, distance, light, pdf = tm.vec3(0, 1, 0), tm.inf, tm.vec3(0), 1.0
        count = ti.static(len(self.lights))
        chosen = ti.min(ti.cast(xi.x * count, ti.i32), count - 1)
        for i in ti.static(range(len(self.lights))):
            if chosen == i:
                w_i, distance, light, pdf = self.lights[i].sample(x, tm.vec2(xi.x * count - i, xi.y))
        return w_i, distance, self.radiance(Ray(origin=x, direction=w_i), no_hit()), self.pdf(x, w_i, no_hit())

    @ti.func
    def pdf(self, x, w_i, hit):
        """The density of ``sample`` at w_i, per solid angle."""
        total = 0.0
        for one in ti.static(self.lights):
            total += one.pdf(x, w_i, no_hit())
        return total / ti.static(max(1, len(self.lights)))


@ti.data_oriented
class SceneLights:
    """The lights of one scene, as kernels ask for them.

    Args:
        lights: all of them, except the lamps.
        lamps: the surfaces that emit; None if their emission is not to be looked up.

    Attributes:
        far: the lights that a ray may see if it hits nothing. from_far: these together, as one light.
        single: the other lights, which are summed one by one: those without a direction (``ambient``), and those of
            which one sample each is ``drawn``.
        has_lamps: whether a surface emits light. can_be_met: whether a ray can meet a lamp or a light that is far away.
        far_share: the probability with which ``sample`` chooses a far light.
    """

    def __init__(self, lights: list[Light], lamps: Lamps | None = None) -> None:
        self.lamps = lamps
        self.far = tuple(light for light in lights if light.is_far and not light.is_delta)
        self.single = tuple(light for light in lights if not light.is_far or light.is_delta)
        self.ambient = tuple(light for light in self.single if light.is_ambient)
        self.drawn = tuple(light for light in self.single if not light.is_ambient)
        self.from_far = FarLights(self.far)
        self.has_lamps = lamps is not None and lamps.count > 0
        self.can_be_met = self.has_lamps or len(self.far) > 0
        self.far_share = 1.0 if not self.has_lamps else FAR_SHARE if self.far else 0.0
        self._prepared: list[Light] = []

    def prepare(self, draws: bool = True) -> None:
        """Build the tables with which the lights are sampled, unless they were built already.

        Args:
            draws: whether directions are drawn from the far lights and the lamps; from the others every estimator draws
                them.
        """
        drawn = self.far if self.lamps is None else (*self.far, self.lamps)
        for light in (*(drawn if draws else ()), *self.single):
            if light not in self._prepared:
                light.prepare()
                self._prepared.append(light)

    @ti.func
    def arriving(self, ray, hit):
        """Radiance that arrives along a ray without any reflection, from a lamp or from far away."""
        light = tm.vec3(0)
        if hit.is_hit:
            if ti.static(self.has_lamps):
                light = self.lamps.emitted(hit)
        else:
            light = self.from_far.radiance(ray, hit)
        return light

    @ti.func
    def sample(self, x, n, xi):
        """(w_i, distance, radiance, pdf) of a direction from x to a lamp or to a far light; n is the normal at x.

        The first random number chooses between far lights and lamps; what it leaves chooses the lamp and the direction.
        """
        if ti.static(self.far_share == 0):
            return self.lamps.sample_from(x, n, xi)
        if ti.static(self.far_share == 1):
            return self.from_far.sample(x, xi)
        w_i, distance, light, pdf = tm.vec3(0, 1, 0), tm.inf, tm.vec3(0), 1.0
        if xi.x < self.far_share:
            w_i, distance, light, pdf = self.from_far.sample(x, tm.vec2(xi.x / self.far_share, xi.y))
            pdf *= self.far_share
        else:
            rest = (xi.x - self.far_share) / (1 - self.far_share)
            w_i, distance, light, pdf = self.lamps.sample_from(x, n, tm.vec2(rest, xi.y))
            pdf *= 1 - self.far_share
        return w_i, distance, light, pdf

    @ti.func
    def pdf(self, x, n, w_i, hit):
        """The density of ``sample`` at what the ray from x along w_i hits, per solid angle; 0 if it finds no light."""
        pdf = 0.0
        if hit.is_hit:
            if ti.static(self.has_lamps):
                pdf = (1 - self.far_share) * self.lamps.pdf_from(x, n, w_i, hit)
        else:
            pdf = self.far_share * self.from_far.pdf(x, w_i, hit)
        return pdf

    @ti.func
    def reflected_ambient(self, material):
        """What a surface shows of all ambient lights."""
        light = tm.vec3(0)
        for one in ti.static(self.ambient):
            light += one.reflected(material)
        return light

    @ti.func
    def sample_drawn(self, k, x, xi):
        """(w_i, distance, radiance, pdf) of a direction from x to the k-th of ``drawn``."""
        w_i, distance, light, pdf = tm.vec3(0, 1, 0), tm.inf, tm.vec3(0), 1.0
        for i in ti.static(range(len(self.drawn))):
            if k == i:
                w_i, distance, light, pdf = self.drawn[i].sample(x, xi)
        return w_i, distance, light, pdf
