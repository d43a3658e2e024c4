"""What a scene calls for is found from it; kernels are compiled for that alone, and the rest changes no bit.

What is compiled is seen in the kernels themselves: in the arguments that Taichi specialised them with, in the fields
that exist, and in code that raises as soon as a kernel looks at it.
"""

import numpy as np
import pytest
import taichi as ti
import taichi.math as tm
from shapes import SQUARE, with_spheres

import taichi_tracer as tt
from taichi_tracer.background import Background
from taichi_tracer.brdfs.base import Brdf
from taichi_tracer.effects import Effects
from taichi_tracer.environment import Environment
from taichi_tracer.geometry import Mesh
from taichi_tracer.lights.base import Light
from taichi_tracer.lights.environment_light import EnvironmentLight
from taichi_tracer.lights.scene_lights import FarLights
from taichi_tracer.materials import Material, MaterialLibrary
from taichi_tracer.ray_intersector import RayIntersector
from taichi_tracer.renderer import A2Renderer
from taichi_tracer.scene_in_kernels import SceneInKernels

pytestmark = pytest.mark.usefixtures("f32")


@ti.data_oriented
class Lamp(Light):
    """A point."""

    name, is_delta = "lamp", True

    @ti.func
    def sample(self, x, xi):
        d = tm.vec3(0, 0, 2) - x
        return tm.normalize(d), d.norm(), tm.vec3(1) / d.norm_sqr(), 1.0


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


def test_an_environment_with_a_query_of_its_own_is_an_image():
    @ti.data_oriented
    class Own(Environment):
        @ti.func
        def query_ray(self, ray):
            return tm.vec3(1)

    assert scene_of(environment=Own(np.zeros((2, 4, 3)))).effects.environment == "image"


def test_the_mesh_calls_for_normals_spheres_and_culling():
    names = ("interpolated_normals", "spheres", "culling", "background")
    plain = scene_of().effects
    assert [name for name in names if getattr(plain, name)] == []
    mesh = with_spheres([(0, 0, 0, 1)], *SQUARE, face_culls=np.array([True, False]))
    mesh.normals, mesh.face_normals = np.array([[0, 0, 1.0]]), np.array([[0, -1, -1], [-1, -1, -1]])
    full = scene_of(mesh=mesh, background=(0.5, 0.5, 0.5)).effects
    assert all(getattr(full, name) for name in names)


def test_the_receipt_names_every_effect_with_its_reason():
    scene = scene_of(Material(), environment="white", lights=[Lamp()])
    lines = scene.effects.receipt()
    text = "\n".join(lines)
    for line in (
        "phong           not simulated, no triangle has a material with Ns > 1",
        "diffuse         simulated, 1 of 1 materials",
        "look-up         not simulated, its radiance is the same in every direction",
        "light lamp      simulated, Lamp",
        "emitters        not simulated, no triangle has a material with Ke > 0",
        "vertex normals  not simulated, no triangle has them",
        "spheres         not simulated, the scene has none",
        "backface cull   not simulated, all triangles have two sides",
        "textures        not simulated, no material has one",
        "background      not simulated, the scene has none",
        "shadow rays     not simulated, no surface lies in front of another, nor behind",
        "light and BRDF  simulated, both can find what a surface reflects",
    ):
        assert line in text
    other_effects, lights = 11, 1
    assert len(lines) == len(scene.material_library.brdfs) + other_effects + lights
    assert scene.receipt()[: len(lines)] == lines


def test_unknown_modes_are_named():
    with pytest.raises(tt.InputError, match="all"):
        tt.load_scene_data("cube", effects="al")


# ── what is compiled ──


def rendered(scene, spp=2, **options):
    """A renderer that has taken samples of the scene by multiple importance sampling."""
    return A2Renderer(scene, 8, 8, **options).use("mis").render(spp)


class Refused(Exception):
    """A kernel looked at code that a test forbids."""


def with_brdf(name):
    """(scene that has it not, scene that has it) of a BRDF."""
    material = {"diffuse": Material(), "phong": Material(Ns=30), "mirror": Material(Ns=1e21)}
    others = [m for other, m in material.items() if other != name]
    without = scene_of(*others, used=(0, 1), environment="studio")
    return without, scene_of(material[name], others[0], used=(0, 1), environment="studio")


