"""Images: what is written is read again, the top row first, and what cannot be is refused by name."""

import io
import os
import sys

import numpy as np
import pytest
from PIL import Image

import taichi_tracer as tt
from taichi_tracer.files import images
from taichi_tracer.files.images import (
    check_writable,
    encode_png,
    read_image,
    save_image,
    to_rgbe,
    told_display,
)
from taichi_tracer.files.picture import Picture
from taichi_tracer.files.srgb import to_bytes
from taichi_tracer.system.errors import InputError, MissingFileError
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


def write_with(oiio, path, spec, pixels):
    output = oiio.ImageOutput.create(str(path))
    assert output.open(str(path), spec)
    assert output.write_image(pixels)
    assert output.close()


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


@pytest.mark.parametrize("extension", [".pfm", ".npy", ".exr"])
def test_nan_and_infinity_survive_in_floats(tmp_path, extension):
    needs_openimageio(extension)
    odd = np.array([[[np.nan, np.inf, -np.inf]]], np.float32)
    save_image(tmp_path / f"image{extension}", odd)
    assert np.array_equal(read_image(tmp_path / f"image{extension}"), odd, equal_nan=True)


def test_hdr_keeps_what_rgbe_can_hold(tmp_path, picture):
    pytest.importorskip("OpenImageIO")
    picture[0, 0] = 1000, 900, 0.5
    save_image(tmp_path / "image.hdr", picture)
    read = read_image(tmp_path / "image.hdr")
    assert np.array_equal(read, to_rgbe(picture))
    assert (np.abs(read - picture) <= picture.max(axis=-1, keepdims=True) / 255).all()


def test_png_is_within_half_a_step(tmp_path, picture):
    save_image(tmp_path / "image.png", picture)
    read = read_image(tmp_path / "image.png")
    assert read.dtype == np.float32
    assert np.abs(read - picture).max() <= 0.5 / 255 + 1e-7


@pytest.mark.parametrize("extension", [".png", ".jpg"])
def test_srgb_is_undone_on_reading(tmp_path, extension):
    grey = np.full((8, 8, 3), 0.2)
    save_image(tmp_path / f"image{extension}", grey, srgb=True)
    assert np.allclose(read_image(tmp_path / f"image{extension}", srgb=True), 0.2, atol=0.005)
    assert np.allclose(read_image(tmp_path / f"image{extension}"), 0.4845, atol=0.005)  # IEC 61966-2-1 of 0.2


@pytest.mark.parametrize("extension", [".pfm", ".npy", ".exr", ".hdr"])
def test_floats_are_always_linear(tmp_path, extension):
    needs_openimageio(extension)
    save_image(tmp_path / f"image{extension}", np.full((2, 2, 3), 0.25), srgb=True)
    assert (read_image(tmp_path / f"image{extension}", srgb=True) == 0.25).all()


def test_ppm_holds_the_bytes_from_the_top(tmp_path, picture):
    save_image(tmp_path / "image.ppm", picture)
    assert (tmp_path / "image.ppm").read_bytes() == b"P6\n7 5\n255\n" + to_bytes(picture).tobytes()
    assert np.array_equal(np.asarray(Image.open(tmp_path / "image.ppm")), to_bytes(picture))


# Orientation


@pytest.mark.parametrize("extension", images.DECODERS)
def test_the_top_row_comes_first(tmp_path, extension):
    needs_openimageio(extension)
    save_image(tmp_path / f"image{extension}", TOP_RED)
    assert np.abs(read_image(tmp_path / f"image{extension}") - TOP_RED).max() < 0.1


@pytest.mark.parametrize("extension", EIGHT_BITS)
def test_other_programs_see_the_top_row_first(tmp_path, extension):
    save_image(tmp_path / f"image{extension}", TOP_RED)
    seen = np.asarray(Image.open(tmp_path / f"image{extension}").convert("RGB"), int)
    assert np.abs(seen - 255 * TOP_RED).max() < 25


def test_pfm_stores_the_bottom_row_first(tmp_path):
    save_image(tmp_path / "image.pfm", np.array([[RED], [BLUE]]))
    content = (tmp_path / "image.pfm").read_bytes()
    assert content == b"PF\n1 2\n-1.0\n" + np.array([BLUE, RED], "<f4").tobytes()


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


@pytest.mark.parametrize("mode", ["L", "RGBA", "P", "1"])
def test_png_of_any_kind_is_read_as_rgb(tmp_path, mode):
    Image.new("RGB", (4, 3), (255, 255, 255)).convert(mode).save(tmp_path / "image.png")
    assert np.array_equal(read_image(tmp_path / "image.png"), np.ones((3, 4, 3)))


