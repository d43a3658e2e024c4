"""Light from infinitely far away: an equirectangular image of radiance, and how to sample it by its brightness."""

import math
import warnings
from pathlib import Path

import numpy as np
import taichi as ti
import taichi.math as tm

from taichi_tracer.files.shipped import shipped_environments
from taichi_tracer.system import runtime
from taichi_tracer.system.errors import InputError, one_of

LOOKUPS = ("nearest", "bilinear")
LUMINANCE = np.array([0.2126, 0.7152, 0.0722])  # of linear sRGB (ITU-R BT.709)


@ti.data_oriented
class Environment:
    """Radiance from every direction (A2-5).

    Args:
        image: (h, w, 3) or (h, w) linear radiance, ≥ 0, top row first; twice as wide as high in the usual case.
        intensity: a factor.
        rotation: degrees about +y.
        lookup: "nearest" texel as in the course, or "bilinear".
        name: for messages.

    Attributes:
        is_black, constant: what the scene's effects are derived from; ``constant`` is the colour that all texels have,
            or None.
        version: counts changes, so that a renderer knows when its samples are of another picture.

    Raises:
        InputError: a shape that is no image; a NaN, infinite or negative texel, named with its place.
    """

    def __init__(
        self,
        image: np.ndarray,
        intensity: float = 1.0,
        rotation: float = 0.0,
        lookup: str = "nearest",
        name: str = "environment",
    ) -> None:
        if lookup not in LOOKUPS:
            raise one_of("lookup", lookup, LOOKUPS)
        runtime.ensure()
        self.name, self.lookup = name, lookup
        self.pixels = checked(image, name)
        self.height, self.width = self.pixels.shape[:2]
        if self.width != 2 * self.height and (self.width, self.height) != (1, 1):
            warnings.warn(
                f"{name}: {self.width}×{self.height} is not twice as wide as high: it is stretched over the sphere",
                stacklevel=2,
            )
        first = self.pixels[0, 0]
        self.constant = tuple(float(c) for c in first) if (self.pixels == first).all() else None
        self.is_black = not self.pixels.any()
        self.version = 0

        self._memory = runtime.Memory()
        builder = self._memory.fields
        self.texels = ti.Vector.field(3, float)
        self.density = ti.field(float)
        self.row_cdf = ti.field(float)
        self.column_cdf = ti.field(float)
        self.settings = ti.field(float)
        texel = builder.dense(ti.ij, (self.height, self.width))
        texel.place(self.texels)
        texel.place(self.density)
        builder.dense(ti.i, self.height + 1).place(self.row_cdf)
        builder.dense(ti.ij, (self.height, self.width + 1)).place(self.column_cdf)
        builder.dense(ti.i, 2).place(self.settings)  # intensity, and rotation as a fraction of a turn
        self._memory.allocate()
        rows, columns, density = sampling_tables(self.pixels, lookup, runtime.dtype())
        self._load(self.pixels, density, rows, columns)
        self.set_intensity(intensity)
        self.set_rotation(rotation)

    def destroy(self) -> None:
        """Free the memory now; the environment cannot be used afterwards."""
        self._memory.free()

    def set_intensity(self, intensity: float) -> None:
        """Multiply all radiance by a finite number of at least 0."""
        self._memory.check("environment")
        if not 0 <= float(intensity) < math.inf:
            raise InputError(f"environment: intensity must be a finite number of at least 0, not {intensity!r}")
        self.intensity = float(intensity)
        self.settings[0] = self.intensity
        self.version += 1

    def set_rotation(self, degrees: float) -> None:
        """Turn the environment about +y."""
        self._memory.check("environment")
        if not math.isfinite(degrees):
            raise InputError(f"environment: rotation must be a finite number of degrees, not {degrees!r}")
        self.rotation = float(degrees)
        self.settings[1] = (self.rotation / 360) % 1.0
        self.version += 1

    @ti.kernel
    def _load(
        self,
        pixels: ti.types.ndarray(ndim=3),
        density: ti.types.ndarray(ndim=2),
        rows: ti.types.ndarray(ndim=1),
        columns: ti.types.ndarray(ndim=2),
    ):
        for row, column in self.texels:
            for k in ti.static(range(3)):
                self.texels[row, column][k] = pixels[row, column, k]
            self.density[row, column] = density[row, column]
        for i in self.row_cdf:
            self.row_cdf[i] = rows[i]
        for row, column in self.column_cdf:
            self.column_cdf[row, column] = columns[row, column]

    @ti.func
    def coords(self, direction):
        """(u, v) in [0, 1] of a unit direction: u around +y, v from the bottom (C-1)."""
        u = 0.5 + azimuth(direction.z, direction.x) / (2 * tm.pi) - self.settings[1]
        v = 0.5 + ti.asin(tm.clamp(direction.y, -1, 1)) / tm.pi
        return u - ti.floor(u), v

    @ti.func
    def texel_of(self, u, v):
        """Row and column of (u, v) in [0, 1]: u wraps, v clamps."""
        column = ti.cast(u * self.width, ti.i32)
        row = ti.cast((1 - v) * self.height, ti.i32)
        return ti.min(row, self.height - 1), ti.select(column < self.width, column, 0)

    @ti.func
    def radiance(self, direction):
        """Radiance arriving from a unit direction."""
        u, v = self.coords(direction)
        value = tm.vec3(0)
        if ti.static(self.lookup == "nearest"):
            row, column = self.texel_of(u, v)
            value = self.texels[row, column]
        else:
            value = self.bilinear(u, v)
        return self.settings[0] * value

    @ti.func
    def bilinear(self, u, v):
        """Between the four nearest texel centres; a + f (b − a) keeps a constant image constant to the last bit."""
        x, y = u * self.width - 0.5, (1 - v) * self.height - 0.5
        column, row = ti.cast(ti.floor(x), ti.i32), ti.cast(ti.floor(y), ti.i32)
        fx, fy = x - ti.floor(x), y - ti.floor(y)
        left, right = (column + self.width) % self.width, (column + 1) % self.width
        top, bottom = tm.clamp(row, 0, self.height - 1), tm.clamp(row + 1, 0, self.height - 1)
        above = self.texels[top, left] + fx * (self.texels[top, right] - self.texels[top, left])
        below = self.texels[bottom, left] + fx * (self.texels[bottom, right] - self.texels[bottom, left])
        return above + fy * (below - above)

    @ti.func
    def constant_radiance(self):
        """``radiance`` where every direction has the same."""
        return self.settings[0] * self.texels[0, 0]

    @ti.func
    def query_ray(self, ray):
        """Radiance arriving along a ray that meets nothing."""
        return self.radiance(ray.direction.normalized())

    @ti.func
    def sample(self, xi):
        """(direction, pdf per solid angle): texels in proportion to their light, uniform on the sphere within one."""
        row, from_row = self.find_row(xi.y)
        column, from_column = self.find_column(row, xi.x)
        u = (column + from_column) / self.width + self.settings[1]
        y_top, y_bottom = self.height_of_edge(row), self.height_of_edge(row + 1)
        y = y_top + from_row * (y_bottom - y_top)
        r = ti.sqrt(ti.max(0.0, 1 - y * y))
        phi = 2 * tm.pi * (u - 0.5)
        return tm.vec3(r * ti.cos(phi), y, r * ti.sin(phi)), self.density[row, column]

    @ti.func
    def pdf(self, direction):
        """The density of ``sample`` at a unit direction, per solid angle."""
        u, v = self.coords(direction)
        row, column = self.texel_of(u, v)
        return self.density[row, column]

    @ti.func
    def height_of_edge(self, row):
        """y of the directions on the upper edge of a row."""
        return ti.cos(tm.pi * row / self.height)

    @ti.func
    def find_row(self, xi):
        """The row whose part of the cumulative distribution holds ξ, and how far into it ξ is, in [0, 1)."""
        low, high = 0, self.height
        while high - low > 1:
            middle = (low + high) >> 1
            if self.row_cdf[middle] <= xi:
                low = middle
            else:
                high = middle
        begin, end = self.row_cdf[low], self.row_cdf[low + 1]
        return low, (xi - begin) / (end - begin)

    @ti.func
    def find_column(self, row, xi):
        """As ``find_row``, for the columns of one row."""
        low, high = 0, self.width
        while high - low > 1:
            middle = (low + high) >> 1
            if self.column_cdf[row, middle] <= xi:
                low = middle
            else:
                high = middle
        begin, end = self.column_cdf[row, low], self.column_cdf[row, low + 1]
        return low, (xi - begin) / (end - begin)


