"""Images: what is written is read again, the top row first, and what cannot be is refused by name."""

import os

import numpy as np
import pytest
from PIL import Image

from taichi_tracer.files import images
from taichi_tracer.files.images import (
    Picture,
    display_in,
    read_image,
    save_image,
    to_bytes,
    to_rgbe,
)
from taichi_tracer.system.errors import InputError
from taichi_tracer.tones.display import Display

EIGHT_BITS = [".png", ".jpg", ".jpeg", ".ppm"]
RED, GREEN, BLUE = np.eye(3)
TOP_RED = np.array([[RED] * 16] * 8 + [[GREEN] * 8 + [BLUE] * 8] * 8)  # below, green is left and blue right


@pytest.fixture
def picture(rng):
    """(5, 7, 3): no two rows, columns or channels are the same."""
    return rng.uniform(size=(5, 7, 3)).astype(np.float32)


def needs_openimageio(extension):
    if extension in images.NEED_OPENIMAGEIO:
        pytest.importorskip("OpenImageIO")


# Round trips


@pytest.mark.parametrize("extension", [".pfm", ".npy", ".exr"])
def test_floats_are_read_as_they_were_written(tmp_path, picture, extension):
    needs_openimageio(extension)
    picture[0, 0] = -3.5, 1e-30, 1e30
    path = tmp_path / f"image{extension}"
    save_image(path, picture)
    read = read_image(path)
    assert read.dtype == np.float32
    assert np.array_equal(read, picture)


def test_hdr_keeps_what_rgbe_can_hold(tmp_path, picture):
    pytest.importorskip("OpenImageIO")
    picture[0, 0] = 1000, 900, 0.5
    save_image(tmp_path / "image.hdr", picture)
    read = read_image(tmp_path / "image.hdr")
    assert np.array_equal(read, to_rgbe(picture))
    assert (np.abs(read - picture) <= picture.max(axis=-1, keepdims=True) / 255).all()


@pytest.mark.parametrize("extension", [".png", ".jpg"])
def test_srgb_is_undone_on_reading(tmp_path, extension):
    grey = np.full((8, 8, 3), 0.2)
    save_image(tmp_path / f"image{extension}", grey, srgb=True)
    assert np.allclose(read_image(tmp_path / f"image{extension}", srgb=True), 0.2, atol=0.005)
    assert np.allclose(read_image(tmp_path / f"image{extension}"), 0.4845, atol=0.005)  # IEC 61966-2-1 of 0.2


# Orientation


@pytest.mark.parametrize("extension", images.DECODERS)
def test_the_top_row_comes_first(tmp_path, extension):
    needs_openimageio(extension)
    save_image(tmp_path / f"image{extension}", TOP_RED)
    assert np.abs(read_image(tmp_path / f"image{extension}") - TOP_RED).max() < 0.1


@pytest.mark.parametrize(("scale", "dtype"), [("-1.0", "<f4"), ("1.0", ">f4"), ("+2.5e0", ">f4")])
@pytest.mark.parametrize(("kind", "channels"), [("PF", 3), ("Pf", 1)])
def test_pfm_of_both_byte_orders_and_grey_is_read(tmp_path, picture, scale, dtype, kind, channels):
    values = picture[..., :channels]
    header = f"{kind}\n7 5\n{scale}\n".encode()
    (tmp_path / "image.pfm").write_bytes(header + values[::-1].astype(dtype).tobytes())
    assert np.array_equal(read_image(tmp_path / "image.pfm"), np.broadcast_to(values, (5, 7, 3)))


# Channels and depths


@pytest.mark.parametrize("extension", [".png", ".pfm", ".npy", ".exr", ".hdr"])
@pytest.mark.parametrize("shape", [(3, 2), (3, 2, 1), (3, 2, 4)])
def test_grey_becomes_rgb_and_alpha_is_left_out(tmp_path, extension, shape):
    needs_openimageio(extension)
    image = np.full(shape, 1.0)
    image[0, ...] = 0.0
    save_image(tmp_path / f"image{extension}", image)
    expected = np.ones((3, 2, 3))
    expected[0] = 0
    assert np.array_equal(read_image(tmp_path / f"image{extension}"), expected)


def test_16_bit_grey_png_keeps_its_depth(tmp_path):
    steps = np.array([[0, 1, 257, 65535]], np.uint16)
    Image.fromarray(steps).save(tmp_path / "image.png")
    assert np.allclose(read_image(tmp_path / "image.png")[0, :, 0] * 65535, steps[0], atol=0.01)


@pytest.mark.parametrize("extension", [".png", ".jpg", ".ppm", ".hdr"])
def test_nan_is_told_where_the_format_has_none(tmp_path, extension):
    if extension == ".hdr":
        pytest.importorskip("OpenImageIO")
    image = np.ones((2, 3, 3))
    image[0, 0, 1] = np.nan
    with pytest.warns(UserWarning, match=rf"a\{extension}: 1 of 6 pixels are NaN and written as 0.*\.pfm, \.npy have"):
        save_image(tmp_path / f"a{extension}", image)


