"""What surrounds a scene: an equirectangular image of radiance (A2-5), and the picture behind everything (RT-7).

An ``Environment`` is light from all sides; ``lights.environment_light`` samples it. A ``Background`` belongs to the
picture and not to the world: one colour, four corners, or an image over the whole frame. It is looked up by pixel, at
the pixel centres of the full frame, and it does not light the scene.
"""

import math
import warnings
from pathlib import Path
from typing import Any

import numpy as np
import taichi as ti
from numpy.typing import ArrayLike

from taichi_tracer.files.disk import shipped_environments
from taichi_tracer.formulas import vector_math as tm
from taichi_tracer.formulas.angles import azimuth, latitude
from taichi_tracer.system import memory, runtime
from taichi_tracer.system.compile_time import element, inside_kernel
from taichi_tracer.system.course_fields import held
from taichi_tracer.system.errors import InputError, one_of
from taichi_tracer.system.parts import PARTS, KnownAttributes, overridable

# ── light from far away ──


LOOKUPS = ("nearest", "bilinear")


@ti.data_oriented
@overridable("query_ray", "radiance", "coords", "texel_of", "bilinear")
class Environment(KnownAttributes):
    """Radiance from every direction (A2-5), in a frame in which y is up.

    In a scene with ``up_axis="z"``, ``lights.environment_light`` turns every direction into this frame.

    Args:
        image: (h, w, 3) or (h, w) linear radiance, ≥ 0, top row first; usually twice as wide as high.
        intensity: a factor by which all radiance is multiplied.
        rotation: degrees about the axis that is up.
        lookup: "nearest" takes the nearest texel, as in the course; "bilinear" interpolates.
        name: the name of the environment in messages; "" for the attribute of the class.

    Attributes:
        is_black: whether all texels are 0. constant: the colour that all texels have, or None. The scene's effects are
            derived from these two.
        version: counts changes, so that a renderer knows when its samples belong to an older picture.

    Raises:
        InputError: the shape is not that of an image, or a texel is NaN, infinite or negative; the message names its
            row and column.
    """

    kind = "environment"
    name: str = ""

    def __init__(
        self,
        image: "ArrayLike",
        intensity: float = 1.0,
        rotation: float = 0.0,
        lookup: str = "nearest",
        name: str = "",
    ) -> None:
        if lookup not in LOOKUPS:
            raise one_of("lookup", lookup, LOOKUPS)
        runtime.ensure()
        self.name = name = name or self.name or "environment"
        self.lookup = lookup
        self.pixels = checked(image, name)
        self.height, self.width = map(memory.varying, self.pixels.shape[:2])
        if self.width != 2 * self.height and (self.width, self.height) != (1, 1):
            warnings.warn(
                f"{name}: {self.width}×{self.height} is not twice as wide as high, so it is stretched over the sphere",
                stacklevel=2,
            )
        first = self.pixels[0, 0]
        self.constant = tuple(float(c) for c in first) if (self.pixels == first).all() else None
        self.is_black = not self.pixels.any()
        self.version = 0

        # The settings are the intensity, and the rotation as a fraction of a full turn.
        self._memory, (self.texels, self.settings) = memory.filled(self.pixels, np.zeros((1, 2)), indices=2)
        self._intensity, self.rotation = 1.0, 0.0
        self.set_intensity(intensity)
        self.set_rotation(rotation)

    def destroy(self) -> None:
        """Free the memory now; the environment cannot be used afterwards."""
        self._memory.free()

    def set_intensity(self, intensity: float) -> None:
        """Multiply all radiance by a finite number that is at least 0."""
        self._memory.check("environment")
        check_intensity(intensity)
        self._intensity = float(intensity)
        self._write()

    @property
    def intensity(self) -> float:
        """The factor by which all radiance is multiplied; ``intensity[None]`` may be assigned, as in the course."""
        return held(element(self.settings, 0, 0) if inside_kernel() else self._intensity, self.set_intensity)

    def set_rotation(self, degrees: float) -> None:
        """Turn the environment about the axis that is up."""
        self._memory.check("environment")
        if not math.isfinite(degrees):
            raise InputError(f"environment: rotation must be a finite number of degrees, not {degrees!r}")
        self.rotation = float(degrees)
        self._write()

    def _write(self) -> None:
        self._memory.write(self.settings, [[self._intensity, (self.rotation / 360) % 1.0]])
        self.version += 1

    # ── names of the course ──

    @property
    def x_resolution(self) -> int:
        """The width of the image in texels."""
        return self.width

    @property
    def y_resolution(self) -> int:
        """The height of the image in texels."""
        return self.height

    @property
    def image(self) -> Any:
        """The radiance of the texel [x, y], with y up: (w, h, 3); also in kernels."""
        return TexelsFromBelow(self) if inside_kernel() else self.pixels[::-1].transpose(1, 0, 2)

    def precompute_envmap(self) -> None:
        """Nothing is left to do: the tables that samples of the environment need are made where they are first used."""

    @ti.func
    def coords(self, direction):
        """(u, v) in [0, 1] of a unit direction: u around +y, v from the bottom (C-1)."""
        u = 0.5 + azimuth(direction.z, direction.x) / (2 * tm.pi) - self.settings[0, 1]
        v = 0.5 + latitude(direction.y) / tm.pi  # with one rounding, as on CUDA, −1e-17 at a pole
        return u - ti.floor(u), ti.max(v, 0.0)

    @ti.func
    def texel_of(self, u, v):
        """Row and column of (u, v) in [0, 1]. u wraps around, and v is clamped."""
        column = ti.cast(u * self.width, ti.i32)
        row = ti.cast((1 - v) * self.height, ti.i32)
        return ti.min(row, self.height - 1), ti.select(column < self.width, column, 0)

    @ti.func
    def radiance(self, direction):
        """The radiance that arrives from a unit direction."""
        u, v = self.coords(direction)
        if ti.static(self.lookup == "bilinear"):
            return self.settings[0, 0] * self.bilinear(u, v)
        row, column = self.texel_of(u, v)
        return self.settings[0, 0] * self.texels[row, column]

    @ti.func
    def bilinear(self, u, v):
        """Interpolation of the four nearest texel centres; a + f (b − a) leaves a constant image exactly constant."""
        x, y = u * self.width - 0.5, (1 - v) * self.height - 0.5
        column, row = ti.cast(ti.floor(x), ti.i32), ti.cast(ti.floor(y), ti.i32)
        fx, fy = x - ti.floor(x), y - ti.floor(y)
        left, right = (column + self.width) % self.width, (column + 1) % self.width
        top, bottom = tm.clamp(row, 0, self.height - 1), tm.clamp(row + 1, 0, self.height - 1)
        above = self.texels[top, left] + fx * (self.texels[top, right] - self.texels[top, left])
        below = self.texels[bottom, left] + fx * (self.texels[bottom, right] - self.texels[bottom, left])
        return above + fy * (below - above)

    @ti.func
    def query_ray(self, ray):
        """The radiance that arrives along a ray that hits nothing (A2-5)."""
        return self.radiance(tm.normalize(ray.direction))


