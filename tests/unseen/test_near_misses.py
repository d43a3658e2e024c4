"""Near misses: which directions are near to a bright spot, and which look-ups are counted."""

import numpy as np
import pytest

import taichi_tracer as tt
from taichi_tracer.geometry import Mesh
from taichi_tracer.materials import Material
from taichi_tracer.unseen.near_misses import EYE, LOBE, MIRROR, levels_of

SUN = (20, 37)  # row and column of the one bright texel
HEIGHT, WIDTH = 64, 128


def sky(radiance=1e4, *others):
    """A grey sky with a sun, and with (row, column, radiance) of other suns."""
    pixels = np.full((HEIGHT, WIDTH, 3), 0.5)
    pixels[SUN] = radiance
    for row, column, value in others:
        pixels[row, column] = value
    return pixels


def direction(row, column):
    """The direction of the centre of a texel: rows from the zenith, columns around +y (C-1)."""
    elevation, azimuth = np.pi * (0.5 - (row + 0.5) / HEIGHT), 2 * np.pi * ((column + 0.5) / WIDTH - 0.5)
    return np.array([np.cos(elevation) * np.cos(azimuth), np.sin(elevation), np.cos(elevation) * np.sin(azimuth)])


pytestmark = pytest.mark.usefixtures("f32")


def test_what_lies_within_ten_degrees_of_the_sun_is_near(rng):
    (level,), zones = levels_of(tt.Environment(sky()))
    d = rng.normal(size=(20_000, 3))
    d /= np.linalg.norm(d, axis=1, keepdims=True)
    angle = np.degrees(np.arccos(np.clip(d @ direction(*SUN), -1, 1)))
    v, u = 0.5 - np.arcsin(d[:, 1]) / np.pi, 0.5 + np.arctan2(d[:, 2], d[:, 0]) / (2 * np.pi)
    is_near = zones[(v * 64).astype(int), (u * 128).astype(int) % 128] == 1
    assert is_near[angle < 9].all()
    assert not is_near[angle > 14].any()  # a cell of the map has a diagonal of four degrees
    edges = np.cos(np.pi * np.arange(HEIGHT + 1) / HEIGHT)
    of_sun = (edges[SUN[0]] - edges[SUN[0] + 1]) * 2 * np.pi / WIDTH
    assert level.share == pytest.approx(of_sun / (4 * np.pi * is_near.mean()), rel=0.25)
    assert level.low < level.radiance == 1e4 < level.high


@pytest.mark.parametrize("pixels", [np.ones((2, 4, 3)), np.zeros((8, 16, 3)), "studio", "white", "black"])
def test_light_that_is_spread_out_has_no_bright_spot(pixels):
    environment = tt.environment.load_environment(pixels)
    assert levels_of(environment)[0] == ()


def test_a_weaker_sun_is_a_level_of_its_own():
    levels, zones = levels_of(tt.Environment(sky(1e4, (40, 100, 1e3))))
    assert len(levels) == 2
    assert [level.radiance for level in levels] == [1e4, 1e3]
    assert levels[1].low < 1e3 < levels[1].high == levels[0].low < 1e4
    assert set(np.unique(zones)) == {0, 1, 2}
    assert len(levels_of(tt.Environment(sky(1e4, (40, 100, 3e3))))[0]) == 1  # as bright as the sun, about


def plane(**material):
    """A square on the ground, under the sun, seen from where its mirror image of the sun is near the centre."""
    vertices = np.array([[-5, 0, 5], [5, 0, 5], [5, 0, -5], [-5, 0, -5]], float)
    mesh = Mesh(
        vertices=vertices,
        faces=np.array([[0, 1, 2], [0, 2, 3]], np.int32),
        face_materials=np.zeros(2, np.int32),
        materials=[Material("plane", **material)],
    )
    sun = direction(*SUN)
    view = {"eye": tuple(3 * sun * [-1, 1, -1]), "at": (0, 0, 0), "up": (0, 1, 0), "fov": 30.0}
    return tt.SceneData(mesh, view=view, environment=sky(), intersector="brute_force")


def test_eye_rays_that_look_beside_the_sun_are_counted_exactly():
    """Without jitter, each sample looks through the centre of its pixel."""
    scene = plane(Kd=(0.5,) * 3)
    sun = direction(*SUN)
    camera = tt.Camera(40, 30, eye=(0, 5, 0), at=tuple(np.array([0, 5, 0]) + sun), up=(0, 1, 0), fov=60)
    renderer = tt.A2Renderer(scene, camera=camera, jitter=False).use("mis").render(3)
    _, d = camera.rays(*np.meshgrid(np.arange(40), np.arange(30)))
    d = np.asarray(d, float).reshape(-1, 3)
    d /= np.linalg.norm(d, axis=1, keepdims=True)
    v, u = 0.5 - np.arcsin(d[:, 1]) / np.pi, 0.5 + np.arctan2(d[:, 2], d[:, 0]) / (2 * np.pi)
    row, column = (v * HEIGHT).astype(int), (u * WIDTH).astype(int)
    _, zones = levels_of(scene.environment)
    counted = renderer.film.unseen.counted()
    assert counted.near[0, EYE] == 3 * (zones[row, column] == 1).sum() > 0
    assert counted.met[0, EYE] == 3 * ((row == SUN[0]) & (column == SUN[1])).sum() > 0
    assert not counted.near[0, [MIRROR, LOBE]].any()