@ti.func
def azimuth(y, x):
    """atan2(y, x): in f32 within 3e-7, at half the time, which every pixel that sees the environment takes.

    The polynomial is Abramowitz & Stegun 4.4.49, for atan on [0, 1], with its terms in pairs.
    """
    angle = ti.cast(0.0, float)
    if ti.static(runtime.current().precision == "f64"):
        angle = ti.atan2(y, x)
    else:
        a, b = abs(x), abs(y)
        high, low = ti.select(a > b, a, b), ti.select(a > b, b, a)
        t = low / ti.select(high > 0, high, 1.0)
        s = t * t
        s2 = s * s
        p01, p23 = 1 - 0.3333314528 * s, 0.1999355085 - 0.1420889944 * s
        p45, p67 = 0.1065626393 - 0.0752896400 * s, 0.0429096138 - 0.0161657367 * s
        angle = t * (p01 + s2 * (p23 + s2 * (p45 + s2 * (p67 + s2 * 0.0028662257))))
        angle = ti.select(b > a, tm.pi / 2 - angle, angle)
        angle = ti.select(x < 0, tm.pi - angle, angle)
        angle = ti.select(y < 0, -angle, angle)
    return angle


def checked(image, name: str) -> np.ndarray:
    """``image`` as a contiguous (h, w, 3) array in the running precision; InputError where it is no radiance."""
    try:
        pixels = np.asarray(image, dtype=np.float64)
    except (TypeError, ValueError):
        raise InputError(f"{name}: an environment is an array of numbers, not {type(image).__name__}") from None
    if pixels.ndim == 2:
        pixels = np.repeat(pixels[..., None], 3, axis=2)
    if pixels.ndim != 3 or pixels.shape[2] != 3 or pixels.size == 0:
        raise InputError(f"{name}: an environment has the shape (height, width, 3), not {np.shape(image)}")
    with np.errstate(over="ignore"):
        pixels = pixels.astype(runtime.dtype())
    for what, wrong in (("is not finite", ~np.isfinite(pixels)), ("is negative", pixels < 0)):
        if wrong.any():
            row, column, channel = np.argwhere(wrong)[0]
            value = np.asarray(image, np.float64).reshape(*pixels.shape[:2], -1)[row, column]
            raise InputError(
                f"{name}: radiance {what} at row {row}, column {column}: {value[channel % len(value)]:g} "
                f"({wrong.any(axis=2).sum()} such texels); replace it by 0 or more"
            )
    return np.ascontiguousarray(pixels)


