"""Environments and backgrounds: what surrounds a scene."""

import numpy as np
import pytest
import taichi as ti
from oracles import backgrounds as oracle
from oracles import light
from probe import put, vec3
from shapes import SQUARE
from support import start

import taichi_tracer as tt
from taichi_tracer.contracts.lab import Rows
from taichi_tracer.environment import Environment, load_background, load_environment
from taichi_tracer.system import runtime

pytestmark = pytest.mark.usefixtures("f32")


@ti.kernel
def _radiance(environment: ti.template(), d: ti.types.ndarray(ndim=2), out: ti.types.ndarray(ndim=2)):
    for i in range(d.shape[0]):
        put(out, i, 0, environment.radiance(vec3(d, i, 0)))


def radiance(environment, directions):
    """(N, 3)."""
    d = np.ascontiguousarray(directions, runtime.dtype())
    out = np.zeros((len(d), 3), runtime.dtype())
    _radiance(environment, d, out)
    return out


def random_image(rng, h=16, w=32):
    return rng.lognormal(sigma=2, size=(h, w, 3)).astype(np.float32)


def test_nearest_texel_is_that_of_the_formula(precision, rng):
    """A2-5 with C-1, but where the coordinate is within rounding of a texel's edge."""
    image = random_image(rng)
    directions = light.to_unit(rng.normal(size=(50_000, 3))).astype(runtime.dtype())
    found = radiance(Environment(image), directions)
    expected = light.lookup(image, directions)
    assert (found == expected).all(axis=1).mean() > (0.9995 if precision == "f32" else 0.99999)


def test_axes_and_signed_zeros_stay_inside_the_image():
    start("f32")
    image = np.arange(8, dtype=np.float32)[:, None, None] * 100 + np.arange(16)[None, :, None] + np.zeros(3)
    axes = [[s if k == axis else z for k in range(3)] for axis in range(3) for s in (1.0, -1.0) for z in (0.0, -0.0)]
    near_seam = [[-1, 0, z] for z in (1e-7, -1e-7, 1e-30, -1e-30)] + [[1e-8, y, 1e-8] for y in (1, -1)]
    for lookup in ("nearest", "bilinear"):
        found = radiance(Environment(image, lookup=lookup), np.array(axes + near_seam))
        assert np.isfinite(found).all()
        assert found.min() >= 0
        assert found.max() <= image.max()
    found = radiance(Environment(image), [[0, 1, 0], [0, -1, 0], [1, 0.01, 0.01], [-1, 0.01, -1e-3]])
    assert found[0, 0] // 100 == 0  # the top row is up
    assert found[1, 0] // 100 == 7
    assert found[2, 0] % 100 == 8
    assert found[3, 0] % 100 == 0


def test_bilinear_meets_the_texels_at_their_centres_and_wraps(rng):
    image = random_image(rng, 4, 8)
    u, v = np.meshgrid((np.arange(8) + 0.5) / 8, 1 - (np.arange(4) + 0.5) / 4)
    angle, elevation = 2 * np.pi * (u - 0.5), np.pi * (v - 0.5)
    centres = np.stack([np.cos(elevation) * np.cos(angle), np.sin(elevation), np.cos(elevation) * np.sin(angle)], -1)
    environment = Environment(image, lookup="bilinear")
    np.testing.assert_allclose(radiance(environment, centres.reshape(-1, 3)), image.reshape(-1, 3), rtol=1e-3)
    seam = radiance(environment, [[-np.cos(elevation[1, 0]), np.sin(elevation[1, 0]), 0]])
    np.testing.assert_allclose(seam[0], (image[1, 0] + image[1, -1]) / 2, rtol=1e-3)


def test_intensity_and_rotation(rng):
    image = random_image(rng)
    d = light.to_unit(rng.normal(size=(5_000, 3)))
    plain, turned = Environment(image, intensity=2.5), Environment(image, rotation=90)
    np.testing.assert_allclose(radiance(plain, d), 2.5 * radiance(Environment(image), d), rtol=1e-6)
    back = np.stack([d[:, 2], d[:, 1], -d[:, 0]], axis=1)  # a quarter turn of azimuth less
    same = (radiance(turned, d) == radiance(Environment(image), back)).all(axis=1)
    assert same.mean() > 0.999
    version = plain.version
    plain.set_intensity(0)
    assert plain.version == version + 1
    assert not radiance(plain, d).any()
    plain.set_rotation(10)
    assert plain.version == version + 2


@pytest.mark.parametrize(
    ("image", "message"),
    [
        ([[[1, np.nan, 0]]], "environment: radiance is not finite at row 0, column 0: nan (1 such texels)"),
        (np.full((2, 4, 3), -0.5), "radiance is negative at row 0, column 0: -0.5 (8 such texels)"),
        (np.full((1, 2, 3), 1e39), "is not finite at row 0, column 0: 1e+39"),
        (np.zeros((2, 4, 4)), "has the shape (height, width, 3), not (2, 4, 4)"),
        (np.zeros((0, 0, 3)), "has the shape (height, width, 3), not (0, 0, 3)"),
        ("studoi", "unknown environment 'studoi': did you mean 'studio'?"),
        ("nowhere/sky.hdr", "nowhere/sky.hdr: no such file"),
    ],
)
def test_what_is_no_radiance_is_refused_with_its_place(image, message):
    start("f32")
    with pytest.raises(tt.InputError) as error:
        load_environment(image)
    assert message in str(error.value)


@pytest.mark.parametrize("extension", [".npy", ".pfm", ".exr", ".hdr", ".png"])
def test_files_are_linear_radiance(extension, tmp_path, rng):
    if extension in (".exr", ".hdr"):
        pytest.importorskip("OpenImageIO")
    image = rng.uniform(0.1, 0.9, (4, 8, 3)).astype(np.float32) * (1 if extension == ".png" else 50)
    path = tmp_path / f"sky{extension}"
    tt.save_image(path, image, srgb=extension == ".png")
    environment = load_environment(path)
    tolerance = {".png": 0.01, ".hdr": 0.4}.get(extension, 1e-5)
    np.testing.assert_allclose(environment.pixels, image, atol=tolerance)


# ── backgrounds ──


COLORS = [(0.0, 0.0, 0.25), (1.0, 0.5, 0.0), (0.25, 1.0, 0.125), (1.0, 0.0, 0.75)]


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


def test_a_look_up_behind_the_last_column_is_in_the_first():
    """u − ⌊u⌋ is rounded to 1 where u is a little below 0."""
    look = Rows(Environment(np.ones((2, 4, 3))).texel_of, (1, 1), (1, 1))
    rows, columns = look(np.array([0.0, 0.99, 1.0]), np.array([0.0, 0.5, 1.0]))
    assert np.ravel(rows).tolist() == [1, 1, 0]
    assert np.ravel(columns).tolist() == [0, 3, 0]
