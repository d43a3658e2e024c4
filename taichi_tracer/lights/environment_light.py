"""An environment as a light: directions are drawn in proportion to the brightness of its texels.

The density is piecewise constant. First a row of texels is chosen in proportion to its light, then a texel in this row.
Both are found in a cumulative distribution: in [F_i, F_i+1), ξ selects the texel i (Pharr, Jakob & Humphreys, PBR,
4th edition, section A.4). A *guide table* says for each of n equal parts of [0, 1) where the search begins, so that it
takes one or two steps on average, however large the image is (Chen & Asau, "On generating random variates from an
empirical distribution", AIIE Transactions 6, 1974).

**Compensation.** Where a sample of the BRDF goes with each sample of the light, and both are weighted by a heuristic of
their densities, the BRDF alone finds the even part of the light well. What it finds badly are the sun and other bright
places. Therefore the light's samples do not follow L, but max(0, L − mean of L): a sky with a sun is then sampled only
where the sun is (Karlík, Šik, Vévoda, Skřivan & Křivánek, "MIS compensation: optimizing sampling techniques in multiple
importance sampling", ACM TOG 38(6), 2019, section 5). No light is lost as long as the BRDF reaches every direction in
which it reflects: there, where the light's density is 0, the weight of the BRDF's sample is 1.
"""

import numpy as np
import taichi as ti

from taichi_tracer.environment import Environment
from taichi_tracer.formulas import vector_math as tm
from taichi_tracer.formulas.angles import on_circle
from taichi_tracer.formulas.luminance import luminance
from taichi_tracer.lights.base import Light
from taichi_tracer.ray import Ray, no_hit
from taichi_tracer.system import runtime
from taichi_tracer.system.memory import filled
from taichi_tracer.system.parts import overridable, replaced

EVEN = 1e-3  # an environment is even if less than this share of its light is above the mean


@ti.data_oriented
@overridable("sample_direction", "pdf")
class EnvironmentLight(Light):
    """Light from infinitely far away.

    Args:
        environment: the image.
        effects: an ``effects.Effects``; its ``environment`` says whether there is a look-up ("image"), one radiance for
            all directions ("constant"), or no light.
        up_axis: the axis of the scene in whose direction the zenith is, "y" or "z". The formulas of ``Environment`` and
            of the samples have y up: if z is up, directions are turned about the x axis on their way in and out.
        compensates: whether directions are drawn in proportion to max(0, L − mean of L) instead of L.
    """

    name, is_far = "environment", True

    def __init__(self, environment: Environment, effects, up_axis: str = "y", compensates: bool = False) -> None:
        self.environment, self.effects, self.up_axis = environment, effects, up_axis
        self.compensates = compensates
        self.replaced = replaced(environment)

    def prepare(self) -> None:
        """Build the tables that ``sample`` reads."""
        of = self.environment
        rows, columns, density = sampling_tables(of.pixels, of.lookup, runtime.dtype(), self.compensates)
        edges = np.cos(np.pi * np.arange(of.height + 1) / of.height)  # y of the directions on the edges of the rows
        guides = guide_table(rows[None]), guide_table(columns)
        self._memory, fields = filled(density, rows[None], columns, *guides, edges[None], indices=2)
        self.density, self.row_cdf, self.column_cdf, self.row_guide, self.column_guide, self.height_of_edge = fields

    @ti.func
    def radiance(self, ray, hit):
        """Radiance of the environment along a ray that hits nothing; its direction has unit length."""
        direction = self.with_y_up(ray.direction)
        if ti.static("query_ray" in self.replaced):
            return self.environment.query_ray(Ray(origin=self.with_y_up(ray.origin), direction=direction))
        if ti.static(self.effects.environment == "image"):
            return self.environment.radiance(direction)
        if ti.static(self.effects.environment == "constant"):
            return self.environment.settings[0, 0] * self.environment.texels[0, 0]
        return tm.vec3(0)

    @ti.func
    def sample(self, x, xi):
        """(w_i, ∞, radiance, pdf): see ``sample_direction``."""
        w_i, pdf = self.sample_direction(xi)
        return w_i, tm.inf, self.radiance(Ray(origin=x, direction=w_i), no_hit()), pdf

    @ti.func
    def pdf(self, x, w_i, hit):
        """The density of ``sample_direction`` at w_i."""
        u, v = self.environment.coords(self.with_y_up(w_i))
        row, column = self.environment.texel_of(u, v)
        return self.density[row, column]

    @ti.func
    def sample_direction(self, xi):
        """(direction, pdf per solid angle): a texel in proportion to its light, uniform in solid angle within it.

        If the light ``compensates``, this is its light above the mean.
        """
        row, column, u, y = self.find_texel(xi)
        r = ti.sqrt(ti.max(0.0, 1 - y * y))
        x, z = on_circle(u - 0.5)
        return self.as_in_scene(tm.vec3(r * x, y, r * z)), self.density[row, column]

    @ti.func
    def find_texel(self, xi):
        """(row, column, u, y): a texel, and a place in it, as the u of ``Environment.coords`` and a height."""
        row, from_row = find(self.row_cdf, self.row_guide, 0, self.environment.height, xi.y)
        column, from_column = find(self.column_cdf, self.column_guide, row, self.environment.width, xi.x)
        u = (column + from_column) / self.environment.width + self.environment.settings[0, 1]
        y_top, y_bottom = self.height_of_edge[0, row], self.height_of_edge[0, row + 1]
        return row, column, u, y_top + from_row * (y_bottom - y_top)

    @ti.func
    def with_y_up(self, v):
        """A vector of the scene in the frame of the environment, where y is up: (x, z, −y) if z is up in the scene."""
        if ti.static(self.up_axis == "z"):
            return tm.vec3(v.x, v.z, -v.y)
        return v

    @ti.func
    def as_in_scene(self, v):
        """The inverse of ``with_y_up``."""
        if ti.static(self.up_axis == "z"):
            return tm.vec3(v.x, -v.z, v.y)
        return v


