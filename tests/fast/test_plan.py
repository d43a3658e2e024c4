"""A fast form runs only while no method of the plain one is replaced, and the receipt says which runs and why."""

import pytest
import taichi as ti
from shapes import SQUARE

import taichi_tracer as tt
from taichi_tracer.fast.far_light import FarLight
from taichi_tracer.fast.nearest import FastBruteForce
from taichi_tracer.fast.plan import intersector_of
from taichi_tracer.fast.primary_hits import PrimaryHits
from taichi_tracer.fast.wide_bvh import WideBVH
from taichi_tracer.forms import EyeRays, has_fast_form
from taichi_tracer.integrators.direct_light import BrdfSampling
from taichi_tracer.intersectors.bvh import BVHRayIntersector
from taichi_tracer.ray_intersector import BruteForceRayIntersector, RayIntersector
from taichi_tracer.system.registry import PARTS

PAIRS = [(BVHRayIntersector, WideBVH), (BruteForceRayIntersector, FastBruteForce)]


pytestmark = pytest.mark.usefixtures("f32")


@ti.func
def never(self, ray, triangle_id):
    """A triangle test that no ray passes."""
    return tt.HitData(is_hit=0, triangle_id=-1, distance=ti.math.inf)


@pytest.mark.parametrize(("plain", "quick"), PAIRS)
def test_the_fast_form_stands_in_while_nothing_is_replaced(plain, quick):
    runs, form = intersector_of(plain, True)
    assert runs is quick
    assert form.is_fast
    assert str(form) == f"{'rays':<15} {quick.form}: no method of {plain.__name__} is replaced"


@pytest.mark.parametrize(("plain", "quick"), PAIRS)
def test_the_plain_form_runs_where_it_is_asked_for(plain, quick):
    runs, form = intersector_of(plain, False)
    assert (runs, form.is_fast, form.why) == (plain, False, "fast=False")


@pytest.mark.parametrize(("plain", "quick"), PAIRS)
@pytest.mark.parametrize("owner", ["the class", "its base"])
def test_the_plain_form_runs_where_a_method_was_assigned(monkeypatch, plain, quick, owner):
    monkeypatch.setattr(plain if owner == "the class" else RayIntersector, "intersect_triangle", never)
    runs, form = intersector_of(plain, True)
    assert (runs, form.is_fast) == (plain, False)
    assert form.why == f"{plain.__name__} replaces intersect_triangle"
    scene = tt.scene_from_mesh(*SQUARE, intersector=plain)
    assert not scene.intersect([0.5, 0.25, 1], [0, 0, -1]).is_hit[0]
    assert str(form) in scene.receipt()


def test_a_class_of_ones_own_is_its_own_form():
    class Mine(BVHRayIntersector):
        name = "mine"

    runs, form = intersector_of(Mine, True)
    assert runs is Mine
    assert (form.runs, form.why, form.is_fast) == ("Mine, as it is written", "it has no fast form", False)


def test_an_object_is_its_own_form():
    scene = tt.scene_from_mesh(*SQUARE, intersector=BVHRayIntersector())
    assert type(scene.ray_intersector) is BVHRayIntersector
    assert scene.forms[0].why == "it was given as an object"
    assert scene.intersect([0.5, 0.25, 1], [0, 0, -1]).is_hit[0]


def test_a_class_without_a_fast_form_runs_as_it_is():
    assert [has_fast_form(plain) for plain, _ in PAIRS] == [True, True]
    assert not has_fast_form(RayIntersector)


# ── eye rays ──


@pytest.mark.parametrize(
    ("options", "why"),
    [
        ({}, "camera and intersector belong to the package"),
        ({"fast": False}, "fast=False"),
        ({"intersector": BVHRayIntersector()}, "BVHRayIntersector is a plain form"),
    ],
)
def test_the_receipt_says_whether_hits_are_kept_and_why(options, why):
    renderer = tt.A1Renderer(tt.scene_from_mesh(*SQUARE, **options), 8, 8)
    form = renderer.plan.form
    assert (form.what, form.why, form.is_fast) == ("eye rays", why, options == {})
    assert isinstance(renderer.eye_rays, PrimaryHits if options == {} else EyeRays)
    assert str(form) in renderer.receipt()


def test_hits_of_a_camera_or_a_sampler_of_ones_own_are_not_kept():
    class MyCamera(tt.Camera):
        @ti.func
        def generate_ray(self, pixel_x, pixel_y):
            return tt.Ray(self.eye, self.z)

    class MySampler(type(PARTS.find("sampler", "sobol"))):
        def start(self, seed, x, y, index):
            return super().start(seed, x, y, index)

    scene = tt.scene_from_mesh(*SQUARE)
    assert tt.A1Renderer(scene, camera=MyCamera(8, 8)).plan.form.why == "MyCamera replaces generate_ray"
    assert tt.A1Renderer(scene, 8, 8, sampler=MySampler()).plan.form.why == "MySampler replaces start"


# ── estimators ──


def form_of(name, **options):
    """What kernels get for an estimator."""
    renderer = tt.A3Renderer(tt.scene_from_mesh(*SQUARE, **options), 8, 8).use(name)
    return renderer.plan.integrator(renderer.kernel_scene()), renderer.active


@pytest.mark.parametrize("name", ["uniform", "hemisphere", "brdf", "environment", "mis", "mis_balance"])
def test_estimators_have_a_form_for_light_from_far_away(name):
    form, active = form_of(name, environment="studio")
    assert isinstance(form, FarLight)
    assert (form.plain, form.name, form.techniques) == (active, name, 2 if name.startswith("mis") else 1)


def test_other_scenes_and_estimators_run_as_they_are_written():
    class Darker(BrdfSampling):
        name = "darker"

    lamp = tt.Material(Ke=(1, 1, 1))
    cases = [("mis", {"material": lamp, "environment": "studio"}), ("mis", {"environment": "black"})]
    cases += [("mis", {"environment": "studio", "fast": False}), (Darker(), {"environment": "studio"})]
    cases += [("mis_one_sample", {"environment": "studio"})]
    for name, options in cases:
        form, active = form_of(name, **options)
        assert form is active


def test_going_back_to_an_estimator_compiles_nothing():
    renderer = tt.A2Renderer(tt.scene_from_mesh(*SQUARE, environment="studio"), 8, 8)
    scene = renderer.kernel_scene()
    first = renderer.use("brdf").plan.integrator(scene)
    assert renderer.use("uniform").plan.integrator(scene) is not first
    assert renderer.use("brdf").plan.integrator(scene) is first


@pytest.mark.parametrize("name", ["bvh", "brute_force"])
def test_what_a_fast_form_defines_itself_is_not_replaced(name, f32):
    intersector = tt.load_scene_data("cube", intersector=name).ray_intersector
    assert type(intersector).__name__ in ("WideBVH", "FastBruteForce")
    assert intersector.replaced == ()
