"""Every registered estimator has the right mean, and every integrator finite samples; broken ones are found."""

import pytest
import taichi as ti
import taichi.math as tm

from contracts.registered import broken_parts, check_fails, every
from taichi_tracer.contracts import integrators
from taichi_tracer.integrators.rt3 import Flat

pytestmark = pytest.mark.usefixtures("f32")


def takes_samples_of_light(part):
    """Whether its mean is radiance."""
    return part.what in ("estimator", "path")


ALIKE = ("uniform", "hemisphere", "brdf", "environment", "mis_balance", "mis_one_sample", "implicit", "explicit")


@every("integrator", takes_samples_of_light, ALIKE)
def test_estimator(part):
    integrators.check_sky_sun_and_emission(part)


@ti.data_oriented
class Infinite(Flat):
    name = "broken: infinite on backs"

    @ti.func
    def color(self, scene, ray, hit):
        return tm.vec3(1 / (1 - ti.cast(hit.is_backfacing, float)))


@broken_parts({Infinite: "are not finite"})
def test_broken_integrator_is_found(broken, reason):
    check_fails(broken, integrators.check_samples_are_finite, reason)
