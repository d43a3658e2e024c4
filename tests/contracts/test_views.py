"""Every registered view keeps its contract; those that break it in one point are found."""

import pytest
import taichi as ti
import taichi.math as tm
from support import ARCH

import taichi_tracer as tt
from contracts.registered import broken_parts, check_fails, every
from taichi_tracer.contracts import views
from taichi_tracer.system.registry import PARTS
from taichi_tracer.system.runtime import F64_ARCHS

pytestmark = pytest.mark.skipif(ARCH not in F64_ARCHS, reason=f"{ARCH} has no f64, with which f32 is compared")


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
class Rounding(tt.View):
    """The last bits of a distance, which are those of the precision."""

    name = "broken: shows rounding"

    @ti.func
    def color(self, hit):
        return tm.vec3(tm.fract(hit.distance * 1e6))


@ti.data_oriented
class Dice(tt.View):
    name = "broken: another colour each time"

    @ti.func
    def color(self, hit):
        return tm.vec3(ti.random(float))


BROKEN = {
    NotANumber: "are not finite",
    TooBright: "is above 1",
    Negative: "is below 0",
    ColouredMisses: "a miss is not black",
    Rounding: "differ between f32 and f64|is below 0",  # the latter with one rounding
    Dice: "the second picture differs",
}


ALIKE = "triangle_id", "distance", "barycentric"  # views that share their code with another


@pytest.fixture(scope="module")
def shots():
    """Pictures of the views, from one scene in each precision."""
    return views.shots_of([one for one in PARTS.all("integrator") if is_view(one) and one.name not in ALIKE])


@every("integrator", is_view, ALIKE)
def test_view(part, shots):
    views.check_view(part, shots)


@pytest.fixture(scope="module")
def broken_shots():
    """Pictures of the broken ones."""
    return views.shots_of([cls() for cls in BROKEN])


@pytest.mark.slow
@broken_parts(BROKEN)
def test_broken_view_is_found(broken, reason, broken_shots):
    check_fails(broken, lambda part: views.check_view(part, broken_shots), reason)
