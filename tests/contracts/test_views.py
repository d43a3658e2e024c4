"""Every registered view keeps its contract; those that break it in one point are found."""

import pytest
import taichi as ti
import taichi.math as tm

import taichi_tracer as tt
from contracts.registered import broken_parts, check_fails, every
from taichi_tracer.contracts import integrators

pytestmark = pytest.mark.usefixtures("f32")


def is_view(part):
    """Whether an integrator is a view."""
    return part.what == "view"


@ti.data_oriented
class NotANumber(tt.View):
    name = "broken: NaN on backs"

    @ti.func
    def color(self, hit):
        return tm.vec3(tm.sqrt(-ti.cast(hit.is_backfacing, float)))


@ti.data_oriented
class TooBright(tt.View):
    name = "broken: above 1"

    @ti.func
    def color(self, hit):
        return tm.vec3(hit.distance)


@ti.data_oriented
class Negative(tt.View):
    name = "broken: below 0"

    @ti.func
    def color(self, hit):
        return tm.clamp(hit.normal, -1, 1)


@ti.data_oriented
class ColouredMisses(tt.View):
    name = "broken: misses are not black"

    @ti.func
    def radiance(self, scene, ray, hit, rng):
        return tm.vec3(1) - 0.5 * abs(hit.normal)


@ti.data_oriented
class Dice(tt.View):
    name = "broken: another colour each time"

    @ti.func
    def color(self, hit):
        return tm.vec3(ti.random(float))


BROKEN = {
    NotANumber: "are not finite",
    TooBright: "above 1",
    Negative: "below -1e-06",
    ColouredMisses: "a miss is not black",
    Dice: "the second picture differs",
}


@every("integrator", is_view, alike=("triangle_id", "distance", "barycentric"))  # they share their code with another
def test_view(part):
    integrators.check_view(part)


@broken_parts(BROKEN)
def test_broken_view_is_found(broken, reason):
    check_fails(broken, integrators.check_view, reason)
