"""The light that only the technique finds which an estimator does not use."""

import math

import numpy as np
import pytest

import taichi_tracer as tt
from taichi_tracer.geometry import Mesh
from taichi_tracer.materials import Material
from taichi_tracer.system.registry import PARTS
from taichi_tracer.unseen.other_technique import ABOUT_AS_RARE, SAFETY, SAMPLES, OtherTechnique, other_techniques
from taichi_tracer.unseen.rare_light import KNOWN

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
    return other_techniques(scene.in_kernels(), PARTS.find("integrator", way), pixels)


@pytest.mark.long
def test_a_narrow_lobe_is_missed_by_samples_of_the_lights(narrow):
    """Every pixel misses Kd L cos θ with L = 2; the mean of the picture is 0, or what a lucky sample found."""
    renderer = tt.A2Renderer(narrow, SIZE, SIZE).use("environment").render(8)
    renderer.error()
    y, x = np.mgrid[:SIZE, :SIZE]
    cosine = renderer.camera.rays(x.ravel(), y.ravel())[1][:, 2]
    expected = SAFETY * KD * 2.0 * math.sqrt(np.square(cosine).mean())
    assert renderer.other.missed(8) == pytest.approx(expected, rel=1e-3)
    assert renderer.other.missed(1e12) == 0  # so many samples meet it
    before = renderer.image()
    renderer.seed = 1  # it looks again
    renderer.error()
    np.testing.assert_array_equal(before, renderer.image())  # the samples of the picture are not touched


@pytest.mark.long
def test_the_upper_end_of_the_error_contains_it():
    """One triangle of the wall is matte; the other one has a narrow lobe, whose light is missing."""
    mesh = wall(1.0)
    mesh.materials = [Material("matte", Kd=(KD,) * 3), Material("narrow", Kd=(KD,) * 3, Ns=1e8)]
    mesh.face_materials = np.array([0, 1], np.int32)
    scene = scene_of(mesh, np.full((4, 8, 3), 2.0, np.float32))
    renderer = tt.A2Renderer(scene, SIZE, SIZE).use("environment").render(256)
    error, picture = renderer.error(), renderer.image()
    truth = renderer.use("mis").render(64).image()
    true = math.sqrt(np.square(picture - truth).mean()) / truth.mean()
    assert float(error) < 0.5 * true  # the samples do not know
    assert true < error.high < 3 * true
    assert "light that no sample met may add" in str(error)


@pytest.mark.exhaustive
def test_a_small_lamp_is_missed_by_samples_of_the_brdf():
    scene = scene_of(wall(1.0, lamp=1e-4))
    assert techniques(scene, "brdf") == techniques(scene, "uniform") == ("lights",)
    assert techniques(scene, "environment") == ()
    renderer = tt.A2Renderer(scene, SIZE, SIZE).use("brdf").render(4)
    renderer.error()
    lit = tt.A2Renderer(scene, SIZE, SIZE).use("environment").render(4).image()
    assert renderer.other.missed(4) == pytest.approx(SAFETY * math.sqrt(np.square(lit).mean()), rel=0.05)


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
    """Each sample stands for pixels / (rows · columns · SAMPLES) of the picture's."""
    other = OtherTechnique.__new__(OtherTechnique)
    other.rows, other.columns, other.pixels, other.near_misses = 1, 2, 80, None
    light, chance = np.ones((SAMPLES, 1, 2)), np.full((SAMPLES, 1, 2), 1e-3)
    chance[:, 0, 1] = 1e-3 * ABOUT_AS_RARE * 1.01
    light[0, 0, 0] = 0  # what is dark is not counted
    found = other.meetings(light, chance)
    each = 80 / (2 * SAMPLES)
    np.testing.assert_allclose(found[1:, 0, 0], 1e-3 * (SAMPLES - 1) * each)
    np.testing.assert_allclose(found[:, 0, 1], (1e-3 * (SAMPLES - 1) + 1.01e-3 * ABOUT_AS_RARE * SAMPLES) * each)
    assert np.isinf(found[0, 0, 0])
    other.found = [(light, found)]
    n = KNOWN / found[1, 0, 0] * 0.99  # the left pixel is just missed, the right one was met
    assert other.missed(n) == pytest.approx(SAFETY * math.sqrt((1 - 1 / SAMPLES) ** 2 / 2))


@pytest.mark.long
def test_near_misses_of_a_narrow_lobe_bound_what_the_other_technique_did_not_find_either():
    """A ball that mirrors a sun of one texel: the bright spot on it is smaller than a pixel."""
    sky = np.full((128, 256, 3), 0.5)
    sky[20, 200] = 1e6
    mesh = Mesh(
        vertices=np.zeros((0, 3)),
        faces=np.zeros((0, 3), np.int32),
        materials=[Material("narrow", Kd=(1,) * 3, Ns=1e8)],
        spheres=np.array([[0, 0, 0, 0.5]]),
    )
    renderer = tt.A2Renderer(scene_of(mesh, sky), SIZE, SIZE).use("environment").render(16)
    error = renderer.error()
    assert renderer.other.near_misses.counts().near[0].tolist()[1] > 0
    assert error < 1 < error.unseen <= error.high
