"""Where everything is in a window of any size, and the pixels that it shows."""

import numpy as np
import pytest

import taichi_tracer as tt
from taichi_tracer.apps.screen import (
    BACKGROUND,
    LEAST_ROOM,
    PANEL_LINE,
    PANEL_WIDTH,
    SHARE_OF_SCREEN,
    Layout,
    Screen,
    first_size,
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


def test_panels_are_left_out_where_there_is_no_room():
    def margins(width, **more):
        layout = Layout.of((width, 500), (512, 512), **more)
        return layout.left, layout.right

    assert margins(2 * PANEL_WIDTH + LEAST_ROOM) == (PANEL_WIDTH, PANEL_WIDTH)
    assert margins(2 * PANEL_WIDTH + LEAST_ROOM - 1) == (PANEL_WIDTH, 0)
    assert margins(PANEL_WIDTH + LEAST_ROOM - 1) == (0, 0)
    assert margins(2000, has_panels=False) == (0, 0)


def test_the_first_window_is_filled_by_the_picture_and_is_no_larger_than_the_screen():
    assert first_size((512, 512), 10, None) == (512 + 2 * PANEL_WIDTH, 512)
    high = 30 * PANEL_LINE
    assert first_size((512, 512), 30, (1920, 1080)) == (high + 2 * PANEL_WIDTH, high)
    for picture in ((512, 512), (400, 300), (300, 400), (100, 50)):
        layout = Layout.of(first_size(picture, 30, (2560, 1440)), picture)
        assert (layout.x, layout.y) == (PANEL_WIDTH, 0)
        assert layout.shown_width == layout.width - 2 * PANEL_WIDTH
        assert layout.shown_height == layout.height
    assert first_size((100, 50), 1, (1920, 1080)) == (300 + 2 * PANEL_WIDTH, 150)
    width, height = first_size((1600, 900), 30, (1366, 768))
    assert width == int(SHARE_OF_SCREEN[0] * 1366)
    assert height == int(SHARE_OF_SCREEN[1] * 768)


def test_points_of_the_window_and_ways_of_the_mouse():
    layout = Layout.of((1000, 600), (504, 504))
    assert not layout.holds((0.2, 0.5))
    assert layout.holds((0.3, 0.5))
    assert not layout.holds((0.8, 0.5))
    assert layout.as_drag((0.3, 0.2), (0.3 + 0.252, 0.2 + 0.42)) == pytest.approx((0.5, 0.5))


def test_large_pictures_are_shown_as_means(renderer):
    screen = Screen((50, 25), (100, 50))
    screen.update(renderer.use("normal").render())
    means = renderer.image().reshape(25, 2, 50, 2, 3).mean(axis=(1, 3))
    assert abs(shown(screen).astype(int) - to_bytes(means)).max() <= 1
    screen.resize((25, 25))
    screen.update(renderer)
    assert (shown(screen)[:6] == BACKGROUND).all()
    assert not (shown(screen)[12] == BACKGROUND).all(axis=-1).any()


def test_radiance_is_shown_as_it_is_written(renderer, monkeypatch):
    renderer.use("distance").render()
    monkeypatch.setattr(renderer.active, "srgb", True)
    screen = Screen((100, 50), (100, 50))
    screen.update(renderer)
    expected = to_bytes(renderer.image(), srgb=True).astype(int)
    assert abs(shown(screen).astype(int) - expected).max() <= 1
    assert expected.max() > to_bytes(renderer.image()).max()


@pytest.mark.parametrize("display", [Display(), Display(-4), Display(-2.5, "filmic")], ids=str)
def test_light_is_shown_as_it_is_written_with_exposure_and_tone(renderer, monkeypatch, display):
    renderer.use("distance").render()
    monkeypatch.setattr(renderer.active, "srgb", True)
    screen = Screen((100, 50), (100, 50))
    screen.update(renderer.set_display(display.exposure, display.tone))
    expected = to_bytes(renderer.image(), srgb=True, display=display).astype(int)
    assert abs(shown(screen).astype(int) - expected).max() <= 1
    renderer.set_display(0.0, "none")


def test_a_drawing_is_put_into_the_right_margin_if_there_is_one():
    plot = np.zeros((150, PANEL_WIDTH, 3), np.float32)
    plot[0] = 1  # its top row
    screen = Screen((900, 400), (100, 100))
    screen.put_plot(plot)
    drawn = shown(screen)[-150:, -PANEL_WIDTH:]
    np.testing.assert_array_equal(drawn[:2, :, 0], [[255] * PANEL_WIDTH, [0] * PANEL_WIDTH])
    screen.let_plot(False)
    assert (screen.pixels == BACKGROUND).all()
    screen.put_plot(plot)
    assert (screen.pixels == BACKGROUND).all()
    screen.let_plot(True)
    screen.resize((300, 400))
    screen.put_plot(plot)
    assert (screen.pixels == BACKGROUND).all()
