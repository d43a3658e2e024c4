"""Every registered intersector answers as brute force, in each form; those that break that in one point are found."""

import numpy as np
import pytest
import taichi as ti
from support import DEBUG, data_file, start

import taichi_tracer as tt
from contracts.registered import broken_parts, check_fails
from taichi_tracer.contracts import intersectors
from taichi_tracer.forms import intersector_of
from taichi_tracer.ray import no_hit
from taichi_tracer.system.registry import PARTS


def every_form():
    """A decorator: runs the test with ``part`` and ``fast`` set to each form of an intersector, but for the truth."""
    forms = []
    for part in PARTS.all("intersector"):
        has_fast_form = intersector_of(part, True)[1].is_fast
        is_long = part is intersectors.TRUTH  # whose fast form is the same loop
        forms.append(pytest.param(part, True, id=part.name, marks=pytest.mark.long if is_long else ()))
        if has_fast_form and part is not intersectors.TRUTH:
            forms.append(pytest.param(part, False, id=f"{part.name}, plain", marks=pytest.mark.exhaustive))
    return pytest.mark.parametrize(("part", "fast"), forms)


@pytest.fixture(scope="module", autouse=True)
def _taichi():
    start("f32")
    intersectors.truth.cache_clear()  # of another precision


@every_form()
def test_intersector(part, fast):
    intersectors.check_intersector(part, fast)


@pytest.mark.long
@every_form()
@pytest.mark.parametrize("shape", intersectors.HARD, ids=lambda shape: shape.__name__)
def test_hard_shapes(part, fast, shape):
    intersectors.check_hard_shape(part, fast, shape)


@pytest.mark.exhaustive
@every_form()
@pytest.mark.parametrize("shape", intersectors.HARD_AND_LONG, ids=lambda shape: shape.__name__)
def test_hard_shapes_that_take_long(part, fast, shape):
    intersectors.check_hard_shape(part, fast, shape)


@pytest.mark.exhaustive
@pytest.mark.parametrize("file", ["suzanne.ply", "Duck.glb", "featuretype.STL"])
def test_real_meshes(file):
    from taichi_tracer.files import read

    mesh = read(data_file(file))
    rays = intersectors.rays_of_all_kinds(np.random.default_rng(20), mesh, 300 if DEBUG else 4_000)
    expected = intersectors.Answers(intersectors.TRUTH, False, mesh, "watertight", *rays)
    assert expected.hits["all"].is_hit.any()
    for part in PARTS.all("intersector"):
        for fast in (True, False):
            intersectors.check_same(part, fast, "watertight", expected, (mesh, *rays), file)


@ti.data_oriented
class MissesEveryThird(tt.RayIntersector):
    name = "broken: misses every third triangle"

    @ti.func
    def search(self, ray, t_min, t_max, any_hit: ti.template()):
        nearest, best = no_hit(), t_max
        for i in range(self.geometry.n_primitives):
            if i % 3 != 2:
                hit = self.intersect_primitive(ray, i, t_min)
                if hit.is_hit and t_min < hit.distance and hit.distance < best:
                    nearest, best = hit, hit.distance
        return nearest


@ti.data_oriented
class LastOfEquals(tt.RayIntersector):
    """Of equally near triangles it takes the last: two accelerators would not agree."""

    name = "broken: ties go to the highest id"

    @ti.func
    def search(self, ray, t_min, t_max, any_hit: ti.template()):
        nearest, best = no_hit(), t_max
        for i in range(self.geometry.n_primitives):
            hit = self.intersect_primitive(ray, i, t_min)
            if hit.is_hit and t_min < hit.distance and hit.distance < t_max and hit.distance <= best:
                nearest, best = hit, hit.distance
        return nearest


@ti.data_oriented
class ShadowsWithoutEnd(tt.RayIntersector):
    """Occlusion does not look at t_max."""

    name = "broken: blocked from beyond t_max"

    @ti.func
    def search(self, ray, t_min, t_max, any_hit: ti.template()):
        nearest, best = no_hit(), ti.select(any_hit, ti.math.inf, t_max)
        for i in range(self.geometry.n_primitives):
            hit = self.intersect_primitive(ray, i, t_min)
            if hit.is_hit and t_min < hit.distance and hit.distance < best:
                nearest, best = hit, hit.distance
        return nearest


@ti.data_oriented
class ClosedInterval(tt.RayIntersector):
    name = "broken: a hit at t_max counts"

    @ti.func
    def search(self, ray, t_min, t_max, any_hit: ti.template()):
        nearest, best = no_hit(), t_max
        for i in range(self.geometry.n_primitives):
            hit = self.intersect_primitive(ray, i, t_min)
            if hit.is_hit and t_min < hit.distance:
                if hit.distance < best or (hit.distance == t_max and not nearest.is_hit):
                    nearest, best = hit, hit.distance
        return nearest


@ti.data_oriented
class ForgetsSpheres(tt.RayIntersector):
    name = "broken: primitives are triangles"

    @ti.func
    def search(self, ray, t_min, t_max, any_hit: ti.template()):
        nearest, best = no_hit(), t_max
        for i in range(self.geometry.n_triangles):
            hit = self.triangle_hit(ray, i, t_min)
            if hit.is_hit and t_min < hit.distance and hit.distance < best:
                nearest, best = hit, hit.distance
        return nearest


@pytest.mark.long
@broken_parts(
    {
        MissesEveryThird: "triangle_id is .* not",
        LastOfEquals: "triangle_id is .* not",
        ShadowsWithoutEnd: "0.5 < t < 1.5: occluded and intersect do not agree",
        ClosedInterval: "before the nearest hit",
        ForgetsSpheres: "all_primitives, all: triangle_id",
    }
)
def test_broken_intersector_is_found(broken, reason):
    check_fails(broken, intersectors.check_intersector, reason)
