"""Images in and out: linear floating point, (height, width, 3), top row first (C-15).

PNG and JPEG go through Pillow, EXR and HDR through OpenImageIO (the extra ``exr``: one library that reads and writes both
right), PFM and PPM and NPY are plain enough to be written here.
"""

import io
import os
import tempfile
from collections.abc import Callable
from pathlib import Path

import numpy as np

from taichi_tracer.errors import InputError
from taichi_tracer.files.text import read_bytes

MAX_PIXELS = 1 << 28  # 16384², more than any environment or film needs: a larger header is damage or an attack


def to_bytes(image: np.ndarray, srgb: bool = False) -> np.ndarray:
    """(h, w, 3) uint8: values clipped to [0, 1] and rounded to the nearest of 255 steps; NaN becomes 0.

    Args:
        image: (h, w, 3) float, linear.
        srgb: apply the sRGB transfer function first, for radiance; data such as normals is written as it is (C-14).
    """
    values = np.clip(np.nan_to_num(np.asarray(image, np.float64), nan=0.0, posinf=1.0, neginf=0.0), 0.0, 1.0)
    if srgb:
        values = srgb_from_linear(values)
    return np.floor(values * 255 + 0.5).astype(np.uint8)


def srgb_from_linear(values: np.ndarray) -> np.ndarray:
    """The sRGB transfer function (IEC 61966-2-1) of values in [0, 1]."""
    return np.where(values <= 0.0031308, 12.92 * values, 1.055 * np.maximum(values, 0.0031308) ** (1 / 2.4) - 0.055)


def linear_from_srgb(values: np.ndarray) -> np.ndarray:
    """The inverse of ``srgb_from_linear``."""
    return np.where(values <= 0.04045, values / 12.92, ((np.maximum(values, 0.04045) + 0.055) / 1.055) ** 2.4)


def encode_png(image: np.ndarray, srgb: bool = False) -> bytes:
    """The bytes of a PNG file."""
    return _encode_pillow(image, srgb, "PNG")


def _encode_pillow(image: np.ndarray, srgb: bool, kind: str) -> bytes:
    from PIL import Image

    buffer = io.BytesIO()
    options = {"quality": 95, "subsampling": 0} if kind == "JPEG" else {}
    Image.fromarray(to_bytes(image, srgb)).save(buffer, kind, **options)
    return buffer.getvalue()


def _encode_ppm(image: np.ndarray, srgb: bool) -> bytes:
    height, width, _ = image.shape
    return b"P6\n%d %d\n255\n" % (width, height) + to_bytes(image, srgb).tobytes()


def _encode_pfm(image: np.ndarray, srgb: bool) -> bytes:
    height, width, _ = image.shape
    rows_from_bottom = np.ascontiguousarray(np.asarray(image, "<f4")[::-1])
    return b"PF\n%d %d\n-1.0\n" % (width, height) + rows_from_bottom.tobytes()


def _encode_npy(image: np.ndarray, srgb: bool) -> bytes:
    buffer = io.BytesIO()
    np.save(buffer, np.asarray(image, np.float32))
    return buffer.getvalue()


def _encode_openimageio(extension: str) -> Callable:
    def encode(image: np.ndarray, srgb: bool) -> bytes:
        oiio = _openimageio(extension)
        height, width, _ = image.shape
        with tempfile.TemporaryDirectory() as folder:
            path = os.path.join(folder, "image" + extension)
            output = oiio.ImageOutput.create(path)
            pixels = np.ascontiguousarray(image, np.float32)
            written = (
                output is not None
                and output.open(path, oiio.ImageSpec(width, height, 3, "float"))
                and output.write_image(pixels)
                and output.close()
            )
            if not written:
                raise InputError(f"{extension} cannot be written ({oiio.geterror()})")
            return Path(path).read_bytes()

    return encode


def _openimageio(extension: str):
    try:
        import OpenImageIO
    except ImportError:
        raise InputError(
            f'{extension} files need OpenImageIO: pip install "taichi_tracer[exr]", or use .pfm or .npy'
        ) from None
    return OpenImageIO


ENCODERS: dict[str, Callable[[np.ndarray, bool], bytes]] = {
    ".png": encode_png,
    ".jpg": lambda image, srgb: _encode_pillow(image, srgb, "JPEG"),
    ".jpeg": lambda image, srgb: _encode_pillow(image, srgb, "JPEG"),
    ".exr": _encode_openimageio(".exr"),
    ".hdr": _encode_openimageio(".hdr"),
    ".pfm": _encode_pfm,
    ".npy": _encode_npy,
    ".ppm": _encode_ppm,
}
NEED_OPENIMAGEIO = (".exr", ".hdr")


def check_writable(path: str | Path) -> None:
    """Raise an InputError now if ``save_image`` could not write there later."""
    path = Path(path)
    extension = path.suffix.lower()
    if extension not in ENCODERS:
        raise InputError(f"{path}: unknown image type {path.suffix!r}: known are {', '.join(ENCODERS)}")
    if extension in NEED_OPENIMAGEIO:
        _openimageio(extension)
    if path.is_dir():
        raise InputError(f"{path}: this is a folder: give a file name in it")
    folder = path.parent
    if not folder.is_dir():
        raise InputError(f"{path}: the folder {folder} does not exist")
    if not os.access(folder, os.W_OK) or (path.exists() and not os.access(path, os.W_OK)):
        raise InputError(f"{path}: no permission to write there")


