"""The door to the fast forms, and the plain plan, which runs where there are none."""

import numpy as np
import pytest
from shapes import SQUARE

import taichi_tracer as tt
from taichi_tracer import forms
from taichi_tracer.forms import NO_FAST_FORMS, EyeRays, Form, Plan
from taichi_tracer.intersectors.bvh import BVHRayIntersector

pytestmark = pytest.mark.usefixtures("f32")


@pytest.fixture
def _no_fast_forms(monkeypatch):
    """A package from which the folder ``fast`` was taken away."""
    monkeypatch.setattr(forms, "fast_plan", lambda: None)


def test_a_form_in_words():
    assert str(Form("rays", "one by one", "because")) == "rays            one by one: because"


@pytest.mark.usefixtures("_no_fast_forms")
def test_without_fast_forms_everything_is_plain_and_the_receipt_says_so():
    scene = tt.scene_from_mesh(*SQUARE, environment="studio")
    assert type(scene.ray_intersector) is BVHRayIntersector
    renderer = tt.A2Renderer(scene, 8, 8).use("mis")
    assert type(renderer.plan) is Plan
    assert renderer.plan.integrator(renderer.kernel_scene()) is renderer.active
    assert isinstance(renderer.eye_rays, EyeRays)
    assert sum(NO_FAST_FORMS in line for line in renderer.receipt()) == 2


def test_both_plans_give_the_same_bits(monkeypatch):
    found = []
    for _ in range(2):
        scene = tt.scene_from_mesh(*SQUARE, environment="studio", color=(0.5, 0.4, 0.3))
        found.append(tt.A2Renderer(scene, 16, 16).use("mis").render(2).image())
        monkeypatch.setattr(forms, "fast_plan", lambda: None)
    np.testing.assert_array_equal(*found)
    assert found[0].max() > 0
