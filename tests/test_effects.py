"""What a scene calls for is found from it; kernels are compiled for that alone, and the rest changes no bit.

What is compiled is seen in the kernels themselves: in the arguments that Taichi specialised them with, in the fields
that exist, and in code that raises as soon as a kernel looks at it.
"""

import numpy as np
import pytest
from shapes import SQUARE, with_spheres

import taichi_tracer as tt
from taichi_tracer.geometry import Mesh
from taichi_tracer.materials import Material

pytestmark = pytest.mark.usefixtures("f32")


VIEW = {"eye": (0, 0, 3), "at": (0, 0, 0), "up": (0, 1, 0), "fov": 50.0}


def scene_of(*materials, used=(0, 0), mesh=None, **options):
    """The square, each triangle with one of the materials, tried one by one: what compiles soonest."""
    if mesh is None:
        mesh = Mesh(*SQUARE, face_materials=np.array(used, np.int32), materials=list(materials or [Material()]))
    return tt.SceneData(mesh, **{"view": VIEW, "intersector": "brute_force", **options})


# ── what is found ──


def brdf_names(scene):
    return [scene.material_library.brdfs[i].name for i in scene.effects.brdfs]


def test_materials_call_for_their_brdfs():
    assert brdf_names(scene_of(Material())) == ["diffuse"]
    assert brdf_names(scene_of(Material(Ns=30), Material(Ns=1e21), used=(0, 1))) == ["mirror", "phong"]
    assert brdf_names(scene_of(Material(), Material(Ns=30))) == ["diffuse"]  # no triangle has the second


def test_the_mesh_calls_for_normals_spheres_and_culling():
    names = ("interpolated_normals", "spheres", "culling", "background")
    plain = scene_of().effects
    assert [name for name in names if getattr(plain, name)] == []
    mesh = with_spheres([(0, 0, 0, 1)], *SQUARE, face_culls=np.array([True, False]))
    mesh.normals, mesh.face_normals = np.array([[0, 0, 1.0]]), np.array([[0, -1, -1], [-1, -1, -1]])
    full = scene_of(mesh=mesh, background=(0.5, 0.5, 0.5)).effects
    assert all(getattr(full, name) for name in names)


# ── what is compiled ──


def test_a_scene_of_spheres_alone_says_so():
    scene = tt.SceneData(with_spheres([(0, 0, 0, 1), (3, 0, 0, 1)]))
    assert scene.effects.spheres
    assert (scene.num_spheres, scene.num_triangles) == (2, 0)
    assert any(line.startswith("spheres") and line.endswith("simulated, 2 of them") for line in scene.receipt())
    np.testing.assert_array_equal([scene.geometry.low, scene.geometry.high], [[-1, -1, -1], [4, 1, 1]])