@pytest.mark.parametrize("extension", [".png", ".jpg", ".ppm", ".pfm", ".npy"])
def test_a_picture_knows_whether_it_is_light_and_an_argument_wins(tmp_path, picture, extension):
    def saved(image, **options):
        save_image(tmp_path / f"a{extension}", image, **options)
        return (tmp_path / f"a{extension}").read_bytes()

    encoded, unchanged = (saved(np.asarray(picture), srgb=srgb) for srgb in (True, False))
    assert (encoded == unchanged) == (extension in (".pfm", ".npy"))
    assert saved(np.asarray(picture)) == unchanged
    assert saved(Picture(picture, srgb=True)) == encoded
    assert saved(Picture(picture, srgb=True)[:, :]) == encoded
    assert saved(Picture(picture, srgb=False)) == unchanged
    assert saved(Picture(picture)) == unchanged
    assert saved(Picture(picture, srgb=True), srgb=False) == unchanged
    assert saved(Picture(picture, srgb=False), srgb=True) == encoded


# Channels beside a picture


def test_other_channels_of_an_exr_are_stored_unchanged_under_their_names(tmp_path, picture):
    oiio = pytest.importorskip("OpenImageIO")
    depth = np.where(np.eye(*picture.shape[:2]) > 0, np.inf, -2.5)
    ids = np.arange(depth.size, dtype=np.int32).reshape(depth.shape)
    save_image(tmp_path / "a.exr", picture, channels={"Z": depth, "id": ids})
    file = oiio.ImageInput.open(str(tmp_path / "a.exr"))
    names, pixels = list(file.spec().channelnames), file.read_image("float")
    assert sorted(names) == ["B", "G", "R", "Z", "id"]
    np.testing.assert_array_equal(pixels[..., names.index("Z")], depth)
    np.testing.assert_array_equal(pixels[..., names.index("id")], ids)
    np.testing.assert_array_equal(read_image(tmp_path / "a.exr"), np.float32(picture))


# Places that cannot be written


def test_a_failed_write_leaves_the_old_file_and_nothing_else(tmp_path, monkeypatch):
    (tmp_path / "a.png").write_bytes(b"old")

    def full(*_):
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(os, "replace", full)
    with pytest.raises(InputError, match=r"a\.png: cannot be written \(No space left on device\)"):
        save_image(tmp_path / "a.png", np.ones((2, 2, 3)))
    assert [(p.name, p.read_bytes()) for p in tmp_path.iterdir()] == [("a.png", b"old")]


# Files that cannot be read


@pytest.mark.parametrize("extension", [".png", ".jpg", ".pfm", ".npy", ".exr"])
def test_files_that_were_cut_short_are_refused(tmp_path, extension, rng):
    needs_openimageio(extension)
    path = tmp_path / f"a{extension}"
    save_image(path, rng.uniform(size=(64, 64, 3)))
    path.write_bytes(path.read_bytes()[: path.stat().st_size // 2])
    with pytest.raises(InputError, match=rf"a\{extension}: "):
        read_image(path)


def test_sizes_beyond_any_picture_are_refused_before_they_are_allocated(tmp_path):
    (tmp_path / "a.pfm").write_bytes(b"PF\n999999999 999999999\n-1.0\n")
    (tmp_path / "b.pfm").write_bytes(b"PF\n0 3\n-1.0\n")
    with pytest.raises(InputError, match="999999999 x 999999999 pixels: from 1 to"):
        read_image(tmp_path / "a.pfm")
    with pytest.raises(InputError, match="0 x 3 pixels"):
        read_image(tmp_path / "b.pfm")


# ── exposure and tone curve ──


@pytest.mark.parametrize("extension", EIGHT_BITS)
def test_exposure_and_tone_change_files_of_8_bits_and_are_told_there(tmp_path, picture, extension):
    plain, shown = tmp_path / f"plain{extension}", tmp_path / f"shown{extension}"
    save_image(plain, picture, srgb=True)
    save_image(shown, picture, srgb=True, exposure=-1, tone="filmic")
    expected = to_bytes(picture, srgb=True, display=Display(-1, "filmic")).astype(int)
    off = abs(np.asarray(Image.open(shown)).astype(int) - expected)
    assert off.mean() < (4 if "jp" in extension else 1e-9)  # a JPEG of noise is off by a few steps
    if extension != ".ppm":  # which has no place for it, and is only written
        assert b"Display" in shown.read_bytes()
        assert b"exposure -1 stops, tone curve filmic" in shown.read_bytes()
        assert b"Display" not in plain.read_bytes()
        assert display_in(shown) == "exposure -1 stops, tone curve filmic"
        assert display_in(plain) is None


def test_a_photograph_stands_as_its_camera_was_held(tmp_path):
    """The tag 0x0112 of EXIF: 6 is a picture that has to be turned by a quarter, clockwise."""
    from PIL import Image

    pixels = np.zeros((16, 32, 3), np.uint8)
    pixels[:, :16] = 255  # white on the left
    exif = Image.Exif()
    exif[0x0112] = 6
    Image.fromarray(pixels).save(tmp_path / "a.jpg", exif=exif, quality=100)
    image = read_image(tmp_path / "a.jpg")
    assert image.shape == (32, 16, 3)
    assert image[:14].min() > 0.9 > 0.1 > image[-14:].max()  # white at the top
