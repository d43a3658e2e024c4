"""The light that only the technique finds which an estimator does not use."""

import numpy as np
import pytest

import taichi_tracer as tt
from taichi_tracer.geometry import Mesh
from taichi_tracer.materials import Material
from taichi_tracer.system.parts import PARTS
from taichi_tracer.unseen.rare_light import ABOUT_AS_RARE, expected, missed, of_kinds
from taichi_tracer.unseen.small_suns import suns_of
from taichi_tracer.unseen.technique_check import SAFETY, by_other_techniques, other_techniques

SIZE = 12
VIEW = {"eye": (0, 0, 2), "at": (0, 0, 0), "up": (0, 1, 0), "fov": 40.0}
KD = 0.6


def square(z, half, facing=1.0):
    """The four corners of a square around the z axis; its front looks along ±z."""
    s = half * facing
    return np.array([[-s, -half, z], [s, -half, z], [s, half, z], [-s, half, z]], float)


def wall(exponent, lamp=None):
    """A wall that fills the picture, and perhaps a lamp behind the eye, with a half side of ``lamp``."""
    materials = [Material("wall", Kd=(KD,) * 3, Ns=exponent), Material("lamp", Kd=(0,) * 3, Ke=(1e6,) * 3)]
    corners, faces, ids = [square(0, 5)], [[0, 1, 2], [0, 2, 3]], [0, 0]
    if lamp is not None:
        corners.append(square(4, lamp, facing=-1.0))
        faces += [[4, 5, 6], [4, 6, 7]]
        ids += [1, 1]
    return Mesh(
        vertices=np.concatenate(corners),
        faces=np.array(faces, np.int32),
        face_materials=np.array(ids, np.int32),
        materials=materials,
    )


def scene_of(mesh, environment=None):
    return tt.SceneData(mesh, view=VIEW, environment=environment)


@pytest.fixture(scope="module")
def narrow():
    return scene_of(wall(1e8), np.full((4, 8, 3), 2.0, np.float32))


def techniques(scene, way, pixels=SIZE * SIZE):
    in_kernels = scene.in_kernels()
    return other_techniques(in_kernels, PARTS.find("integrator", way), pixels, suns_of(in_kernels))


def test_nothing_is_done_where_nothing_can_be_missed(narrow):
    assert techniques(narrow, "environment") == techniques(narrow, "uniform") == ("brdf",)
    assert techniques(narrow, "mis") == techniques(narrow, "brdf") == ()
    assert techniques(narrow, "path") == techniques(narrow, "implicit") == techniques(narrow, "normal") == ()
    assert techniques(narrow, "explicit") == ("brdf",)
    assert techniques(scene_of(wall(20.0), np.ones((4, 8, 3), np.float32)), "environment") == ()
    large = scene_of(wall(1.0, lamp=2.0))  # a lamp of 16 in a scene of 10: 1.3 % of the directions
    assert techniques(large, "brdf", pixels=700) == ("lights",)
    assert techniques(large, "brdf", pixels=900) == ()


def test_light_that_is_about_as_rare_is_counted_together():
    chance = np.array([1e-3, 1e-3, 2.1e-3, 1e-3 * ABOUT_AS_RARE * 1.01])
    np.testing.assert_allclose(expected(chance), [4.1e-3, 4.1e-3, chance.sum(), chance.sum()])


def test_one_pixel_of_each_tile_tells_of_all(narrow, monkeypatch):
    """The lobe is so narrow that samples of the lights never meet it: everything that it reflects is missed."""
    renderer = tt.A2Renderer(narrow, SIZE, SIZE).use("environment")
    whole = missed(of_kinds(by_other_techniques(renderer, [])), 16, np.ones(SIZE * SIZE))
    monkeypatch.setattr("taichi_tracer.unseen.technique_check.MOST_TILES", 4)
    (rows,) = by_other_techniques(renderer, [])
    assert set(rows[:, 0]) == {float(x + SIZE * y) for x in range(0, SIZE, 3) for y in range(0, SIZE, 3)}
    assert missed(of_kinds([rows]), 16, np.ones(SIZE * SIZE)) == pytest.approx(whole, rel=0.02)
    mirrored = tt.A2Renderer(narrow, SIZE, SIZE).use("mis").render(16).image()
    assert whole == pytest.approx(SAFETY * mirrored.mean(), rel=0.05)
