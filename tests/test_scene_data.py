"""Questions asked of a scene from Python, and what a scene is made of: its parts, its effects, its fingerprint."""

import numpy as np
import pytest
import taichi as ti
import taichi.math as tm
from shapes import SQUARE
from support import start

import taichi_tracer as tt
from taichi_tracer.geometry import Mesh
from taichi_tracer.lights.base import Light
from taichi_tracer.picture.checkpoint import fingerprint
from taichi_tracer.scene_data import again

pytestmark = pytest.mark.usefixtures("f32")


@pytest.fixture(scope="module")
def square():
    return tt.scene_from_mesh(*SQUARE)


def test_answers_have_the_promised_shapes_and_values(square):
    hits = square.intersect([[0.5, 0.25, 2], [5, 5, 2]], [[0, 0, -1], [0, 0, -1]])
    assert hits.is_hit.dtype == bool
    np.testing.assert_array_equal(hits.is_hit, [True, False])
    np.testing.assert_array_equal(hits.distance, [2, np.inf])
    np.testing.assert_array_equal(hits.triangle_id, [0, -1])
    np.testing.assert_allclose(hits.barycentric_coords, [[0.125, 0.625], [0, 0]])
    np.testing.assert_array_equal(hits.normal, [[0, 0, 1], [0, 0, 0]])
    np.testing.assert_array_equal(hits.material_id, [0, -1])
    assert len(hits) == 2


def test_f64_rays_are_traced_in_f64():
    """A hit 1e-12 beyond t_min is one, and its distance has 15 digits."""
    start("f64")
    scene = tt.scene_from_mesh(*SQUARE)
    hits = scene.intersect([0.2, 0.1, 1 + 1e-12], [0, 0, -1], t_min=1.0)
    assert hits.is_hit[0]
    assert hits.distance.dtype == np.float64
    np.testing.assert_allclose(hits.distance[0] - 1, 1e-12, rtol=1e-3)
    start("f32")


def test_destroyed_scenes_free_their_memory_once():
    scene = tt.scene_from_mesh(*SQUARE)
    scene.destroy()
    scene.destroy()
    assert tt.scene_from_mesh(*SQUARE).intersect([0, 0.1, 1], [0, 0, -1]).is_hit[0]


# ── what a scene is made of ──


@ti.data_oriented
class Lamp(Light):
    """A point light."""

    name, is_delta = "lamp", True

    def __init__(self, power=1.0):
        self.power = power

    @ti.func
    def sample(self, x, xi):
        return tm.vec3(0, 0, 1), 1.0, tm.vec3(self.power), 1.0


def test_a_scene_once_more_differs_only_in_what_is_asked_for():
    vertices, faces = SQUARE
    line = np.concatenate([faces, [[0, 1, 1]]])
    with pytest.warns(UserWarning, match="1 of 3 triangles dropped"):
        scene = tt.scene_from_mesh(vertices, line, environment="studio", up_axis="z", lights=[Lamp()])
    other = again(scene, triangle_test="moller_trumbore")
    assert other.ray_intersector.triangle_test == "moller_trumbore"
    assert fingerprint(other) == fingerprint(scene)
    assert other.environment is scene.environment
    assert other.notes == scene.notes
    assert type(other.ray_intersector) is type(scene.ray_intersector)


def test_lights_of_the_file_and_the_ground_are_there_once():
    scene = tt.scene_from_mesh(Mesh(*SQUARE, lights=[("point", {})]))
    with_ground = again(scene, ground=True)
    without = again(again(with_ground), ground=False)
    assert [len(one.lights) for one in (scene, with_ground, without)] == [1, 1, 1]
    assert [one.num_triangles for one in (scene, with_ground, without)] == [2, 4, 2]


def test_a_scene_that_cannot_be_made_leaves_taichi_usable():
    with pytest.raises(tt.InputError):
        tt.SceneData(Mesh(*SQUARE), brdfs=[7])
    with pytest.raises(tt.InputError):
        tt.SceneData(Mesh(*SQUARE), lights=["no such light"])
    assert tt.scene_from_mesh(*SQUARE).intersect([0, 0.1, 1], [0, 0, -1]).is_hit[0]
