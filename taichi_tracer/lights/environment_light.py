"""An environment as a light: directions are drawn in proportion to the brightness of its texels.

The density is piecewise constant: a row of texels is found by its part of all light, then a texel by its part of the
row, each by a search in a cumulative distribution (Pharr, Jakob & Humphreys, PBR, 4th edition, section A.4).
"""

import numpy as np
import taichi as ti
import taichi.math as tm

from taichi_tracer.environment import Environment
from taichi_tracer.lights.base import Light
from taichi_tracer.ray import Ray
from taichi_tracer.system import memory, runtime
from taichi_tracer.system.seams import replaced

LUMINANCE = np.array([0.2126, 0.7152, 0.0722])  # of linear sRGB (ITU-R BT.709)
# A colour outside the gamut can have luminance 0 and still be light: a thousandth of its largest component is enough
# for it to be sampled.
LEAST_SHARE = 1e-3


@ti.data_oriented
class EnvironmentLight(Light):
    """Light from infinitely far away.

    Args:
        environment: the image.
        effects: what the scene calls for: "image", "constant" or nothing of it (``effects.Effects.environment``).
    """

    name, is_far = "environment", True

    def __init__(self, environment: Environment, effects) -> None:
        self.environment, self.effects = environment, effects
        self.replaced = replaced(environment)
        self._memory = None

    def prepare(self) -> None:
        """Build the tables of ``sample``."""
        if self._memory is not None:
            return
        of = self.environment
        self._memory = memory.Memory()
        self.density, self.row_cdf, self.column_cdf = ti.field(float), ti.field(float), ti.field(float)
        fields = self._memory.fields
        fields.dense(ti.ij, (of.height, of.width)).place(self.density)
        fields.dense(ti.i, of.height + 1).place(self.row_cdf)
        fields.dense(ti.ij, (of.height, of.width + 1)).place(self.column_cdf)
        self._memory.allocate()
        rows, columns, density = sampling_tables(of.pixels, of.lookup, runtime.dtype())
        self._load(density, rows, columns)

    @ti.kernel
    def _load(
        self,
        density: ti.types.ndarray(ndim=2),
        rows: ti.types.ndarray(ndim=1),
        columns: ti.types.ndarray(ndim=2),
    ):
        for row, column in self.density:
            self.density[row, column] = density[row, column]
        for i in self.row_cdf:
            self.row_cdf[i] = rows[i]
        for row, column in self.column_cdf:
            self.column_cdf[row, column] = columns[row, column]

    @ti.func
    def radiance(self, ray, hit):
        """What a ray that meets nothing sees: a look-up in the image, or the one colour that all of it has."""
        light = tm.vec3(0)
        if not hit.is_hit:
            light = self.along(ray)
        return light

    @ti.func
    def along(self, ray):
        """Radiance from where a ray with a direction of unit length goes."""
        light = tm.vec3(0)
        if ti.static("query_ray" in self.replaced):
            light = self.environment.query_ray(ray)
        elif ti.static(self.effects.environment == "image"):
            light = self.environment.radiance(ray.direction)
        elif ti.static(self.effects.environment == "constant"):
            light = self.environment.constant_radiance()
        return light

    @ti.func
    def sample(self, x, xi):
        """(w_i, ∞, radiance, pdf): see ``sample_direction``."""
        w_i, pdf = self.sample_direction(xi)
        return w_i, tm.inf, self.along(Ray(origin=x, direction=w_i)), pdf

    @ti.func
    def pdf(self, x, w_i, hit):
        """The density of ``sample_direction`` at w_i."""
        u, v = self.environment.coords(w_i)
        row, column = self.environment.texel_of(u, v)
        return self.density[row, column]

    @ti.func
    def sample_direction(self, xi):
        """(direction, pdf per solid angle): texels in proportion to their light, uniform on the sphere within one."""
        row, from_row = self.find_row(xi.y)
        column, from_column = self.find_column(row, xi.x)
        u = (column + from_column) / self.environment.width + self.environment.settings[1]
        y_top, y_bottom = self.height_of_edge(row), self.height_of_edge(row + 1)
        y = y_top + from_row * (y_bottom - y_top)
        r = ti.sqrt(ti.max(0.0, 1 - y * y))
        phi = 2 * tm.pi * (u - 0.5)
        return tm.vec3(r * ti.cos(phi), y, r * ti.sin(phi)), self.density[row, column]

    @ti.func
    def height_of_edge(self, row):
        """y of the directions on the upper edge of a row."""
        return ti.cos(tm.pi * row / self.environment.height)

    @ti.func
    def find_row(self, xi):
        """The row whose part of the cumulative distribution holds ξ, and how far into it ξ is, in [0, 1)."""
        low, high = 0, self.environment.height
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
        low, high = 0, self.environment.width
        while high - low > 1:
            middle = (low + high) >> 1
            if self.column_cdf[row, middle] <= xi:
                low = middle
            else:
                high = middle
        begin, end = self.column_cdf[row, low], self.column_cdf[row, low + 1]
        return low, (xi - begin) / (end - begin)


def sampling_tables(pixels: np.ndarray, lookup: str, dtype: type) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Cumulative distributions of rows (h + 1,) and of columns in each row (h, w + 1), and the density (h, w).

    Built in float64 from luminance × solid angle, then rounded to ``dtype``; the density is that of the rounded tables,
    so that it says exactly how often a texel is taken. A black image is sampled uniformly.
    """
    h, w = pixels.shape[:2]
    brightness = pixels.astype(np.float64) @ LUMINANCE
    brightness = np.maximum(brightness, pixels.max(axis=2) * LEAST_SHARE)
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
