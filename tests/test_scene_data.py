"""Questions asked of a scene from Python, and what a scene is made of: its parts, its effects, its fingerprint."""

import numpy as np
import pytest
import taichi as ti
import taichi.math as tm
from shapes import SQUARE, with_spheres
from support import start

import taichi_tracer as tt
from taichi_tracer.geometry import Mesh
from taichi_tracer.lights.base import Light
from taichi_tracer.scene_data import again, described

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


def test_one_ray_meets_many_and_none_is_fine(square):
    assert len(square.intersect([0, 0, 1], [[0, 0, -1], [0, 0, 1], [0, 1, 0]])) == 3
    assert len(square.intersect([0, 0, 1], [0, 0, -1])) == 1
    assert len(square.intersect(np.zeros((0, 3)), np.zeros((0, 3)))) == 0
    assert len(square.intersect([], [])) == 0
    assert len(square.occluded([], [])) == 0
    np.testing.assert_array_equal(
        square.occluded([0, 0.1, 1], [0, 0, -1], t_max=[0.5, 1.0, 1.5, np.inf]), [False, False, True, True]
    )


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


def test_a_change_of_the_scene_makes_its_kernels_anew_and_is_counted():
    scene = tt.scene_from_mesh(*SQUARE, environment="white")
    before, version = scene.in_kernels(), scene.version
    assert scene.in_kernels() is before
    scene.set_environment("white")
    assert scene.version == version + 1
    assert scene.in_kernels() is not before
    scene.set_background((1, 0, 0))
    assert scene.version == version + 2
    assert scene.in_kernels().background is scene.background


def test_a_scene_once_more_differs_only_in_what_is_asked_for():
    vertices, faces = SQUARE
    line = np.concatenate([faces, [[0, 1, 1]]])
    with pytest.warns(UserWarning, match="1 of 3 triangles dropped"):
        scene = tt.scene_from_mesh(vertices, line, environment="studio", up_axis="z", lights=[Lamp()])
    other = again(scene, triangle_test="moller_trumbore")
    assert other.ray_intersector.triangle_test == "moller_trumbore"
    assert other.fingerprint() == scene.fingerprint()
    assert other.environment is scene.environment
    assert other.notes == scene.notes
    assert type(other.ray_intersector) is type(scene.ray_intersector)


def test_the_receipt_says_what_is_simulated_and_which_form_runs():
    fast, plain = (tt.scene_from_mesh(*SQUARE, fast=fast).receipt() for fast in (True, False))
    assert fast[:-1] == plain[:-1]
    assert fast[-1].startswith("rays            hierarchy of eight boxes a node: ")
    assert plain[-1] == "rays            BVHRayIntersector, the plain form: fast=False"


def test_a_scene_that_cannot_be_made_leaves_taichi_usable():
    with pytest.raises(tt.InputError):
        tt.SceneData(Mesh(*SQUARE), brdfs=[7])
    with pytest.raises(tt.InputError):
        tt.SceneData(Mesh(*SQUARE), lights=["no such light"])
    assert tt.scene_from_mesh(*SQUARE).intersect([0, 0.1, 1], [0, 0, -1]).is_hit[0]


def test_meshes_and_spheres_are_counted():
    scene = tt.SceneData(with_spheres([(0, 0, 0, 1), (2, 0, 0, 1)], *SQUARE))
    assert (scene.num_triangles, scene.num_spheres) == (2, 2)
    assert "2 triangles, 2 spheres, 1 materials, bvh, watertight" in repr(scene)


def test_the_fingerprint_does_not_depend_on_how_materials_are_shown():
    materials = [tt.Material("a", Kd=(1, 0, 0)), tt.Material(extra={"pr": (0.5,)})]
    assert described(materials) == (
        "[Material(name='a', Kd=(1, 0, 0), Ka=(0.0, 0.0, 0.0), Ks=(0.0, 0.0, 0.0), Ke=(0.0, 0.0, 0.0), Ns=1.0, Ni=1.0, "
        "d=1.0, alpha_x=0.0, alpha_y=0.0, F0=(0.0, 0.0, 0.0), extra={}), Material(name='default', Kd=(0.8, 0.8, 0.8), "
        "Ka=(0.0, 0.0, 0.0), Ks=(0.0, 0.0, 0.0), Ke=(0.0, 0.0, 0.0), Ns=1.0, Ni=1.0, d=1.0, alpha_x=0.0, alpha_y=0.0, "
        "F0=(0.0, 0.0, 0.0), extra={'pr': (0.5,)})]"
    )
