"""The sum of Blinn and Phong against the formula in float64; shadows, mirrors and backs."""

import numpy as np
import pytest
from shapes import SQUARE

import taichi_tracer as tt

pytestmark = pytest.mark.usefixtures("f32")

SHINY = {"Ka": (0.1, 0.2, 0.3), "Kd": (0.5, 0.4, 0.3), "Ks": (0.6, 0.7, 0.8)}
LIGHTS = [
    tt.AmbientLight((0.3, 0.2, 0.1)),
    tt.DirectionalLight((0.3, 0.1, -1), (0.5, 0.6, 0.7)),
    tt.PointLight((0.5, -0.4, 1.5), (2, 1, 3), (1, 0.5, 0.25)),
    tt.SpotLight((-0.5, 0.6, 2), (0, 0, 0), (1, 2, 1), 30, 10),
]


def unit(v):
    return v / np.linalg.norm(v)


def arriving(light, x):
    """(l, I) of one of ``LIGHTS`` at a point, in float64."""
    if light.name == "directional":
        return -unit(np.array(light.direction)), np.array(light.irradiance)
    to_light = np.array(light.position) - x
    r, (kc, kl, kq) = np.linalg.norm(to_light), light.attenuation
    intensity = np.array(light.intensity) / (kc + kl * r + kq * r * r)
    if light.name == "spot":
        axis = unit(np.subtract(light.target, light.position))
        theta = np.degrees(np.arccos(-axis @ to_light / r))
        intensity = intensity * np.clip((light.cutoff - theta) / (light.cutoff - light.falloff), 0, 1)
    return to_light / r, intensity


def expected(x, v, n, material):
    total = np.array(LIGHTS[0].intensity) * material.Ka
    for light in LIGHTS[1:]:
        l, intensity = arriving(light, x)
        h = unit(v + l)
        shine = np.multiply(material.Ks, max(0, n @ h) ** material.Ns)
        total = total + intensity * (np.multiply(material.Kd, max(0, n @ l)) + shine) * (n @ l > 0)
    return total


def shown(scene, eye, at, depth=5):
    renderer = tt.RT3Renderer(scene, camera=tt.Camera(3, 3, eye=eye, at=at, up=(0, 1, 0), fov=0.01))
    renderer.set_mirrors(depth)
    return renderer.use("blinn_phong").render().image()[1, 1]


@pytest.mark.parametrize("exponent", [1, 30, 1e6])
def test_a_wall_shows_the_sum(exponent):
    material = tt.Material(Ns=exponent, **SHINY)
    scene = tt.scene_from_mesh(*SQUARE, material=material, environment=None, lights=LIGHTS)
    for eye, at in (((0, 0, 3), (0, 0, 0)), ((1, 2, 2), (0.3, 0.2, 0)), ((2, -1, 0.3), (-0.4, -0.1, 0))):
        v = unit(np.subtract(eye, at))
        value = shown(scene, eye, at)
        np.testing.assert_allclose(value, expected(np.array(at), v, np.array([0, 0, 1]), material), rtol=2e-3)


def test_what_stands_in_between_throws_a_shadow():
    vertices = np.concatenate([SQUARE[0] * 4, SQUARE[0] * 0.3 + [0, 0, 1]])
    faces = np.concatenate([SQUARE[1], SQUARE[1] + 4])
    lights = [tt.AmbientLight(0.5), tt.PointLight((0, 0, 2), 1.0, (1, 0, 0))]
    material = tt.Material(Ka=(0.2,) * 3, Kd=(0.5,) * 3)
    scene = tt.scene_from_mesh(vertices, faces, material=material, environment=None, lights=lights)
    eye = (3, 0, 0.9)
    np.testing.assert_allclose(shown(scene, eye, (0, 0, 0)), 0.1, rtol=1e-4)
    assert (shown(scene, eye, (1.5, 0, 0)) > 0.2).all()


@pytest.mark.parametrize(("depth", "value"), [(0, 0.1), (1, 0.1 + 0.5 * 0.1), (2, 0.1 + 0.5 * 0.1 + 0.25 * 0.1)])
def test_mirrors_are_followed_as_often_as_asked(depth, value):
    """Two walls that face each other, with ambient light only."""
    vertices = np.concatenate([SQUARE[0] * 50, SQUARE[0] * 50 * [-1, 1, 1] + [0, 0, 2]])
    faces = np.concatenate([SQUARE[1], SQUARE[1] + 4])
    material = tt.Material(Ka=(0.2,) * 3, Kd=(0,) * 3, Km=(0.5,) * 3)
    scene = tt.scene_from_mesh(vertices, faces, material=material, environment=None, lights=[tt.AmbientLight(0.5)])
    np.testing.assert_allclose(shown(scene, (0.1, 0, 1), (0, 0, 0), depth), value, rtol=1e-4)


def test_backs_are_black_and_what_is_missed_is_the_background():
    lights = [tt.AmbientLight(1.0)]
    material = tt.Material(Ka=(1,) * 3)
    scene = tt.scene_from_mesh(*SQUARE, material=material, environment=None, lights=lights, background=(0.1, 0.2, 0.3))
    assert not shown(scene, (0, 0, -3), (0, 0, 0)).any()
    np.testing.assert_allclose(shown(scene, (0, 0, 3), (9, 0, 0)), [0.1, 0.2, 0.3], rtol=1e-5)


def test_without_lights_a_note_says_why_it_is_black():
    scene = tt.scene_from_mesh(*SQUARE)
    renderer = tt.RT3Renderer(scene, 4, 4).use("blinn_phong").render()
    assert any("the scene has none: all is black" in note for note in renderer.active.notes())


@pytest.mark.parametrize("depth", [-1, 65, 2.5, "3"])
def test_a_depth_is_a_whole_number(depth):
    scene = tt.scene_from_mesh(*SQUARE)
    with pytest.raises(tt.InputError, match="depth must be a whole number from 0 to 64"):
        tt.RT3Renderer(scene, 4, 4).set_mirrors(depth)


def test_what_a_student_writes_runs(monkeypatch):
    import taichi as ti

    from taichi_tracer.integrators.rt3_blinn_phong import BlinnPhong

    @ti.func
    def highlight(self, surface, l):
        return 0.0

    scene = tt.scene_from_mesh(*SQUARE, material=tt.Material(Ns=1, **SHINY), environment=None, lights=LIGHTS[:2])
    before = shown(scene, (0, 0, 3), (0, 0, 0))
    monkeypatch.setattr(BlinnPhong, "highlight", highlight)
    assert (shown(scene, (0, 0, 3), (0, 0, 0)) < before).all()
