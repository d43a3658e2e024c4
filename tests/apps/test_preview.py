"""Coarse pictures while the camera moves: when they are taken, and that they show the same."""

import pytest
from support import start

import taichi_tracer as tt
from taichi_tracer.apps.preview import COARSEST, WANTED, Preview

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


def renderer_of(like, size):
    view = {name: value for name, value in vars(like.camera.view).items() if value is not None}
    camera = type(like.camera)(size, size, **view)
    return type(like)(like.scene_data, camera=camera).use(like.active.name)


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
