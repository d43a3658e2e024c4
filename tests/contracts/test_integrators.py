"""Every registered estimator has the right mean, and every integrator finite samples; broken ones are found."""

import pytest
import taichi as ti
import taichi.math as tm
from support import DEBUG

from contracts.registered import broken_parts, check_fails, every
from taichi_tracer.contracts import integrators
from taichi_tracer.formulas.warps import uniform_hemisphere
from taichi_tracer.integrators.direct_light import BrdfSampling, UniformHemisphere
from taichi_tracer.integrators.rt3 import Flat

pytestmark = pytest.mark.usefixtures("f32")


def takes_samples_of_light(part):
    """Whether its mean is radiance."""
    return part.what in ("estimator", "path")


ALIKE = ("uniform", "hemisphere", "brdf", "environment", "mis_balance", "mis_one_sample", "implicit", "explicit")


@every("integrator", takes_samples_of_light, ALIKE)
def test_estimator(part):
    integrators.check_estimator(part)


@pytest.mark.exhaustive
@every("integrator", takes_samples_of_light)
def test_estimator_on_everything(part):
    integrators.check_samples_are_finite(part)


@pytest.mark.long
@every("integrator", lambda part: part.what == "integrator", ("normal_map", "depth_map"))
def test_other_integrator(part):
    integrators.check_samples_are_finite(part)


@ti.data_oriented
class ThreePercentOff(UniformHemisphere):
    name = "broken: 3 % too bright"

    @ti.func
    def sample(self, scene, surface, xi):
        w_i = uniform_hemisphere(surface.normal, xi)
        return w_i, surface.eval_cosine(w_i) * (2.06 * tm.pi)


@ti.data_oriented
class ForgetsTheCosine(UniformHemisphere):
    """Its mean is right where light is the same from everywhere and the factor was tuned for that."""

    name = "broken: no cosine"

    @ti.func
    def sample(self, scene, surface, xi):
        w_i = uniform_hemisphere(surface.normal, xi)
        return w_i, surface.eval(w_i) * tm.pi


@ti.data_oriented
class ForgetsTheSun(BrdfSampling):
    name = "broken: delta lights are not sampled"

    @ti.func
    def radiance(self, scene, ray, hit, rng):
        L = scene.emitted(ray, hit, rng)
        if hit.is_hit:
            surface = scene.surface_at(ray, hit)
            w_i = surface.sample(rng.next_2d())
            weight = surface.weight(w_i)
            L += weight * scene.visible_radiance(surface, w_i, weight)
        return L


@ti.data_oriented
class ForgetsEmission(BrdfSampling):
    name = "broken: emission is not seen"

    @ti.func
    def radiance(self, scene, ray, hit, rng):
        L = tm.vec3(0)
        if hit.is_hit:
            L = self.reflected(scene, scene.surface_at(ray, hit), rng)
        else:
            L = scene.behind(ray, hit, rng)
        return L


@ti.data_oriented
class BlackSky(BrdfSampling):
    name = "broken: misses are black"

    @ti.func
    def radiance(self, scene, ray, hit, rng):
        return BrdfSampling.radiance(self, scene, ray, hit, rng) * ti.cast(hit.is_hit, float)


@ti.data_oriented
class SometimesNan(BrdfSampling):
    """0/0 once in a thousand samples."""

    name = "broken: NaN now and then"

    @ti.func
    def radiance(self, scene, ray, hit, rng):
        zero = ti.select(rng.next_1d() < 1e-3, 0.0, 1.0)
        return BrdfSampling.radiance(self, scene, ray, hit, rng) * (zero / zero)


with_statistics = pytest.mark.skipif(DEBUG, reason="with bounds checked, there are too few samples for statistics")


@pytest.mark.long
@with_statistics
@broken_parts(
    {
        ThreePercentOff: "a plane under constant light has the radiance",
        BlackSky: "a miss does not see the sky",
        SometimesNan: "samples are not finite",
    }
)
def test_broken_estimator_is_found(broken, reason):
    check_fails(broken, integrators.check_estimator, reason)


@pytest.mark.long
@with_statistics
@broken_parts(
    {
        ForgetsTheCosine: "a plane under sky and sun has the radiance",
        ForgetsTheSun: "a plane under sky and sun has the radiance",
        ForgetsEmission: "a plane under sky and sun has the radiance",
    }
)
def test_estimator_that_is_right_under_constant_light_is_found(broken, reason):
    check_fails(broken, integrators.check_sky_sun_and_emission, reason)


@ti.data_oriented
class Infinite(Flat):
    name = "broken: infinite on backs"

    @ti.func
    def color(self, scene, ray, hit):
        return tm.vec3(1 / (1 - ti.cast(hit.is_backfacing, float)))


@broken_parts({Infinite: "are not finite"})
def test_broken_integrator_is_found(broken, reason):
    check_fails(broken, integrators.check_samples_are_finite, reason)
