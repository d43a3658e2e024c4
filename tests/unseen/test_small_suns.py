"""Suns that eye rays pass: which texels are one, which directions are near, and what a view misses."""

import numpy as np
import pytest

import taichi_tracer as tt
from taichi_tracer.camera import make_camera
from taichi_tracer.geometry import Mesh
from taichi_tracer.materials import Material
from taichi_tracer.unseen.small_suns import direction_of, levels_of, small_suns, suns_of

SUN = (20, 37)  # row and column of the one bright texel
HEIGHT, WIDTH = 64, 128

pytestmark = pytest.mark.usefixtures("f32")


def sky(radiance=1e4, *others):
    """A grey sky with a sun, and with (row, column, radiance) of other suns."""
    pixels = np.full((HEIGHT, WIDTH, 3), 0.5)
    pixels[SUN] = radiance
    for row, column, value in others:
        pixels[row, column] = value
    return pixels


def above_floor(**options):
    """A floor under the sun, without walls."""
    mesh = Mesh(
        vertices=np.array([[-5, 0, 5], [5, 0, 5], [5, 0, -5], [-5, 0, -5]], float),
        faces=np.array([[0, 1, 2], [0, 2, 3]], np.int32),
        face_materials=np.zeros(2, np.int32),
        materials=[Material("floor", Kd=(0.5,) * 3)],
    )
    return tt.SceneData(mesh, environment=sky(), **options)


@pytest.mark.parametrize(("up", "rotation"), [("y", 0.0), ("z", 0.0), ("y", 40.0)])
def test_a_sun_lies_where_a_look_up_finds_it(up, rotation, rng):
    scene = above_floor(up_axis=up)
    scene.environment.set_rotation(rotation)
    (sun,) = suns_of(scene.in_kernels())
    d = sun.directions[0]
    assert sun.is_near(sun.directions).all()
    far = rng.normal(size=(20_000, 3))
    far /= np.linalg.norm(far, axis=1, keepdims=True)
    angle = np.degrees(np.arccos(np.clip(far @ d, -1, 1)))
    assert sun.is_near(far[angle < 9]).all()
    assert not sun.is_near(far[angle > 14]).any()  # a cell of the map has a diagonal of four degrees
    camera = make_camera(9, 9, eye=(0, 3, 3), at=tuple(np.array([0, 3, 3]) + d), up=(0.3, 0.9, 0.1), fov=0.1)
    image = tt.A2Renderer(scene, camera=camera, jitter=False).use("mis").render(1).image()
    assert image.mean() == pytest.approx(1e4)
    assert sun.solid_angles[0] == pytest.approx(2 * np.pi / WIDTH * np.pi / HEIGHT * np.cos(np.arcsin(0.467)), rel=0.05)


@pytest.mark.parametrize("pixels", [np.ones((2, 4, 3)), np.zeros((8, 16, 3)), "studio", "white", "black"])
def test_light_that_is_spread_out_has_no_sun(pixels):
    assert levels_of(tt.environment.load_environment(pixels)) == []


def test_a_weaker_sun_is_a_level_of_its_own():
    levels = levels_of(tt.Environment(sky(1e4, (40, 100, 1e3))))
    assert [(int(rows[0]), int(columns[0])) for rows, columns, _ in levels] == [SUN, (40, 100)]
    assert len(levels_of(tt.Environment(sky(1e4, (40, 100, 3e3))))) == 1  # as bright as the sun, about


def test_a_view_misses_a_sun_that_is_smaller_than_its_pixel():
    scene = above_floor()
    suns = suns_of(scene.in_kernels())
    d = direction_of((SUN[1] + 0.5) / WIDTH, (SUN[0] + 0.5) / HEIGHT)
    view = {"eye": (0, 3, 0), "at": tuple(np.array([0, 3, 0]) + d), "up": (0, 1, 0), "fov": 60.0}
    camera = make_camera(9, 9, **view)
    found = small_suns(suns, scene, camera, (0, 9, 0, 9))
    pixels, chance, light = found.T
    assert list(pixels) == [40]
    pixel = (2 * np.tan(np.radians(30)) / 9) ** 2  # the solid angle of the middle pixel
    assert chance[0] == pytest.approx(suns[0].solid_angles[0] / pixel, rel=0.01)
    assert light[0] == pytest.approx(chance[0] * 1e4)
    below = make_camera(9, 9, **(view | {"eye": (0, -3, 0), "at": tuple(np.array([0, -3, 0]) + d)}))
    for other, crop in ((camera, (0, 4, 0, 9)), (below, (0, 9, 0, 9)), (make_camera(900, 900, **view), (0, 900) * 2)):
        assert len(small_suns(suns, scene, other, crop)) == 0
