"""What stands behind a scene: exact at the pixels' centres, of the whole frame, and only where nothing is hit."""

import numpy as np
import pytest
import taichi as ti
from oracles import backgrounds as oracle
from shapes import SQUARE

import taichi_tracer as tt
from taichi_tracer.background import load_background

COLORS = [(0.0, 0.0, 0.25), (1.0, 0.5, 0.0), (0.25, 1.0, 0.125), (1.0, 0.0, 0.75)]


pytestmark = pytest.mark.usefixtures("f32")


@ti.kernel
def _show(background: ti.template(), width: int, height: int, out: ti.types.ndarray(ndim=3)):
    for row, column in ti.ndrange(height, width):
        value = background.color(column, height - 1 - row, width, height)
        for k in ti.static(range(3)):
            out[row, column, k] = value[k]


def picture(background, width, height):
    out = np.zeros((height, width, 3), np.float32)
    _show(background, width, height, out)
    return out


def test_four_corners_are_bilinear_at_pixel_centres():
    background = load_background(COLORS)
    for width, height in ((2, 2), (7, 5), (1, 1), (640, 3)):
        expected = oracle.corners(width, height, *COLORS)
        np.testing.assert_allclose(picture(background, width, height), expected, atol=1.2e-7)


def test_corners_stand_where_their_names_say():
    shown = picture(load_background(COLORS), 400, 300)
    for (row, column), color in zip(((-1, 0), (0, 0), (0, -1), (-1, -1)), COLORS, strict=True):
        np.testing.assert_allclose(shown[row, column], color, atol=0.005)


def test_an_image_is_stretched_over_the_frame(rng):
    image = rng.uniform(size=(6, 9, 3)).astype(np.float32)
    background = load_background(image)
    for width, height in ((40, 30), (3, 2), (9, 60)):
        np.testing.assert_allclose(
            picture(background, width, height), oracle.stretched(width, height, image), atol=3e-7
        )


def test_an_image_file_is_decoded_from_srgb(tmp_path):
    tt.save_image(tmp_path / "half.png", np.full((2, 2, 3), 0.25), srgb=True)
    background = load_background(tmp_path / "half.png")
    np.testing.assert_allclose(picture(background, 1, 1), 0.25, atol=3e-3)
    assert "half.png" in background.what


@pytest.mark.parametrize(
    ("value", "message"),
    [
        ([1, 2], "has the shape (height, width, 3), not (2,)"),
        (np.full((2, 2, 3), np.nan), "a colour is not finite at row 0, column 0: nan"),
        ((0.5, -1, 0), "a colour is negative at row 0, column 0: -1"),
        ("missing.png", "missing.png: no such file"),
        ("missing.gif", "unknown image type"),
    ],
)
def test_a_background_that_cannot_be_is_one_line(value, message):
    with pytest.raises(tt.InputError) as error:
        load_background(value)
    assert message in str(error.value)


def test_the_six_views_stay_black_there():
    scene = tt.scene_from_mesh(*SQUARE, background=COLORS)
    assert not tt.A1Renderer(scene, 16, 16).use("normal").image()[0, 0].any()
