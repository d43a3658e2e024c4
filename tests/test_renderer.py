"""Progressive rendering: what adds samples, what starts over, and what is refused."""

import numpy as np
import pytest
from shapes import SQUARE
from support import start

import taichi_tracer as tt


@pytest.fixture(scope="module", autouse=True)
def _taichi():
    start("f32")


@pytest.fixture
def renderer():
    return tt.A1Renderer(scene_data=tt.scene_from_mesh(*SQUARE), width=16, height=12)


def test_samples_add_up_and_change_nothing_without_jitter(renderer):
    first = renderer.render().image()
    more = renderer.render(spp=4).image()
    assert renderer.samples == 5
    np.testing.assert_array_equal(first, more)
    assert first.shape == (12, 16, 3)
    assert first.dtype == np.float32


def test_a_new_view_or_camera_starts_over(renderer):
    renderer.render(3)
    renderer.use("normal").render()
    assert renderer.samples == 1
    before = renderer.render().image()
    renderer.camera.set_camera_parameters(eye=(3, 0, 3))
    assert not renderer.is_current()
    assert np.abs(renderer.image() - before).max() > 0.1
    assert renderer.samples == 1
    renderer.reset()
    assert renderer.samples == 0


def test_the_second_picture_by_packets_equals_the_first(renderer):
    first = renderer.use("barycentric").render().image()
    renderer.camera.set_camera_parameters()
    np.testing.assert_array_equal(renderer.render().image(), first)
    assert renderer.hits.traces == 2


def test_every_view_has_a_setter_that_is_use(renderer):
    for view in renderer.offers:
        for name in (view.name, *view.aliases):
            getattr(renderer, f"set_shade_{name}")()
            assert renderer.active is view
            assert renderer.use(name).active is view
            assert view.label in getattr(renderer, f"set_shade_{name}").__doc__


def test_canvas_and_image_differ_only_in_which_way_is_up(renderer):
    image = renderer.use("barycentric").render().image()
    np.testing.assert_array_equal(renderer.canvas.to_numpy().transpose(1, 0, 2)[::-1], image)


def test_what_cannot_be_rendered_is_one_line(renderer):
    with pytest.raises(tt.InputError, match="normal"):
        renderer.use("nromal")
    for spp in (0, -1, 1.5):
        with pytest.raises(tt.InputError, match="spp must be a whole number of at least 1"):
            renderer.render(spp)


def test_notebooks_show_a_png(renderer):
    import io

    from PIL import Image

    picture = Image.open(io.BytesIO(renderer.use("hit")._repr_png_()))
    assert picture.size == (16, 12)
    assert "hit, 16×12, 1 samples" in repr(renderer)


def test_a_camera_of_ones_own_gives_the_size():
    camera = tt.Camera(5, 7, eye=(0, 0, 2))
    renderer = tt.A1Renderer(scene_data=tt.scene_from_mesh(*SQUARE), camera=camera)
    assert renderer.image().shape == (7, 5, 3)