def test_colours_under_transparency_are_as_they_stand(tmp_path):
    Image.new("RGBA", (2, 2), (255, 51, 0, 10)).save(tmp_path / "image.png")
    assert np.allclose(read_image(tmp_path / "image.png"), [1.0, 0.2, 0.0])


def test_16_bit_grey_png_keeps_its_depth(tmp_path):
    steps = np.array([[0, 1, 257, 65535]], np.uint16)
    Image.fromarray(steps).save(tmp_path / "image.png")
    assert np.allclose(read_image(tmp_path / "image.png")[0, :, 0] * 65535, steps[0], atol=0.01)


@pytest.mark.parametrize("alpha", [(), (20000,)])
def test_16_bit_colour_png_keeps_its_depth_whatever_its_alpha(tmp_path, alpha):
    oiio = pytest.importorskip("OpenImageIO")
    spec = oiio.ImageSpec(1, 1, 3 + len(alpha), "uint16")
    spec.attribute("oiio:UnassociatedAlpha", 1)
    write_with(oiio, tmp_path / "image.png", spec, np.array([[[258, 1001, 65535, *alpha]]], np.uint16))
    assert np.allclose(read_image(tmp_path / "image.png") * 65535, [258, 1001, 65535], atol=0.01)


def test_exr_channels_are_found_by_name(tmp_path):
    oiio = pytest.importorskip("OpenImageIO")
    spec = oiio.ImageSpec(1, 1, 4, "float")
    spec.channelnames = ("Z", "R", "G", "B")
    write_with(oiio, tmp_path / "image.exr", spec, np.array([[[9, 1, 2, 3]]], np.float32))
    assert read_image(tmp_path / "image.exr").tolist() == [[[1, 2, 3]]]


@pytest.mark.parametrize("dtype", [np.float64, np.float16, np.int32, np.uint8])
def test_npy_of_any_number_is_read_as_float32(tmp_path, dtype):
    np.save(tmp_path / "image.npy", np.arange(12, dtype=dtype).reshape(2, 2, 3))
    read = read_image(tmp_path / "image.npy")
    assert read.dtype == np.float32
    assert read.ravel().tolist() == list(range(12))


def test_whole_numbers_without_sign_count_their_largest_as_one(tmp_path):
    steps = np.arange(256, dtype=np.uint8).reshape(16, 16)
    for name, image in (("8.png", steps), ("16.png", steps.astype(np.uint16) * 257), ("8.pfm", steps)):
        save_image(tmp_path / name, image)
        np.testing.assert_allclose(read_image(tmp_path / name)[..., 0] * 255, steps, rtol=1e-6)


@pytest.mark.parametrize("extension", [".png", ".jpg", ".ppm", ".hdr"])
def test_nan_is_told_where_the_format_has_none(tmp_path, extension):
    if extension == ".hdr":
        pytest.importorskip("OpenImageIO")
    image = np.ones((2, 3, 3))
    image[0, 0, 1] = np.nan
    with pytest.warns(UserWarning, match=rf"a\{extension}: 1 of 6 pixels are NaN and written as 0.*\.pfm, \.npy have"):
        save_image(tmp_path / f"a{extension}", image)


@pytest.mark.parametrize("srgb", [False, True])
def test_encoded_png_is_the_file_that_is_saved(tmp_path, picture, srgb):
    save_image(tmp_path / "image.png", picture, srgb)
    assert encode_png(picture, srgb) == (tmp_path / "image.png").read_bytes()
    assert np.array_equal(np.asarray(Image.open(io.BytesIO(encode_png(picture, srgb)))), to_bytes(picture, srgb))


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


def test_what_was_decoded_is_encoded_again(tmp_path, picture):
    save_image(tmp_path / "a.png", picture)
    read = read_image(tmp_path / "a.png", srgb=True)
    assert read.srgb
    save_image(tmp_path / "b.png", read)
    assert (tmp_path / "a.png").read_bytes() == (tmp_path / "b.png").read_bytes()
    assert type(read_image(tmp_path / "a.png")) is np.ndarray


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


def test_channels_that_do_not_fit_are_refused(tmp_path, picture):
    pytest.importorskip("OpenImageIO")
    with pytest.raises(InputError, match=r"a\.exr: channel Z must have the shape .* of the image, not \(3,\)"):
        save_image(tmp_path / "a.exr", picture, channels={"Z": np.zeros(3)})
    with pytest.raises(InputError, match="channel R is a channel of the image itself: give another name"):
        save_image(tmp_path / "a.exr", picture, channels={"R": picture[..., 0]})
    for name in ("a.png", "a.hdr", "a.npy"):
        with pytest.raises(InputError, match="file has no place for Z: give a name that ends in .exr"):
            save_image(tmp_path / name, picture, channels={"Z": picture[..., 0]})
    assert list(tmp_path.iterdir()) == []