def sampling_tables(pixels: np.ndarray, lookup: str, dtype: type) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Cumulative distributions of rows (h + 1,) and of columns in each row (h, w + 1), and the density (h, w).

    Built in float64 from luminance × solid angle, then rounded to ``dtype``; the density is that of the rounded tables,
    so that it says exactly how often a texel is taken. A black image is sampled uniformly.
    """
    h, w = pixels.shape[:2]
    brightness = pixels.astype(np.float64) @ LUMINANCE
    # A colour outside the gamut could have brightness 0 and still be light.
    brightness = np.maximum(brightness, pixels.max(axis=2) * 1e-3)
    if lookup == "bilinear":
        brightness = mean_of_bilinear(brightness)
    if not brightness.any():
        brightness = np.ones((h, w))
    edges = np.cos(np.pi * np.arange(h + 1) / h)
    solid_angle = (edges[:-1] - edges[1:]) * 2 * np.pi / w  # of a texel in each row
    power = brightness * solid_angle[:, None]
    rows = _cumulative(power.sum(axis=1)[None])[0].astype(dtype)
    columns = _cumulative(power).astype(dtype)
    probability = np.diff(rows.astype(np.float64))[:, None] * np.diff(columns.astype(np.float64), axis=1)
    return rows, columns, (probability / solid_angle[:, None]).astype(dtype)


def _cumulative(weights: np.ndarray) -> np.ndarray:
    """(n, m) weights → (n, m + 1) from 0 to 1; uniform where a row has none."""
    total = weights.sum(axis=1, keepdims=True)
    weights = np.where(total > 0, weights, 1.0)
    cdf = np.concatenate([np.zeros((len(weights), 1)), np.cumsum(weights, axis=1)], axis=1)
    return cdf / cdf[:, -1:]


def mean_of_bilinear(texels: np.ndarray) -> np.ndarray:
    """What a bilinear look-up gives on average over each texel: positive wherever it is positive anywhere in it."""
    across = (np.roll(texels, 1, axis=1) + 6 * texels + np.roll(texels, -1, axis=1)) / 8
    padded = np.concatenate([across[:1], across, across[-1:]])
    return (padded[:-2] + 6 * across + padded[2:]) / 8


def load_environment(value, **options) -> Environment | None:
    """An environment from a shipped name, the path of an image, an array, an ``Environment``, or None.

    PNG and JPEG are decoded from sRGB; the other formats hold linear values.

    Args:
        options: as for ``Environment``.

    Raises:
        InputError: an unknown name, a file that cannot be used, a radiance that is none.
    """
    if value is None or isinstance(value, Environment):
        return value
    if not isinstance(value, (str, Path)):
        return Environment(value, **options)
    known = shipped_environments()
    path = known.get(str(value), Path(value).expanduser())
    if not path.exists() and path.suffix == "" and path.parent == Path("."):
        raise one_of("environment", str(value), [*known, "or the path of an image"])
    from taichi_tracer.files.images import read_image

    is_encoded = path.suffix.lower() in (".png", ".jpg", ".jpeg")
    return Environment(read_image(path, srgb=is_encoded), **{"name": str(value), **options})
