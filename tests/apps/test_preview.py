"""Coarse pictures while the camera moves: when they are taken, and that they show the same."""

import numpy as np
import pytest
from support import start

import taichi_tracer as tt
from taichi_tracer.apps.preview import COARSEST, WANTED, Preview, current

SIZE = 256


@pytest.fixture(scope="module")
def scene():
    start("f32")
    return tt.load_scene_data("cube", environment="white")


@pytest.fixture
def renderer(scene):
    return tt.A1Renderer(scene, SIZE, SIZE).use("normal")


def test_a_slow_picture_becomes_coarse_and_a_fast_one_fine_again(renderer):
    preview, wanted = Preview(), WANTED[False]
    assert preview.of(renderer) is renderer
    preview.took(renderer, 2 * wanted)
    coarse = preview.of(renderer)
    assert (coarse.width, coarse.height) == (SIZE // 2, SIZE // 2)
    preview.took(renderer, 100 * wanted)  # it has compiled something
    assert preview.of(renderer) is coarse
    for _ in range(5):
        preview.took(renderer, 100 * wanted)
        smallest = preview.of(renderer)
        preview.took(renderer, 0.9 * wanted)
    assert smallest.width == SIZE // COARSEST
    preview.took(renderer, 0.01 * wanted)
    preview.took(renderer, 0.01 * wanted)
    assert preview.of(renderer) is renderer


@pytest.mark.long
def test_a_coarse_picture_shows_what_the_camera_sees_now(renderer):
    preview = Preview()
    preview.took(renderer, 1.0)
    for eye in ((3, 2, 4), (-4, 1, 2)):
        renderer.camera.set_camera_parameters(eye=eye)
        coarse = preview.of(renderer).render().image()
        whole = renderer.render().image()
        np.testing.assert_array_equal(coarse, renderer_of(renderer, SIZE // 2).render().image())
        assert abs(coarse.mean(axis=(0, 1)) - whole.mean(axis=(0, 1))).max() < 0.02


def renderer_of(like, size):
    view = {name: value for name, value in vars(like.camera.view).items() if value is not None}
    camera = type(like.camera)(size, size, **view)
    return type(like)(like.scene_data, camera=camera).use(like.active.name)


@pytest.mark.long
def test_values_and_display_are_those_of_the_whole_picture(scene):
    renderer = tt.A4Renderer(scene, SIZE, SIZE).use("explicit").set_display(exposure=2)
    renderer.max_bounces = 2
    preview = Preview()
    preview.took(renderer, 1.0)
    coarse = preview.of(renderer)
    assert (coarse.active.name, coarse.max_bounces, coarse.display) == ("explicit", 2, renderer.display)
    renderer.max_bounces = 4
    assert preview.of(renderer).max_bounces == 4
    renderer.use("path")
    assert preview.of(renderer) is renderer  # nothing is known of this one yet
    preview.took(renderer, 1.0)
    assert preview.of(renderer).active.name == "path"


def test_what_has_pixels_of_its_own_stays_whole(scene):
    class Own(tt.Camera):
        pass

    for renderer in (
        tt.A1Renderer(scene, SIZE, SIZE, crop=(0, 100, 0, 100)),
        tt.A1Renderer(scene, camera=Own(SIZE, SIZE)),
        tt.A1Renderer(scene, 64, 64),
    ):
        preview = Preview()
        preview.took(renderer, 1.0)
        assert preview.of(renderer) is renderer


@pytest.mark.long
def test_a_picture_is_saved_as_the_camera_sees_it_now(renderer):
    renderer.render()
    before = renderer.image()
    assert current(renderer).samples == 1
    renderer.camera.set_camera_parameters(eye=(1, 5, 2))
    assert abs(current(renderer).image() - before).max() > 0.1