BALL = with_spheres([(0, 0, 0.5, 0.5)], *SQUARE)
ONLY_ONE_SIDE = Mesh(*SQUARE, face_culls=np.array([True, False]))
SMOOTH = Mesh(*SQUARE, normals=np.array([[0.6, 0, 0.8]]), face_normals=np.zeros((2, 3), np.int32))
TWO = Mesh(np.concatenate([SQUARE[0], SQUARE[0] + [0, 0, 1]]), np.concatenate([SQUARE[1], SQUARE[1] + 4]))
LIT = {"environment": "studio"}

# Effect → (the code that simulates it, a scene that has it not, a scene that has it).
CODE = {
    **{name: (Brdf, "sample_weight", lambda name=name: with_brdf(name)) for name in ("diffuse", "phong", "mirror")},
    "environment, image": (Environment, "radiance", lambda: (scene_of(environment="white"), scene_of(**LIT))),
    "environment, constant": (
        Environment,
        "constant_radiance",
        lambda: (scene_of(**LIT), scene_of(environment="white")),
    ),
    "environment, black": (
        EnvironmentLight,
        "along",
        lambda: (scene_of(Material(Ke=(1, 1, 1)), environment="black"), scene_of(environment="white")),
    ),
    "environment, none": (EnvironmentLight, "sample", lambda: (scene_of(lights=[Lamp()]), None)),
    "far lights": (SceneInKernels, "visible", lambda: (scene_of(lights=[Lamp()]), scene_of(**LIT))),
    "single lights": (SceneInKernels, "reflected_single", lambda: (scene_of(**LIT), scene_of(lights=[Lamp()]))),
    "emitters": (
        MaterialLibrary,
        "get",
        lambda: (scene_of(background=(1, 1, 1), environment=None), scene_of(Material(Ke=(1, 1, 1)))),
    ),
    "spheres": (RayIntersector, "describe_sphere", lambda: (scene_of(**LIT), scene_of(mesh=BALL, **LIT))),
    "spheres, plain": (
        RayIntersector,
        "sphere_hit",
        lambda: (scene_of(fast=False, **LIT), scene_of(mesh=BALL, fast=False, **LIT)),
    ),
    "background": (Background, "color", lambda: (scene_of(**LIT), scene_of(background=(1, 0, 0), **LIT))),
    "shadow rays": (RayIntersector, "is_occluded", lambda: (scene_of(**LIT), scene_of(mesh=TWO, **LIT))),
    "light and BRDF": (FarLights, "pdf", lambda: (scene_of(Material(Ns=1e21), **LIT), scene_of(**LIT))),
}


# Effect → (the fields of the geometry that it needs, a mesh that has it not, a mesh that has it).
FIELDS = {
    "interpolated_normals": (("normals", "triangle_normal_ids"), Mesh(*SQUARE), SMOOTH),
    "spheres": (("spheres", "sphere_material_ids", "primitives"), Mesh(*SQUARE), BALL),
    "culling": (("culls",), Mesh(*SQUARE), ONLY_ONE_SIDE),
}


def test_a_kernel_may_be_compiled_for_more_than_the_scene_calls_for():
    """What the study of effects compares: the scene itself stays as it is."""
    scene = scene_of(environment="white")
    more = Effects(**{**vars(scene.effects), "environment": "image", "emitters": True})
    compiled = scene.in_kernels(more)
    assert compiled.effects is more
    assert scene.in_kernels().effects is scene.effects
    assert scene.in_kernels() is scene.in_kernels()


def test_a_scene_of_spheres_alone_says_so():
    scene = tt.SceneData(with_spheres([(0, 0, 0, 1), (3, 0, 0, 1)]))
    assert scene.effects.spheres
    assert (scene.num_spheres, scene.num_triangles) == (2, 0)
    assert any(line.startswith("spheres") and line.endswith("simulated, 2 of them") for line in scene.receipt())
    np.testing.assert_array_equal([scene.geometry.low, scene.geometry.high], [[-1, -1, -1], [4, 1, 1]])


def test_effects_are_shown_by_their_names():
    effects = tt.scene_from_mesh(*SQUARE).effects
    names = [name for name, _, _ in effects.reasons]
    shown = repr(effects)
    assert shown.startswith("Effects(diffuse; not simulated: ")
    assert all(name in shown for name in names)
    assert "\n" not in shown
