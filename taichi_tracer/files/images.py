"""Reading and writing of images: linear floating point, (height, width, 3), top row first (C-15).

Pillow handles PNG, JPEG and PPM. OpenImageIO (the extra ``exr``) handles EXR, HDR and 16-bit PNG. It is the only
library that reads and writes all three and has wheels for every supported Python on Linux, Windows and macOS, under
Apache-2.0: OpenCV's wheels have EXR switched off, and the package OpenEXR supports neither HDR nor PNG. This file
itself handles PFM and NPY.
"""

import io
import os
import re
import tempfile
import warnings
from collections.abc import Callable, Collection, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from taichi_tracer.files.disk import check_place, read_bytes, replace_file
from taichi_tracer.system.errors import InputError
from taichi_tracer.system.importing import import_extra
from taichi_tracer.tones.base import Tone
from taichi_tracer.tones.display import PLAIN_TONE, Display

# 16384 x 8192, the size of the largest usual environments. A header with more pixels is damaged, or an attack.
MAX_PIXELS = 1 << 27
JPEG_QUALITY = 95  # the highest value that Pillow's documentation recommends
LARGEST_RGBE = 255 * 2.0**119  # the largest value that the HDR format can store
# The keyword of a PNG's text, and the beginning of a JPEG's comment, that say how the values were changed.
DISPLAY_KEY = "Display"
LONGEST_REASON = 200  # characters of a library's own message that are shown


# ── bytes: the sRGB transfer function, and 255 steps (C-14) ──


PLAIN = Display()


def to_bytes(image: np.ndarray, srgb: bool = False, display: Display = PLAIN) -> np.ndarray:
    """(h, w, 3) uint8: values are clipped to [0, 1] and rounded to the nearest of 255 steps; NaN becomes 0.

    Args:
        image: (h, w, 3) float, linear.
        srgb: whether to apply the sRGB transfer function first. It is meant for radiance; data such as normals is
            written unchanged (C-14).
        display: exposure and tone curve, which come first.
    """
    values = display.shown(image)
    if srgb:
        values = srgb_from_linear(values)
    return np.floor(values * 255 + 0.5).astype(np.uint8)


def srgb_from_linear(values: np.ndarray) -> np.ndarray:
    """The sRGB transfer function (IEC 61966-2-1) of values in [0, 1]."""
    return np.where(values <= 0.0031308, 12.92 * values, 1.055 * np.maximum(values, 0.0031308) ** (1 / 2.4) - 0.055)


def linear_from_srgb(values: np.ndarray) -> np.ndarray:
    """The inverse of ``srgb_from_linear``."""
    return np.where(values <= 0.04045, values / 12.92, ((np.maximum(values, 0.04045) + 0.055) / 1.055) ** 2.4)


def linear_colors(values: np.ndarray) -> np.ndarray:
    """(n, 3) linear colours from sRGB, whose 1 is the largest whole number of their type; of floats, 1 or else 255."""
    most = np.iinfo(values.dtype).max if values.dtype.kind in "iu" else 255 if (values > 1).any() else 1
    return linear_from_srgb(np.clip(np.nan_to_num(values) / np.float64(most), 0, 1))


# ── writing ──


def encode_png(image: np.ndarray, srgb: bool | None = None, display: Display = PLAIN) -> bytes:
    """The bytes of a PNG file; arguments as for ``save_image``."""
    return _encode_pillow(_as_rgb(_as_float(np.asarray(image)), "image"), is_light(image, srgb), display, "PNG")


def is_light(image: np.ndarray, srgb: bool | None = None) -> bool:
    """Whether files of 8 bits get the sRGB transfer function: as ``srgb`` says, or else as the image itself says."""
    return bool(getattr(image, "srgb", None) if srgb is None else srgb)