@ti.func
def find(cdf: ti.template(), guide: ti.template(), row, count, xi):
    """(i, the place of ξ in its interval, in [0, 1)): the interval of a row of distributions that contains ξ."""
    i = guide[row, ti.min(ti.cast(xi * count, ti.i32), count - 1)]
    begin, end = cdf[row, i], cdf[row, i + 1]
    while end <= xi and i < count - 1:
        i += 1
        begin, end = end, cdf[row, i + 1]
    return i, (xi - begin) / (end - begin)


def guide_table(cdf: np.ndarray) -> np.ndarray:
    """(m, n) int32: for each of n equal parts of [0, 1), where the search in (m, n + 1) distributions begins.

    It is the last i with F_i at most the number where the part begins, so that no search has to go back. The number is
    a little smaller than k/n, because the product ξ n of ``find`` is rounded.
    """
    n = cdf.shape[1] - 1
    part_begins = np.arange(n) / n * (1 - 4 * np.finfo(cdf.dtype).eps)
    found = [np.searchsorted(row, part_begins, side="right") - 1 for row in cdf]
    return np.minimum(found, n - 1).astype(np.int32)


def sampling_tables(
    pixels: np.ndarray, lookup: str, dtype: type, compensates: bool = False
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Cumulative distributions of rows (h + 1,) and of columns in each row (h, w + 1), and the density (h, w).

    They are built in float64 from luminance × solid angle, and then rounded to ``dtype``. The density is computed from
    the rounded distributions, so that it is exactly the density with which a texel is sampled. A black image is sampled
    uniformly.

    Args:
        compensates: whether only the light above the mean is sampled. An ``EVEN`` image is sampled as a whole.
    """
    h, w = pixels.shape[:2]
    brightness = luminance(pixels)
    if lookup == "bilinear":
        brightness = mean_of_bilinear(brightness)
    if not brightness.any():
        brightness = np.ones((h, w))
    edges = np.cos(np.pi * np.arange(h + 1) / h)
    solid_angle = (edges[:-1] - edges[1:]) * 2 * np.pi / w  # of a texel in each row
    power = brightness * solid_angle[:, None]
    if compensates:
        mean = power.sum() / (solid_angle.sum() * w)
        above = np.maximum(brightness - mean, 0) * solid_angle[:, None]
        power = above if above.sum() > EVEN * power.sum() else power
    rows = _cumulative(power.sum(axis=1)[None])[0].astype(dtype)
    columns: np.ndarray = _cumulative(power).astype(dtype)
    probability = np.diff(rows.astype(np.float64))[:, None] * np.diff(columns.astype(np.float64), axis=1)
    return rows, columns, (probability / solid_angle[:, None]).astype(dtype)


def _cumulative(weights: np.ndarray) -> np.ndarray:
    """(n, m) weights → (n, m + 1) cumulative sums from 0 to 1. A row whose weights are all 0 becomes uniform."""
    total = weights.sum(axis=1, keepdims=True)
    weights = np.where(total > 0, weights, 1.0)
    cdf = np.concatenate([np.zeros((len(weights), 1)), np.cumsum(weights, axis=1)], axis=1)
    return cdf / cdf[:, -1:]


def mean_of_bilinear(texels: np.ndarray) -> np.ndarray:
    """The mean of a bilinear look-up over each texel: positive if the look-up is positive anywhere in the texel.

    The integral of the linear interpolation over a texel has the weights 1/8, 6/8, 1/8 along each axis.
    """
    across = (np.roll(texels, 1, axis=1) + 6 * texels + np.roll(texels, -1, axis=1)) / 8
    padded = np.concatenate([across[:1], across, across[-1:]])
    return (padded[:-2] + 6 * across + padded[2:]) / 8