def save_image(path: str | Path, image: np.ndarray, srgb: bool = False) -> None:
    """Write an image; the extension says how. An older file is replaced only when the new one is complete.

    Args:
        path: .png .jpg .jpeg .ppm (8 bits), or .exr .hdr .pfm .npy (floating point, always linear).
        image: (h, w, 3) float, top row first; (h, w) and (h, w, 1) are grey, a fourth channel is left out.
        srgb: for 8 bits, apply the sRGB transfer function (radiance); data such as normals is written as it is.

    Raises:
        InputError: the extension is unknown, its library is missing, or the place cannot be written.
    """
    path = Path(path)
    check_writable(path)
    content = ENCODERS[path.suffix.lower()](_as_rgb(np.asarray(image), str(path)), srgb)
    part = None
    try:
        handle, part = tempfile.mkstemp(dir=path.parent, prefix=".", suffix=".part")
        with os.fdopen(handle, "wb") as file:
            file.write(content)
        umask = os.umask(0)
        os.umask(umask)
        os.chmod(part, 0o666 & ~umask)  # mkstemp makes private files
        os.replace(part, path)
    except OSError as error:
        if part is not None:
            Path(part).unlink(missing_ok=True)
        raise InputError(f"{path}: cannot be written ({error.strerror})") from None


def _as_rgb(image: np.ndarray, source: str) -> np.ndarray:
    """(h, w, 3) of grey, RGB or RGBA."""
    if image.ndim == 2:
        image = image[..., None]
    if image.ndim != 3 or image.shape[2] not in (1, 3, 4) or 0 in image.shape:
        raise InputError(f"{source}: an image must have the shape (height, width, 3), not {image.shape}")
    return np.repeat(image, 3, axis=2) if image.shape[2] == 1 else image[..., :3]


def read_image(path: str | Path, srgb: bool = False) -> np.ndarray:
    """(h, w, 3) float32, top row first.

    Args:
        path: .png .jpg .jpeg .ppm .exr .hdr .pfm .npy.
        srgb: 8- and 16-bit files hold sRGB values: make them linear. Without it they are divided by 255 or 65535.

    Raises:
        InputError: the file is missing, damaged, too large, or of an unknown type.
    """
    path = Path(path)
    extension = path.suffix.lower()
    if extension not in ENCODERS:
        raise InputError(f"{path}: unknown image type {path.suffix!r}: known are {', '.join(ENCODERS)}")
    raw = read_bytes(path)
    try:
        if extension == ".npy":
            image = np.load(io.BytesIO(raw), allow_pickle=False)
        elif extension == ".pfm":
            image = _decode_pfm(raw)
        elif extension in NEED_OPENIMAGEIO:
            image = _decode_openimageio(path, extension)
        else:
            image = _decode_pillow(raw)
            image = linear_from_srgb(image) if srgb else image
    except InputError as error:
        raise InputError(f"{path}: {error}") from None
    except Exception as error:  # damaged files make decoders raise anything
        reason = " ".join(str(error).split()) or type(error).__name__
        raise InputError(f"{path}: cannot be read as {extension[1:].upper()} ({reason[:200]})") from None
    if image.dtype.kind not in "fiu":
        raise InputError(f"{path}: an image must hold numbers, not {image.dtype}")
    return np.ascontiguousarray(_as_rgb(image, str(path)), np.float32)


def _decode_pillow(raw: bytes) -> np.ndarray:
    from PIL import Image

    with Image.open(io.BytesIO(raw)) as image:
        if image.width * image.height > MAX_PIXELS:
            raise InputError(f"{image.width}x{image.height} pixels are too many")
        if image.mode.startswith("I"):  # 16-bit grey
            return np.asarray(image, np.float64) / 65535
        if raw[:4] == b"\x89PNG" and raw[24] == 16:  # Pillow would cut 16-bit colour to 8 bits without a word
            raise InputError("16-bit colour PNG is not supported: convert it to .exr, .hdr or .pfm")
        return np.asarray(image.convert("RGB"), np.float64) / 255


def _decode_pfm(raw: bytes) -> np.ndarray:
    """Portable float map: "PF" or "Pf", width height, scale (negative: little endian), rows from the bottom."""
    kind, size, scale = raw.split(b"\n", 3)[:3]
    channels = {b"PF": 3, b"Pf": 1}[kind.strip()]
    width, height = (int(word) for word in size.split())
    if width < 1 or height < 1 or width * height > MAX_PIXELS:
        raise InputError(f"{width}x{height} pixels are not a possible size")
    start = len(kind) + len(size) + len(scale) + 3
    values = np.frombuffer(raw, "<f4" if float(scale) < 0 else ">f4", width * height * channels, start)
    return values.reshape(height, width, channels)[::-1]


def _decode_openimageio(path: Path, extension: str) -> np.ndarray:
    oiio = _openimageio(extension)
    file = oiio.ImageInput.open(str(path))
    if file is None:
        raise InputError(f"cannot be read as {extension[1:].upper()} ({oiio.geterror()})")
    spec = file.spec()
    if spec.width * spec.height > MAX_PIXELS:
        raise InputError(f"{spec.width}x{spec.height} pixels are too many")
    pixels = file.read_image("float")
    if pixels is None:
        raise InputError(f"cannot be read as {extension[1:].upper()} ({file.geterror()})")
    return np.asarray(pixels)
