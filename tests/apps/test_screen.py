"""Where everything is in a window of any size, and the pixels that it shows."""

import numpy as np
import pytest

import taichi_tracer as tt
from taichi_tracer.apps.screen import (
    BACKGROUND,
    Layout,
    Screen,
)
from taichi_tracer.files.srgb import to_bytes
from taichi_tracer.renderer import A1Renderer
from taichi_tracer.tones.display import Display


@pytest.fixture(scope="module")
def renderer():
    scene = tt.load_scene_data("cornell_box", intersector="brute_force", triangle_test="moller_trumbore")
    return A1Renderer(scene, width=100, height=50)


def shown(screen):
    """What the window shows, (h, w, 3) with the top row first."""
    return np.flipud(screen.pixels.swapaxes(0, 1))


@pytest.mark.parametrize("picture", [(512, 512), (1600, 900), (90, 1600), (100, 50), (8, 8)])
@pytest.mark.parametrize("window", [(1008, 600), (400, 300), (100, 900), (2500, 1400), (700, 100), (1, 1)])
def test_the_picture_keeps_its_proportions_and_no_panel_covers_it(window, picture):
    layout = Layout.of(window, picture)
    assert layout.left <= layout.x
    assert layout.x + layout.shown_width <= layout.width - layout.right
    assert 0 <= layout.y <= layout.y + layout.shown_height <= layout.height
    error = abs(layout.shown_width * picture[1] - layout.shown_height * picture[0]) / max(picture)
    assert error <= 1 or 1 in (layout.shown_width, layout.shown_height)  # of a pixel
    room = layout.width - layout.left - layout.right, layout.height
    assert room[0] - layout.shown_width <= 1 or room[1] - layout.shown_height <= 1  # as large as possible


def test_large_pictures_are_shown_as_means(renderer):
    screen = Screen((50, 25), (100, 50))
    screen.update(renderer.use("normal").render())
    means = renderer.image().reshape(25, 2, 50, 2, 3).mean(axis=(1, 3))
    assert abs(shown(screen).astype(int) - to_bytes(means)).max() <= 1
    screen.resize((25, 25))
    screen.update(renderer)
    assert (shown(screen)[:6] == BACKGROUND).all()
    assert not (shown(screen)[12] == BACKGROUND).all(axis=-1).any()


@pytest.mark.parametrize("display", [Display(), Display(-4), Display(-2.5, "filmic")], ids=str)
def test_light_is_shown_as_it_is_written_with_exposure_and_tone(renderer, monkeypatch, display):
    renderer.use("distance").render()
    monkeypatch.setattr(renderer.active, "srgb", True)
    screen = Screen((100, 50), (100, 50))
    screen.update(renderer.set_display(display.exposure, display.tone))
    expected = to_bytes(renderer.image(), srgb=True, display=display).astype(int)
    assert abs(shown(screen).astype(int) - expected).max() <= 1
    renderer.set_display(0.0, "none")