class TexelsFromBelow:
    """The texels of an environment in a kernel, by x from the left and y from below."""

    def __init__(self, environment: Environment) -> None:
        self.environment = environment

    def __getitem__(self, place: tuple[Any, Any]) -> Any:
        return element(self.environment.texels, self.environment.height - 1 - place[1], place[0])


def checked(image, name: str, what: str = "an environment", value: str = "radiance") -> np.ndarray:
    """``image``, (h, w, 3) or (h, w), as a contiguous (h, w, 3) array in the running precision.

    Args:
        name, what, value: for messages: its name, what it is, and what its numbers are.

    Raises:
        InputError: it has another shape, or a number that is negative or not finite.
    """
    try:
        is_ready = isinstance(image, np.ndarray) and image.dtype == runtime.dtype()
        pixels = image if is_ready else np.asarray(image, dtype=np.float64)
    except (TypeError, ValueError):
        raise InputError(f"{name}: {what} is an array of numbers, not {type(image).__name__}") from None
    if pixels.ndim == 2:
        pixels = np.repeat(pixels[..., None], 3, axis=2)
    if pixels.ndim != 3 or pixels.shape[2] != 3 or pixels.size == 0:
        raise InputError(f"{name}: {what} has the shape (height, width, 3), not {np.shape(image)}")
    with np.errstate(over="ignore"):
        pixels = pixels.astype(runtime.dtype())
    for fault, wrong in (("is not finite", ~np.isfinite(pixels)), ("is negative", pixels < 0)):
        if wrong.any():
            row, column, channel = np.argwhere(wrong)[0]
            texel = np.asarray(image, np.float64).reshape(*pixels.shape[:2], -1)[row, column]
            raise InputError(
                f"{name}: {value} {fault} at row {row}, column {column}: {texel[channel % len(texel)]:g} "
                f"({wrong.any(axis=2).sum()} such texels); replace it by 0 or more"
            )
    return np.ascontiguousarray(pixels)


def check_intensity(intensity: float) -> None:
    """Raise an InputError unless all radiance can be multiplied by this number."""
    if not isinstance(intensity, int | float | np.number) or not 0 <= float(intensity) < math.inf:
        raise InputError(f"environment: intensity must be a finite number of at least 0, not {intensity!r}")