def _encode_pillow(image: np.ndarray, srgb: bool, display: Display, kind: str) -> bytes:
    from PIL import Image
    from PIL.PngImagePlugin import PngInfo

    buffer = io.BytesIO()
    options: dict[str, Any] = {"quality": JPEG_QUALITY, "subsampling": 0} if kind == "JPEG" else {}
    if not display.is_plain and kind == "JPEG":
        options["comment"] = f"{DISPLAY_KEY}: {display}"
    elif not display.is_plain and kind == "PNG":
        options["pnginfo"] = PngInfo()
        options["pnginfo"].add_text(DISPLAY_KEY, str(display))
    Image.fromarray(to_bytes(image, srgb, display)).save(buffer, kind, **options)
    return buffer.getvalue()


def _encode_pfm(image: np.ndarray) -> bytes:
    height, width, _ = image.shape
    rows_from_bottom = np.ascontiguousarray(np.asarray(image, "<f4")[::-1])
    return b"PF\n%d %d\n-1.0\n" % (width, height) + rows_from_bottom.tobytes()


def _encode_npy(image: np.ndarray) -> bytes:
    buffer = io.BytesIO()
    np.save(buffer, np.asarray(image, np.float32))
    return buffer.getvalue()


def _encode_openimageio(image: np.ndarray, extension: str, channels: Sequence[str] = ("R", "G", "B")) -> bytes:
    """The bytes of an EXR or HDR file; ``channels`` has the names of the image's channels, in their order."""
    oiio = _openimageio(extension)
    buffer = oiio.ImageBuf(np.ascontiguousarray(image, np.float32))
    buffer.specmod().channelnames = tuple(channels)
    with tempfile.TemporaryDirectory() as folder:
        path = os.path.join(folder, "image" + extension)
        # On a full disk, closing a small file has been seen to fail without a word.
        if not buffer.write(path) or not oiio.ImageBuf(path).read():
            raise InputError(f"{extension} cannot be written ({buffer.geterror() or f'no room in {folder}?'})")
        return Path(path).read_bytes()


def to_rgbe(image: np.ndarray) -> np.ndarray:
    """(h, w, 3) float32: the nearest values that an HDR file can store, 8 bits each with a common exponent (Ward 1991).

    Encoders cut off the remaining bits, which darkens a picture by half a step on average. From the values of this
    function, they cut off nothing. Negative values and NaN become 0.
    """
    values = np.clip(np.nan_to_num(np.asarray(image, np.float64), nan=0.0), 0.0, LARGEST_RGBE)
    largest = values.max(axis=-1, keepdims=True)
    step = np.exp2(np.frexp(largest)[1] - 8.0)
    step = np.exp2(np.frexp(np.floor(largest / step + 0.5) * step)[1] - 8.0)  # 255.7 rounds to the next exponent
    return (np.floor(values / step + 0.5) * step).astype(np.float32)


def _openimageio(extension: str):
    advice = f'{extension} files need OpenImageIO: pip install "taichi_tracer[exr]", or use .pfm or .npy'
    return import_extra("OpenImageIO", advice)


ENCODERS: dict[str, Callable[[np.ndarray, bool, Display], bytes]] = {
    ".png": encode_png,
    ".jpg": lambda image, srgb, display: _encode_pillow(image, srgb, display, "JPEG"),
    ".jpeg": lambda image, srgb, display: _encode_pillow(image, srgb, display, "JPEG"),
    ".exr": lambda image, srgb, display: _encode_openimageio(image, ".exr"),
    ".hdr": lambda image, srgb, display: _encode_openimageio(to_rgbe(image), ".hdr"),
    ".pfm": lambda image, srgb, display: _encode_pfm(image),
    ".npy": lambda image, srgb, display: _encode_npy(image),
    ".ppm": lambda image, srgb, display: _encode_pillow(image, srgb, display, "PPM"),
}
EIGHT_BITS = (".png", ".jpg", ".jpeg", ".ppm")  # the others are floating point, and always linear
KEEP_NAN = (".exr", ".pfm", ".npy")
NEED_OPENIMAGEIO = (".exr", ".hdr")