def test_rgbe_is_the_nearest_value_and_drops_what_it_cannot_hold():
    values = np.array([[1.0, 0.5, 0.25], [255.7, 0, 0], [-1, np.nan, 3], [np.inf, 0, 0], [0, 0, 0]])
    assert to_rgbe(values).tolist() == [[1, 0.5, 0.25], [256, 0, 0], [0, 0, 3], [images.LARGEST_RGBE, 0, 0], [0, 0, 0]]


def test_rgbe_does_not_darken_a_picture(rng):
    values = rng.uniform(0.1, 1, (100, 100, 3))
    assert abs(to_rgbe(values).mean() / values.mean() - 1) < 1e-4


# Places that cannot be written


@pytest.mark.parametrize("check", [check_writable, lambda path: save_image(path, np.ones((2, 2, 3)))])
def test_places_that_cannot_be_written_are_refused_with_the_reason(tmp_path, check):
    (tmp_path / "folder.png").mkdir()
    (tmp_path / "file").touch()
    reasons = {
        "none/a.png": "the folder .*none does not exist",
        "file/a.png": "the folder .*file does not exist",
        "folder.png": "this is a folder",
        "a.bmp": r"unknown image type '\.bmp': known are \.png",
        "a": "the name has no ending",
    }
    for name, reason in reasons.items():
        with pytest.raises(InputError, match=reason):
            check(tmp_path / name)
    check(tmp_path / "A.PNG")


def test_a_folder_without_permission_is_refused(tmp_path, monkeypatch):
    monkeypatch.setattr(os, "access", lambda path, mode: path != tmp_path)  # the superuser may write anywhere
    with pytest.raises(InputError, match=r"a\.png: no permission to write there"):
        check_writable(tmp_path / "a.png")


def test_a_failed_write_leaves_the_old_file_and_nothing_else(tmp_path, monkeypatch):
    (tmp_path / "a.png").write_bytes(b"old")

    def full(*_):
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(os, "replace", full)
    with pytest.raises(InputError, match=r"a\.png: cannot be written \(No space left on device\)"):
        save_image(tmp_path / "a.png", np.ones((2, 2, 3)))
    assert [(p.name, p.read_bytes()) for p in tmp_path.iterdir()] == [("a.png", b"old")]


def test_saving_replaces_an_older_file_and_leaves_no_other(tmp_path):
    (tmp_path / "a.npy").write_bytes(b"old")
    save_image(tmp_path / "a.npy", np.ones((2, 2, 3)))
    assert [p.name for p in tmp_path.iterdir()] == ["a.npy"]
    assert (read_image(tmp_path / "a.npy") == 1).all()


@pytest.mark.parametrize("shape", [(4,), (2, 2, 2), (2, 2, 5), (0, 2, 3), (1, 2, 2, 3)])
def test_arrays_that_are_no_image_are_refused(tmp_path, shape):
    with pytest.raises(InputError, match=r"a\.png: an image must have the shape \(height, width, 3\), not"):
        save_image(tmp_path / "a.png", np.zeros(shape))
    assert not (tmp_path / "a.png").exists()


def test_a_jpeg_that_is_too_long_says_what_to_use(tmp_path):
    with pytest.raises(InputError, match=r"a\.jpg: a JPEG has at most 65500 pixels on a side, not 65501: use \.png"):
        save_image(tmp_path / "a.jpg", np.zeros((1, 65501, 3)))


@pytest.mark.parametrize("extension", images.NEED_OPENIMAGEIO)
def test_without_openimageio_the_error_says_how_to_get_it(tmp_path, monkeypatch, extension):
    monkeypatch.setitem(sys.modules, "OpenImageIO", None)
    (tmp_path / f"a{extension}").write_bytes(b"x")
    for use in (check_writable, read_image):
        with pytest.raises(InputError, match=r'need OpenImageIO: pip install "taichi_tracer\[exr\]", or use \.pfm'):
            use(tmp_path / f"a{extension}")


# Files that cannot be read


@pytest.mark.parametrize("name", ["a.ppm", "a.gif", "a.txt", "a"])
def test_other_formats_are_refused_with_the_known_ones(tmp_path, name):
    (tmp_path / name).touch()
    with pytest.raises(InputError, match=r"unknown image type .*: known are \.png"):
        read_image(tmp_path / name)


