"""A fast form runs only while no method of the plain one is replaced, and the receipt says which runs and why."""

import pytest
import taichi as ti
from shapes import SQUARE
from support import start
from taichi_tracer.fast.stand_ins import Form, intersector_class

import taichi_tracer as tt
from taichi_tracer.fast.nearest import FastBruteForce
from taichi_tracer.fast.wide_bvh import WideBVH
from taichi_tracer.intersectors.bvh import BVHRayIntersector
from taichi_tracer.ray_intersector import BruteForceRayIntersector, RayIntersector

PAIRS = [(BVHRayIntersector, WideBVH), (BruteForceRayIntersector, FastBruteForce)]


@pytest.fixture(scope="module", autouse=True)
def _taichi():
    start("f32")


@ti.func
def never(self, ray, triangle_id):
    """A triangle test that no ray passes."""
    return tt.HitData(is_hit=0, triangle_id=-1, distance=ti.math.inf)


@pytest.mark.parametrize(("plain", "quick"), PAIRS)
def test_the_fast_form_stands_in_while_nothing_is_replaced(plain, quick):
    runs, form = intersector_class(plain, True)
    assert runs is quick
    assert form.is_fast
    assert str(form) == f"{'rays':<15} {quick.form}: no method of {plain.__name__} is replaced"


@pytest.mark.parametrize(("plain", "quick"), PAIRS)
def test_the_plain_form_runs_where_it_is_asked_for(plain, quick):
    runs, form = intersector_class(plain, False)
    assert (runs, form.is_fast, form.why) == (plain, False, "fast=False")


@pytest.mark.parametrize(("plain", "quick"), PAIRS)
@pytest.mark.parametrize("owner", ["the class", "its base"])
def test_the_plain_form_runs_where_a_method_was_assigned(monkeypatch, plain, quick, owner):
    monkeypatch.setattr(plain if owner == "the class" else RayIntersector, "intersect_triangle", never)
    runs, form = intersector_class(plain, True)
    assert (runs, form.is_fast) == (plain, False)
    assert form.why == f"{plain.__name__} replaces intersect_triangle"
    scene = tt.scene_from_mesh(*SQUARE, intersector=plain)
    assert not scene.intersect([0.5, 0.25, 1], [0, 0, -1]).is_hit[0]
    assert str(form) in scene.receipt()


def test_a_class_of_ones_own_is_its_own_form():
    class Mine(BVHRayIntersector):
        name = "mine"

    runs, form = intersector_class(Mine, True)
    assert runs is Mine
    assert (form.runs, form.why, form.is_fast) == ("Mine, as it is written", "it has no fast form", False)


def test_an_object_is_its_own_form():
    scene = tt.scene_from_mesh(*SQUARE, intersector=BVHRayIntersector())
    assert type(scene.ray_intersector) is BVHRayIntersector
    assert scene.forms[0].why == "it was given as an object"
    assert scene.intersect([0.5, 0.25, 1], [0, 0, -1]).is_hit[0]


def test_a_form_in_words():
    assert str(Form("rays", "one by one", "because")) == "rays            one by one: because"