def check_writable(path: str | Path, channels: Collection[str] = ()) -> None:
    """Raise an InputError if ``save_image`` could not write there later; ``channels`` are those beside R, G and B."""
    path = Path(path)
    extension = path.suffix.lower()
    if extension not in ENCODERS:
        raise InputError(f"{path}: unknown image type {path.suffix!r}: known are {', '.join(ENCODERS)}")
    if channels and extension != ".exr":
        names = ", ".join(channels)
        raise InputError(f"{path}: a {extension} file has no place for {names}: give a name that ends in .exr")
    if extension in NEED_OPENIMAGEIO:
        _openimageio(extension)
    check_place(path)


def save_image(
    path: str | Path,
    image: np.ndarray,
    srgb: bool | None = None,
    exposure: float = 0.0,
    tone: str | Tone = PLAIN_TONE,
    channels: Mapping[str, np.ndarray] | None = None,
) -> None:
    """Write an image in the format of its extension. An older file is replaced only when the new file is complete.

    Args:
        path: .png .jpg .jpeg .ppm (8 bits), or .exr .hdr .pfm .npy (floating point, always linear).
        image: (h, w, 3) float, top row first; (h, w) and (h, w, 1) are grey, and a fourth channel is ignored. In whole
            numbers without sign, as other programs have them, the largest one means 1: 255 of 8 bits.
        srgb: whether to apply the sRGB transfer function in 8-bit formats: True for radiance, False for data such as
            normals. With None, a ``Picture``, which ``renderer.image()`` returns, knows which it is, and the values of
            any other array are written unchanged.
        exposure, tone: as for ``Display``, for radiance in 8-bit formats. The text of a PNG, and the comment of a JPEG,
            have both. Floating-point formats always get the linear values of ``image``.
        channels: name → (h, w) array of each other channel of an EXR file, such as {"Z": depth}. Their values are
            stored as float32, unchanged.

    Warns:
        UserWarning: there is NaN, which the format does not have: it is written as 0.

    Raises:
        InputError: the extension is unknown, its library is missing, or the file cannot be written; or there are more
            channels, and the format has no place for them.
    """
    check_writable(path, channels or ())
    path, display = Path(path), Display(exposure, tone)
    rgb = _as_float(_as_rgb(np.asarray(image), str(path)))
    extension = path.suffix.lower()
    if extension not in KEEP_NAN and np.isnan(rgb).any():
        count, others = int(np.isnan(rgb).any(axis=2).sum()), ", ".join(KEEP_NAN)
        what = f"{count} of {rgb.shape[0] * rgb.shape[1]} pixels are NaN and written as 0, for {extension} has no NaN"
        warnings.warn(f"{path}: {what}: {others} have", stacklevel=2)
    try:
        if channels:
            rgb = np.dstack([rgb, *(_as_channel(name, array, rgb) for name, array in channels.items())])
            content = _encode_openimageio(rgb, extension, ("R", "G", "B", *channels))
        else:
            content = ENCODERS[extension](rgb, is_light(image, srgb), display)
    except InputError as error:
        raise InputError(f"{path}: {error}") from None
    replace_file(path, content)


def _as_channel(name: str, values: np.ndarray, image: np.ndarray) -> np.ndarray:
    """(h, w) float32 of a channel of an image."""
    values = np.asarray(values)
    if name in ("R", "G", "B"):
        raise InputError(f"channel {name} is a channel of the image itself: give another name")
    if values.shape != image.shape[:2]:
        raise InputError(f"channel {name} must have the shape {image.shape[:2]} of the image, not {values.shape}")
    with np.errstate(over="ignore"):
        return values.astype(np.float32)


def _as_float(image: np.ndarray) -> np.ndarray:
    """The same image in floating point; of whole numbers without sign, the largest becomes 1."""
    if image.dtype.kind == "u":
        return image / np.iinfo(image.dtype).max
    return image.astype(np.float32) if image.dtype.kind in "bi" else image


def _as_rgb(image: np.ndarray, source: str) -> np.ndarray:
    """(h, w, 3) from a grey, RGB or RGBA image."""
    if image.ndim == 2:
        image = image[..., None]
    if image.ndim != 3 or image.shape[2] not in (1, 3, 4) or 0 in image.shape:
        raise InputError(f"{source}: an image must have the shape (height, width, 3), not {image.shape}")
    return np.repeat(image, 3, axis=2) if image.shape[2] == 1 else image[..., :3]