def load_environment(value: "ArrayLike | Path | Environment | None", **options: Any) -> Environment | None:
    """An environment from a shipped or registered name, the path of an image, an array, an ``Environment``, or None.

    PNG and JPEG files are decoded from sRGB; files of the other formats hold linear values.

    Args:
        options: the other arguments of ``Environment``.

    Raises:
        InputError: the name is unknown, the file cannot be used, or the values are not radiance.
    """
    if value is None or isinstance(value, Environment):
        return value
    if isinstance(value, type) and issubclass(value, Environment):
        return value(**options)
    if not isinstance(value, (str, Path)):
        return Environment(value, **options)
    registered = {part.name: part for part in PARTS.all("environment")}
    if str(value) in registered:
        return registered[str(value)](**options)
    known = shipped_environments()
    path = known.get(str(value), Path(value).expanduser())
    if not path.exists() and path.suffix == "" and path.parent == Path("."):
        raise one_of("environment", str(value), [*known, *registered, "or the path of an image"])
    return Environment(read_linear(path), **{"name": str(value), **options})


def read_linear(path: Path) -> np.ndarray:
    """(h, w, 3) linear values of an image: PNG and JPEG are decoded from sRGB."""
    from taichi_tracer.files.images import read_image

    return read_image(path, srgb=path.suffix.lower() in (".png", ".jpg", ".jpeg"))


# ── the picture behind the scene ──


CORNERS = ("bl", "tl", "tr", "br")  # bottom left, top left, top right, bottom right: the order in the scene files


@ti.data_oriented
class Background:
    """Texels that are stretched over the frame and interpolated bilinearly between their centres.

    Args:
        texels: (rows, columns, 3) or (rows, columns) linear colours, top row first. (1, 1, 3) is one colour. (2, 2, 3)
            are four corners if ``corners`` is True, otherwise an image.
        corners: whether the outermost texels lie on the border of the frame, instead of half a texel inside it.
        what: the name of the background in messages.

    Raises:
        InputError: the shape is not that of an image, or a colour is negative or not finite; the message names its
            row and column.
    """

    def __init__(self, texels: "ArrayLike", corners: bool = False, what: str = "background") -> None:
        runtime.ensure()
        self.what, self.corners = what, corners
        self.pixels = checked(texels, what, "a background", "a colour")
        self.rows, self.columns = map(memory.varying, self.pixels.shape[:2])
        self._memory, (self.texels,) = memory.filled(self.pixels, indices=2)

    @ti.func
    def between(self, pixel, pixels, texels: ti.template()):
        """(first texel, second texel, fraction of the way to the second) for the centre of a pixel, along one axis.

        The place is a quotient of two whole numbers, so that an image of the frame's size is shown texel by texel.
        """
        twice = 2 * ti.cast(pixel, ti.i64) + 1  # divided by 2·pixels, this is the place of the centre in the frame
        place = twice * (texels - 1)
        if ti.static(not self.corners):
            place = ti.max(twice * texels - pixels, 0)
        first = ti.cast(place // (2 * pixels), ti.i32)
        rest = ti.cast(place - ti.cast(first, ti.i64) * (2 * pixels), float) / (2 * pixels)
        second = ti.min(first + 1, texels - 1)
        return ti.min(first, texels - 1), second, rest

    @ti.func
    def color(self, x, y, width, height):
        """The colour behind pixel (x, y), counted from the bottom left; a + f (b − a) keeps equal colours exact."""
        left, right, fx = self.between(x, width, self.columns)
        top, bottom, fy = self.between(height - 1 - y, height, self.rows)
        above = self.texels[top, left] + fx * (self.texels[top, right] - self.texels[top, left])
        below = self.texels[bottom, left] + fx * (self.texels[bottom, right] - self.texels[bottom, left])
        return above + fy * (below - above)


def load_background(value: "ArrayLike | Path | Background | None") -> Background | None:
    """A background from one colour, four colours (``CORNERS``), an image, a path, a ``Background``, or None.

    PNG and JPEG files are decoded from sRGB; files of the other formats hold linear values.

    Raises:
        InputError: the file cannot be used, or the values are not colours.
    """
    if value is None or isinstance(value, Background):
        return value
    if isinstance(value, (str, Path)):
        path = Path(value).expanduser()
        return Background(read_linear(path), what=str(path))
    if np.shape(value) == (3,):
        return Background(np.reshape(value, (1, 1, 3)), what="one colour")
    if np.shape(value) == (4, 3):
        bl, tl, tr, br = np.asarray(value)
        return Background([[tl, tr], [bl, br]], corners=True, what="four corners")
    return Background(value)
