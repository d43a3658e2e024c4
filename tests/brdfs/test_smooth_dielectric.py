"""Glass: which materials it is, and pictures in which light passes through it."""

import numpy as np
import pytest
from shapes import sphere, with_spheres

import taichi_tracer as tt
from taichi_tracer.geometry import Mesh
from taichi_tracer.system.registry import PARTS

GLASS = tt.Material("glass", Kd=(0.3, 0.3, 0.3), Ni=1.4, extra={"illum": (7.0,)})
VIEW = {"eye": (0, 0, 4), "at": (0, 0, 0), "fov": 40.0}


pytestmark = pytest.mark.usefixtures("f32")


@pytest.mark.parametrize(
    ("material", "is_glass"),
    [
        (GLASS, True),
        (tt.Material(d=0.5, Ni=1.5), True),
        (tt.Material(d=0.5), False),
        (tt.Material(Ni=1.5), False),
        (tt.Material(Ns=1000.0, Ni=1.4, extra={"illum": (7.0,)}), True),
        (tt.Material(Ns=1000.0, extra={"illum": (2.0,)}), False),
    ],
)
def test_what_is_glass(material, is_glass):
    """Glass counts before the other BRDFs that describe the material, too."""
    scene = tt.SceneData(Mesh(np.eye(3), np.array([[0, 1, 2]]), materials=[material]))
    found = scene.material_library.brdfs[scene.material_library.brdf_of[0][0]]
    assert (found is PARTS.find("BRDF", "dielectric")) == is_glass


@pytest.mark.exhaustive
@pytest.mark.parametrize("ball", ["sphere", pytest.param("mesh", marks=pytest.mark.long)])
def test_a_glass_ball_in_even_light_cannot_be_seen(ball):
    """Nothing is absorbed: whatever the path through the ball, it ends in the same light. Roulette is off."""
    mesh = with_spheres([[0, 0, 0, 1]]) if ball == "sphere" else Mesh(*sphere(24, 13))
    mesh.materials = [GLASS]
    renderer = tt.A4Renderer(tt.SceneData(mesh, environment="white", view=VIEW), 24, 24)
    renderer.max_bounces = 64
    for way in ("implicit", "explicit", "path"):
        image = renderer.use(way).render(8).image()
        assert renderer.non_finite == 0
        lost = 1 - image.astype(float)
        assert np.abs(np.median(lost)) < 1e-5
        assert -1e-5 < lost.mean() < 2e-3  # paths that were still inside after 64 reflections


@pytest.mark.exhaustive
def test_a_lens_turns_the_picture_round():
    """Through a ball of glass, what is on the left is seen on the right."""
    back = np.array([[-9, -9, -9], [9, -9, -9], [9, 9, -9], [-9, 9, -9]], float)
    left, right = back.copy(), back.copy()
    left[:, 0], right[:, 0] = np.minimum(back[:, 0], 0), np.maximum(back[:, 0], 0)
    faces = np.array([[0, 1, 2], [0, 2, 3], [4, 5, 6], [4, 6, 7]])
    materials = [tt.Material("red", Ke=(1, 0, 0)), tt.Material("green", Ke=(0, 1, 0)), GLASS]
    mesh = with_spheres(
        [[0, 0, 0, 1]],
        np.concatenate([left, right]),
        faces,
        face_materials=np.array([0, 0, 1, 1], np.int32),
        materials=materials,
        sphere_materials=np.array([2], np.int32),
    )
    renderer = tt.A4Renderer(tt.SceneData(mesh, view=VIEW), 40, 40, integrator="implicit")
    image = renderer.render(16).image()
    behind_it = Mesh(mesh.vertices, faces, face_materials=mesh.face_materials, materials=materials)
    plain = tt.A4Renderer(tt.SceneData(behind_it, view=VIEW), 40, 40, integrator="implicit").render(1).image()
    seen, behind = image[20, 14] > 0.5, plain[20, 14] > 0.5
    assert seen[:2].tolist() == behind[:2][::-1].tolist()
    assert (image[20, 2] > 0.5)[:2].tolist() == behind[:2].tolist()  # beside the ball