def read_image(path: str | Path, srgb: bool = False) -> np.ndarray:
    """(h, w, 3) float32, top row first.

    Args:
        path: .png .jpg .jpeg .exr .hdr .pfm .npy; grey images become RGB, and a fourth channel is ignored.
        srgb: whether to convert PNG and JPEG files from sRGB to linear values. With False, their values are only
            divided by 255, or by 65535 (16 bits). The result then is a ``Picture`` of linear colour, so that
            ``save_image`` encodes it again.

    Raises:
        InputError: the file is missing, damaged, too large, or of an unknown type.
    """
    path = Path(path)
    extension = path.suffix.lower()
    if extension not in DECODERS:
        raise InputError(f"{path}: unknown image type {path.suffix!r}: known are {', '.join(DECODERS)}")
    raw = read_bytes(path)
    try:
        image = DECODERS[extension](path, raw)
    except InputError as error:
        raise InputError(f"{path}: {error}") from None
    except Exception as error:  # decoders raise all kinds of errors for damaged files
        reason = one_line(error).partition(" <_io.")[0]  # without Python's name of a file
        raise InputError(f"{path}: cannot be read as {extension[1:].upper()} ({reason})") from None
    if image.dtype.kind not in "fiu":
        raise InputError(f"{path}: an image must hold numbers, not {image.dtype}")
    is_decoded = srgb and extension in (".png", ".jpg", ".jpeg")
    rgb = np.ascontiguousarray(_as_rgb(linear_from_srgb(image) if is_decoded else image, str(path)), np.float32)
    return Picture(rgb, srgb=True) if is_decoded else rgb


def read_opacity(path: str | Path) -> np.ndarray:
    """(h, w, 3) float32, top row first: the alpha of a PNG file, if it has one; otherwise the mean of its colours.

    Raises:
        InputError: as for ``read_image``.
    """
    colours = read_image(path)
    if Path(path).suffix.lower() == ".png":
        from PIL import Image

        with Image.open(path, formats=("PNG",)) as image:
            if image.has_transparency_data:
                colours = np.asarray(image.convert("RGBA"), np.float32)[..., 3:] / 255
    return np.repeat(colours.mean(axis=2, keepdims=True), 3, axis=2)


def display_in(path: str | Path) -> str | None:
    """How the values of a PNG or JPEG were changed, as ``save_image`` wrote it into the file; None if they were not."""
    from PIL import Image

    if Path(path).suffix.lower() not in (".png", ".jpg", ".jpeg"):
        return None
    with Image.open(path, formats=("PNG", "JPEG")) as image:
        comment = image.info.get("comment", b"").decode(errors="replace")
        return image.info.get(DISPLAY_KEY) or comment.partition(f"{DISPLAY_KEY}: ")[2] or None


def one_line(error: Exception | str) -> str:
    """The message of a library as one line of limited length; the kind of an error that has none."""
    return " ".join(str(error).split())[:LONGEST_REASON] or type(error).__name__


def _check_size(width: int, height: int) -> None:
    if width < 1 or height < 1 or width * height > MAX_PIXELS:
        raise InputError(f"{width} x {height} pixels: from 1 to {MAX_PIXELS} can be read")


def _decode_pillow(path: Path, raw: bytes) -> np.ndarray:
    from PIL import Image, ImageOps

    with Image.open(io.BytesIO(raw), formats=("PNG", "JPEG")) as opened:
        _check_size(opened.width, opened.height)
        image = ImageOps.exif_transpose(opened)  # cameras write how they were held
        if image.mode.startswith("I"):  # 16-bit grey
            return np.asarray(image).astype(np.float32) / 65535
        if opened.format == "PNG" and raw[24] == 16:  # Pillow would reduce 16-bit colour to 8 bits without a warning
            return _decode_openimageio(path, raw)
        return np.asarray(image.convert("RGB"), np.float32) / 255