@pytest.mark.parametrize("extension", images.DECODERS)
@pytest.mark.parametrize("content", [b"", b"garbage of some length, and no image at all"])
def test_damaged_files_are_refused_by_name_in_one_line(tmp_path, extension, content):
    needs_openimageio(extension)
    (tmp_path / f"a{extension}").write_bytes(content)
    with pytest.raises(InputError) as caught:
        read_image(tmp_path / f"a{extension}")
    assert f"a{extension}: " in str(caught.value)
    assert "\n" not in str(caught.value)


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


@pytest.mark.parametrize(
    ("array", "message"),
    [
        (np.zeros((2, 2, 3), complex), "must hold numbers, not complex"),
        (np.zeros((2, 2, 3), bool), "must hold numbers, not bool"),
        (np.array([[{}]]), "cannot be read as NPY"),
        (np.zeros(3), "must have the shape"),
    ],
)
def test_arrays_that_are_no_picture_are_refused(tmp_path, array, message):
    np.save(tmp_path / "a.npy", array)
    with pytest.raises(InputError, match=rf"a\.npy: .*{message}"):
        read_image(tmp_path / "a.npy")


def test_an_archive_of_arrays_is_refused(tmp_path):
    np.savez(tmp_path / "a.npz", image=np.zeros((2, 2, 3)))
    (tmp_path / "a.npz").rename(tmp_path / "a.npy")
    with pytest.raises(InputError, match="an archive of arrays"):
        read_image(tmp_path / "a.npy")


@pytest.mark.parametrize("extension", [".png", ".npy", ".exr"])
def test_a_missing_file_is_named(tmp_path, extension):
    with pytest.raises(MissingFileError, match=rf"none\{extension}: no such file"):
        read_image(tmp_path / f"none{extension}")


# ── exposure and tone curve ──


@pytest.mark.parametrize("extension", EIGHT_BITS)
def test_exposure_and_tone_change_files_of_8_bits_and_are_told_there(tmp_path, picture, extension):
    plain, shown = tmp_path / f"plain{extension}", tmp_path / f"shown{extension}"
    save_image(plain, picture, srgb=True)
    save_image(shown, picture, srgb=True, exposure=-1, tone="filmic")
    expected = to_bytes(picture, srgb=True, display=Display(-1, "filmic")).astype(int)
    off = abs(np.asarray(Image.open(shown)).astype(int) - expected)
    assert off.mean() < (4 if "jp" in extension else 1e-9)  # a JPEG of noise is off by a few steps
    assert b"Display" in shown.read_bytes()
    assert b"exposure -1 stops, tone curve filmic" in shown.read_bytes()
    assert b"Display" not in plain.read_bytes()
    if extension != ".ppm":  # which is only written
        assert told_display(shown) == "exposure -1 stops, tone curve filmic"
        assert told_display(plain) is None


@pytest.mark.parametrize("extension", EIGHT_BITS)
def test_without_exposure_and_tone_a_file_has_the_same_bits(tmp_path, picture, extension):
    for name, options in (("a", {}), ("b", {"exposure": 0.0, "tone": "none"})):
        save_image(tmp_path / (name + extension), picture, srgb=True, **options)
    assert (tmp_path / f"a{extension}").read_bytes() == (tmp_path / f"b{extension}").read_bytes()


@pytest.mark.parametrize("extension", [".exr", ".hdr", ".pfm", ".npy"])
def test_floating_point_files_stay_linear(tmp_path, picture, extension):
    needs_openimageio(extension)
    for name, options in (("a", {}), ("b", {"exposure": 3, "tone": "filmic"})):
        save_image(tmp_path / (name + extension), picture, srgb=True, **options)
    assert np.array_equal(read_image(tmp_path / f"a{extension}"), read_image(tmp_path / f"b{extension}"))
    assert told_display(tmp_path / f"b{extension}") is None


def test_a_tone_that_does_not_exist_writes_nothing(tmp_path, picture):
    with pytest.raises(InputError, match="unknown tone curve 'flimic': did you mean 'filmic'"):
        save_image(tmp_path / "a.png", picture, tone="flimic")
    assert list(tmp_path.iterdir()) == []


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


@pytest.mark.parametrize("path", [None, 3, np.zeros((2, 2, 3))])
def test_a_path_that_is_none_is_one_line(path):
    with pytest.raises(tt.InputError, match="save: the path must be the name of a file, not "):
        tt.save_image(path, np.zeros((2, 2, 3)))
    with pytest.raises(tt.InputError, match="save: the path must be the name of a file, not "):
        tt.A1Renderer(tt.load_scene_data("cube"), 4, 4).render().save(path)
