"""A recorded part gives what the part gives, and the log has what its methods got and gave."""

import numpy as np
import pytest

import taichi_tracer as tt

pytestmark = pytest.mark.usefixtures("f32")


def test_places_and_the_triangles_in_them_are_noted():
    """With the ids that the triangles have there."""
    transforms = np.tile(np.eye(4), (3, 1, 1))
    transforms[:, 0, 3] = -5, 0, 5
    transforms[1] = np.diag([-1.0, 1, 1, 1])
    mesh = tt.group([tt.Instances(tt.load_mesh("cube"), transforms)])
    renderer = tt.A1Renderer(tt.scene_from_mesh(mesh, instances="shared"), 33, 33).use("normal").render()
    found = renderer.explain(16, 16)
    assert [step.values["place"] for step in found.find("a place is entered")].count(1) == 1
    tried = found.find("a triangle is tried")
    assert {12 <= step.values["triangle_id"] < 24 for step in tried} == {True}


def test_a_view_with_numbers_of_its_own_can_be_explained():
    renderer = tt.A1Renderer(tt.load_scene_data("cube"), 16, 16).use("distance").render()
    assert renderer.explain(8, 8).mean == pytest.approx(renderer.image()[8, 8])