def _decode_npy(path: Path, raw: bytes) -> np.ndarray:
    image = np.load(path, mmap_mode="r", allow_pickle=False)  # mapped: a wrong header cannot allocate memory
    if not isinstance(image, np.ndarray):
        raise InputError("this is an archive of arrays: give one array (.npy)")
    return image


def _decode_pfm(path: Path, raw: bytes) -> np.ndarray:
    """Portable float map: "PF" or "Pf", width, height, scale (negative: little endian); the bottom row first."""
    header = PFM_HEADER.match(raw)
    if header is None:
        raise InputError("this is no PFM file: it must begin with PF or Pf, width, height and scale")
    channels = {b"PF": 3, b"Pf": 1}[header[1]]
    width, height = int(header[2]), int(header[3])
    _check_size(width, height)
    count = width * height * channels
    if len(raw) - header.end() < 4 * count:
        raise InputError(f"the file is cut short: {width} x {height} pixels take {4 * count} bytes")
    values = np.frombuffer(raw, "<f4" if float(header[4]) < 0 else ">f4", count, header.end())
    return values.reshape(height, width, channels)[::-1]


def _decode_openimageio(path: Path, raw: bytes) -> np.ndarray:
    """The display window of an image: black outside its data window, whose overscan is cut off."""
    extension = path.suffix.lower()
    oiio = _openimageio("16-bit colour .png" if extension == ".png" else extension)
    settings = oiio.ImageSpec()
    settings.attribute("oiio:UnassociatedAlpha", 1)  # colours as in the file, not multiplied by alpha
    first = oiio.ImageBuf(str(path), 0, 0, settings)
    parts = [first, *(oiio.ImageBuf(str(path), k, 0, settings) for k in range(1, first.nsubimages))]
    if first.has_error:
        raise InputError(f"cannot be read as {extension[1:].upper()} ({one_line(first.geterror().splitlines()[0])})")
    part, channels = _choose_part(parts, path)
    spec = part.spec()
    _check_size(spec.width, spec.height)
    _check_size(spec.full_width, spec.full_height)
    pixels = part.get_pixels(oiio.FLOAT, part.roi_full)
    if part.has_error:
        raise InputError(f"cannot be read ({one_line(part.geterror().splitlines()[0])})")
    pixels = pixels.reshape(spec.full_height, spec.full_width, -1)[..., channels]
    return _by_hdr_header(pixels, raw) if extension == ".hdr" else pixels


def _choose_part(parts: list, path: Path) -> tuple[Any, list[int]]:
    """The first part of a file that has R, G, B, and the numbers of the three channels.

    Without any, it is the first part: its Y, or all its channels. Channels of a layer have its name before a dot.

    Warns:
        UserWarning: there are several parts or layers; it names the one that is read.
    """
    names = [list(part.spec().channelnames) for part in parts]
    layers = [
        (k, one) for k in range(len(parts)) for one in dict.fromkeys(name.rpartition(".")[0] for name in names[k])
    ]
    for k, layer in layers:
        wanted = [f"{layer}.{c}" if layer else c for c in "RGB"]
        if set(wanted) <= set(names[k]):
            break
    else:
        k, layer, wanted = 0, "the first", ["Y"] if "Y" in names[0] else names[0]
    if len(layers) > 1:
        label = ".".join(dict.fromkeys(one for one in (parts[k].spec().getattribute("name"), layer) if one))
        warnings.warn(f"{path}: of {len(layers)} parts and layers, {label or ', '.join(wanted)} is read", stacklevel=5)
    return parts[k], [names[k].index(one) for one in wanted]


def _by_hdr_header(pixels: np.ndarray, raw: bytes) -> np.ndarray:
    """The pixels of a Radiance picture with the top row first, divided by all its exposures (Ward 1991).

    The resolution line names the axis from scanline to scanline, and then the one within a scanline: ``-Y 2 +X 4``
    begins at the top left; ``+X 4 +Y 2`` is made of columns and begins at the bottom left.
    """
    line = HDR_RESOLUTION.search(raw)
    header = raw[: line.start()] if line else b""
    exposure = np.prod([float(value) for value in re.findall(rb"^EXPOSURE\s*=\s*(\S+)", header, re.MULTILINE)])
    if not 0 < exposure < np.inf:
        raise InputError(f"EXPOSURE must be a number above 0, not {exposure:g}")
    axes = line.groups() if line else (b"-Y", b"+X")
    if axes[0].endswith(b"X"):
        pixels = pixels.swapaxes(0, 1)
    return pixels[:: -1 if b"+Y" in axes else 1, :: -1 if b"-X" in axes else 1] / np.float32(exposure)


