"""The solutions of the assignments are the package's own methods in plain words: the same numbers from both.

Where the formula is the same, the bits are the same. Where the package computes a number in another way, as the
watertight test does, they agree up to rounding; random answers agree in their means.
"""

import numpy as np
import pytest

import taichi_tracer as tt
from taichi_tracer.teaching import catalogue
from taichi_tracer.teaching.running import solution_of

pytestmark = pytest.mark.usefixtures("f32")


@pytest.mark.parametrize("view", ["normal"])
def test_the_views_have_the_same_bits(scene, view):
    """The solution's views, of what the package's camera and intersector found."""
    own = solution_of(catalogue.load("a1")).classes["A1Renderer"]
    pictures = [cls(scene, 64, 64).use(view).image() for cls in (own, tt.A1Renderer)]
    assert np.array_equal(*pictures)


@pytest.fixture(scope="module")
def scene():
    """The Cornell box."""
    made = tt.load_scene_data("cornell_box")
    yield made
    made.destroy()