HDR_RESOLUTION = re.compile(rb"^([-+][XY])\s+\d+\s+([-+][XY])\s+\d+\s*$", re.MULTILINE)
PFM_HEADER = re.compile(rb"(PF|Pf)\s+(\d{1,9})\s+(\d{1,9})\s+([-+]?[\d.]+(?:[eE][-+]?\d+)?)(?:\r\n|\s)")
DECODERS: dict[str, Callable[[Path, bytes], np.ndarray]] = {
    ".png": _decode_pillow,
    ".jpg": _decode_pillow,
    ".jpeg": _decode_pillow,
    ".exr": _decode_openimageio,
    ".hdr": _decode_openimageio,
    ".pfm": _decode_pfm,
    ".npy": _decode_npy,
}


# ── a picture that knows whether its numbers are light ──


# Operations whose result has the meaning of their arguments. A picture times two is a brighter picture. A picture to
# the power of 1/2.2 is something else: somebody encoded it by hand, and it must not be encoded once more.
KEEP_MEANING = {
    *("add", "subtract", "multiply", "divide", "negative", "positive", "absolute"),
    *("minimum", "maximum", "fmin", "fmax", "clip"),
}
JOIN = (np.concatenate, np.where, np.pad)
SMALLEST = 16  # pixels on a side of what a notebook shows as a picture


class Picture(np.ndarray):
    """A numpy array, usually (height, width, 3), that knows which values it has; ``renderer.image()`` returns one.

    It can be used like every other array, and a notebook shows it as a picture. Slices, copies, sums, means and
    multiples of a picture know the same as the picture. The result of any other operation is a plain array, because
    nobody has said what its values mean.

    Args:
        values: the numbers.
        srgb: True if the values are radiance or colour, which are linear: files of 8 bits then get the sRGB transfer
            function. False if they are data such as normals, which are written unchanged (C-14).

    Attributes:
        srgb: as above; None if nobody has said it. Then it is written like a plain array.
    """

    srgb: bool | None = None

    def __new__(cls, values, srgb: bool | None = None) -> "Picture":
        """An array that shares its memory with ``values``, if ``values`` is an array."""
        picture = np.asarray(values).view(cls)
        picture.srgb = srgb
        return picture

    def __array_finalize__(self, origin) -> None:
        self.srgb = getattr(origin, "srgb", None)

    def __array_wrap__(self, array, context=None, return_scalar=False):
        if array.ndim == 0:  # a number; numpy 1 does not ask for it
            return array[()]
        operation, arguments, _ = context or (np.add, (self,), 0)  # of a sum or a mean
        return Picture(array, common_srgb(arguments)) if operation.__name__ in KEEP_MEANING else np.asarray(array)

    def __array_function__(self, function, types, arguments, options):
        result = super().__array_function__(function, types, arguments, options)
        if function in JOIN and isinstance(result, np.ndarray):
            return Picture(result, common_srgb(arguments[0] if function is np.concatenate else arguments))
        return result

    def __reduce__(self):
        return Picture, (np.asarray(self), self.srgb)

    def _repr_png_(self) -> bytes | None:
        """What a notebook shows; a few pixels are shown as numbers."""
        if self.ndim != 3 or self.shape[2] != 3 or min(self.shape[:2]) < SMALLEST:
            return None
        return encode_png(self)


def common_srgb(values) -> bool | None:
    """What all pictures among the values say of themselves; None if they do not agree."""
    said = {value.srgb for value in values if isinstance(value, Picture)}
    return said.pop() if len(said) == 1 else None
