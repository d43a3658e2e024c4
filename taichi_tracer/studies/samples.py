"""Where do samples of the light go? Counts of directions for an environment, and of lamps for a scene.

A map shows all directions as latitude and longitude, like an environment: u = 1/2 + atan2(z, x)/2π from the left, and
v = 1/2 + asin(y)/π from the bottom. Each of its cells counts the samples that went there. Uniform directions fill it in
proportion to the solid angle of the cells; importance sampling fills it in proportion to the light, too (A3-6).
"""

import copy
import time
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import taichi as ti
import taichi.math as tm

from taichi_tracer.environment import Environment
from taichi_tracer.files.drawing import COLOURS, png_of
from taichi_tracer.formulas.warps import uniform_sphere
from taichi_tracer.lights.environment_light import EnvironmentLight
from taichi_tracer.lights.lamps import Lamps
from taichi_tracer.samplers.independent import IndependentSampler
from taichi_tracer.scene_data import SceneData
from taichi_tracer.studies.columns import in_columns
from taichi_tracer.system import runtime
from taichi_tracer.system.errors import InputError
from taichi_tracer.system.parts.registry import PARTS

CHUNK = 1 << 20  # samples of one call of a kernel
MOST_SAMPLES = 100_000_000  # samples, which are counted within a minute or two
MAP_SIZE = 256, 128  # cells of a map of directions
UNIFORM, IMPORTANCE = "uniform", "importance"


@dataclass(frozen=True)
class Counts:
    """Where the samples of one technique went.

    Attributes:
        name: of the technique.
        cells: (height, width) int64, how many samples went into each cell of the map, top row first.
        seconds: of taking them, without the time of compiling and of counting.
        lamps: (L,) int64, how many chose each lamp of a scene; None for an environment.
        deviation: the standard deviation of one sample of the light that arrives, if nothing blocks it, divided by its
            mean; NaN for an environment.
    """

    name: str
    cells: np.ndarray
    seconds: float
    lamps: np.ndarray | None = None
    deviation: float = float("nan")

    @property
    def total(self) -> int:
        """How many samples were taken."""
        return int(self.cells.sum())

    @property
    def entropy(self) -> float:
        """Bits: −Σ p log₂ p over the shares p of the lamps; log₂ of n where n lamps have equal shares."""
        share = self.lamps[self.lamps > 0] / self.lamps.sum()
        return float(max(0.0, -(share * np.log2(share)).sum()))

    @property
    def effective_lamps(self) -> float:
        """2^entropy: as many lamps with equal shares would have the same entropy."""
        return 2.0**self.entropy

    def top(self, most: int) -> list[tuple[int, float]]:
        """(lamp, share) of those that were chosen most often."""
        order = np.argsort(-self.lamps, kind="stable")[:most]
        return [(int(i), float(self.lamps[i] / self.lamps.sum())) for i in order if self.lamps[i] > 0]


@ti.func
def cell_of(d, width, height):
    """The number of the cell of a map that contains a direction; the first row is at the top."""
    u, v = 0.5 + ti.atan2(d.z, d.x) / (2 * tm.pi), 0.5 + ti.asin(ti.min(ti.max(d.y, -1.0), 1.0)) / tm.pi
    column = ti.min(ti.max(ti.cast(ti.floor(u * width), ti.i32), 0), width - 1)
    row = ti.min(ti.max(ti.cast(ti.floor((1 - v) * height), ti.i32), 0), height - 1)
    return row * width + column


@ti.data_oriented
class _Directions:
    """Directions of both techniques as numbers of cells."""

    def __init__(self, environment: Environment) -> None:
        # Only directions are asked for, which depend on no effect of a scene.
        self.light, self.numbers = EnvironmentLight(environment, effects=None), IndependentSampler()
        self.light.prepare()

    @ti.kernel
    def take(
        self,
        is_uniform: ti.template(),
        seed: ti.u32,
        first: ti.u32,
        size: ti.types.vector(2, ti.i32),
        cells: ti.types.ndarray(ndim=1),
    ):
        for i in cells:
            x, y = self.numbers.point(seed, ti.u32(0), first + ti.cast(i, ti.u32), ti.u32(0))
            d = tm.vec3(0)
            if ti.static(is_uniform):
                d = uniform_sphere(tm.vec2(x, y))
            else:
                d, _ = self.light.sample_direction(tm.vec2(x, y))
            cells[i] = cell_of(d, size[0], size[1])


@ti.data_oriented
class _Choices:
    """Samples of the lamps of a scene from one point: the lamp, the cell of the direction, and the light."""

    def __init__(self, lamps: Lamps) -> None:
        self.lamps, self.numbers = lamps, IndependentSampler()
        lamps.prepare()

    @ti.kernel
    def take(
        self,
        x: tm.vec3,
        n: tm.vec3,
        seed: ti.u32,
        first: ti.u32,
        size: ti.types.vector(2, ti.i32),
        found: ti.types.ndarray(ndim=2),
        light: ti.types.ndarray(ndim=1),
    ):
        """Columns of ``found``: the lamp, and the cell."""
        for i in light:
            index = first + ti.cast(i, ti.u32)
            a, b = self.numbers.point(seed, ti.u32(0), index, ti.u32(0))
            found[i, 0], _, _ = self.lamps.choice.choose(x, n, a)
            w_i, _, radiance, pdf = self.lamps.sample_from(x, n, tm.vec2(a, b))
            found[i, 1] = cell_of(w_i, size[0], size[1])
            light[i] = radiance.dot(tm.vec3(1.0 / 3)) * ti.max(0.0, tm.dot(n, w_i)) / pdf


def counted(
    take: Callable[[int, int], np.ndarray], count: int, size: tuple[int, int], tell: Callable[[int], None]
) -> tuple[np.ndarray, float]:
    """(rows, columns) how many samples are in each cell, and the seconds of taking them.

    Args:
        take: (the number of the first sample, how many) → their cells.
    """
    totals, seconds = np.zeros(size[0] * size[1], np.int64), 0.0
    for first in range(0, count, CHUNK):
        start = time.perf_counter()
        cells = take(first, min(CHUNK, count - first))
        seconds += time.perf_counter() - start
        totals += np.bincount(cells, minlength=len(totals))
        tell(len(cells))
    return totals.reshape(size[::-1]), seconds


def environment_counts(
    environment: Environment,
    count: int = 1_000_000,
    size: tuple[int, int] = MAP_SIZE,
    seed: int = 0,
    tell: Callable[[int], None] = lambda samples: None,
) -> list[Counts]:
    """Uniform directions against importance sampling of an environment.

    Args:
        count: samples of each technique. size: columns and rows of the maps.
        tell: called with the number of samples after each chunk.
    """
    runtime.ensure()
    check_count(count)
    directions, found = _Directions(environment), []
    for name in (UNIFORM, IMPORTANCE):

        def take(first: int, n: int, name: str = name) -> np.ndarray:
            cells = np.empty(n, np.int32)
            directions.take(name == UNIFORM, seed, first, size, cells)
            return cells

        take(0, 1)  # compiles
        found.append(Counts(name, *counted(take, count, size, tell)))
    return found


def lamp_counts(
    scene: SceneData,
    point,
    normal,
    count: int = 1_000_000,
    size: tuple[int, int] = MAP_SIZE,
    seed: int = 0,
    tell: Callable[[int], None] = lambda samples: None,
) -> list[Counts]:
    """The lamps of a scene that each registered choice of lamps takes for one point.

    Args:
        point, normal: (3,) of the surface that is lit.
        count, size, seed, tell: as for ``environment_counts``.

    Raises:
        InputError: no surface of the scene emits light.
    """
    check_count(count)
    if scene.lamps.count == 0:
        raise InputError(f"{scene.source}: no surface emits light: give a scene in which a material has Ke > 0")
    x, normal_of_point, dtype = tm.vec3(*map(float, point)), tm.vec3(*map(float, normal)), runtime.dtype()
    found = []
    for choice in PARTS.all("lamp choice"):
        choices = _Choices(Lamps(scene.geometry, scene.material_library, copy.copy(choice), scene.lamps.two_sided))
        chosen: list[np.ndarray] = []
        light: list[np.ndarray] = []

        def take(first: int, n: int, choices=choices, chosen=chosen, light=light) -> np.ndarray:
            sampled, values = np.empty((n, 2), np.int32), np.empty(n, dtype)
            choices.take(x, normal_of_point, seed, first, size, sampled, values)
            chosen.append(np.bincount(sampled[:, 0], minlength=scene.lamps.count))
            light.append(np.array([values.sum(dtype=np.float64), np.square(values, dtype=np.float64).sum()]))
            return sampled[:, 1]

        take(0, 1)  # compiles
        cells, seconds = counted(take, count, size, tell)
        mean, square = np.sum(light[1:], axis=0) / count
        deviation = float(np.sqrt(max(0.0, square - mean**2)) / mean) if mean > 0 else float("nan")
        found.append(Counts(choice.name, cells, seconds, np.sum(chosen[1:], axis=0), deviation))
    return found


def check_count(count: int) -> None:
    """Raise an InputError for a number of samples that is not from 1 to ``MOST_SAMPLES``."""
    if not 1 <= count <= MOST_SAMPLES:
        raise InputError(f"samples: count must be from 1 to {MOST_SAMPLES:,}, not {count:,}")


def centre_of_view(scene: SceneData) -> tuple[np.ndarray, np.ndarray]:
    """(point, normal) of what the scene's view shows in its middle.

    Raises:
        InputError: there is nothing.
    """
    eye, at = (np.asarray(scene.view[name], np.float64) for name in ("eye", "at"))
    hits = scene.intersect(eye, at - eye)
    if not hits.is_hit[0]:
        raise InputError(f"{scene.source}: the middle of the view shows no surface: give a point (--point X Y Z)")
    return eye + hits.distance[0] * (at - eye), hits.normal[0].astype(np.float64)


def normal_at(scene: SceneData, point) -> np.ndarray:
    """The normal of the surface at a point that the eye sees; (0, 1, 0) where it sees no surface at this point."""
    eye, point = np.asarray(scene.view["eye"], np.float64), np.asarray(point, np.float64)
    size = np.linalg.norm(scene.geometry.high - scene.geometry.low)
    if np.linalg.norm(point - eye) > 0:
        hits = scene.intersect(eye, point - eye)
        if hits.is_hit[0] and abs(hits.distance[0] - 1) * np.linalg.norm(point - eye) < 1e-3 * size:
            return hits.normal[0].astype(np.float64)
    return np.array([0.0, 1, 0])


# ── as text ──


def map_table(found: list[Counts]) -> list[str]:
    """Lines of text: for each technique, how many samples its cells have."""
    return in_columns(
        [
            {
                "technique": one.name,
                "min": f"{one.cells.min():,}",
                "mean": f"{one.cells.mean():,.1f}",
                "median": f"{np.median(one.cells):,.0f}",
                "max": f"{one.cells.max():,}",
                "empty cells": f"{(one.cells == 0).mean():.1%}",
                "seconds": f"{one.seconds:.3f}",
            }
            for one in found
        ]
    )


def choice_table(found: list[Counts]) -> list[str]:
    """Lines of text: for each choice of lamps, how many lamps share the samples, and what that does to the noise."""
    return in_columns(
        [
            {
                "choice": one.name,
                "chosen": f"{int((one.lamps > 0).sum()):,}",
                "effective": f"{one.effective_lamps:,.1f}",
                "bits": f"{one.entropy:.2f}",
                "deviation": f"{one.deviation:.2f}",
                "ns/sample": f"{1e9 * one.seconds / one.total:.0f}",
                "seconds": f"{one.seconds:.3f}",
            }
            for one in found
        ]
    )


def top_table(found: list[Counts], scene: SceneData, most: int) -> list[str]:
    """Lines of text: the lamps that each choice takes most often, by their ids and materials."""
    table, mesh, rows = scene.lamps.table, scene.geometry.mesh, []
    for one in found:
        for lamp, share in one.top(most):
            row = table.primitives[lamp]
            material = mesh.face_materials[row] if row >= 0 else mesh.sphere_materials[-1 - row]
            name = scene.materials[material].name
            rows.append({"choice": one.name, "lamp": str(table.ids[lamp]), "share": f"{share:.2%}", "material": name})
    return in_columns(rows)


# ── as pictures ──


def map_png(counts: Counts, brightest: int, title: str) -> bytes:
    """A map as a PNG file: the logarithm of the counts as colour, with a scale; cells without samples are black.

    Args:
        brightest: the count at the end of the scale, so that several maps can have the same scale.
    """
    from matplotlib import colormaps
    from matplotlib.colors import LogNorm
    from matplotlib.figure import Figure

    figure = Figure(figsize=(8, 4.4), layout="constrained")
    axes = figure.subplots()
    colours = colormaps["plasma"].with_extremes(bad="black")
    cells = np.ma.masked_equal(counts.cells, 0)
    scale = LogNorm(1, max(brightest, 2))
    shown = axes.imshow(cells, cmap=colours, norm=scale, extent=(-180, 180, -90, 90), interpolation="nearest")
    axes.set(xlabel="azimuth, degrees", ylabel="elevation, degrees", title=title)
    axes.set(xticks=range(-180, 181, 90), yticks=range(-90, 91, 45))
    figure.colorbar(shown, ax=axes, label="samples per cell (black: none)", shrink=0.85)
    return png_of(figure)


def shares_png(found: list[Counts], title: str) -> bytes:
    """A chart as a PNG file: the shares of the lamps, sorted, for each choice."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=(8, 4.4), layout="constrained")
    axes = figure.subplots()
    for one, colour in zip(found, COLOURS, strict=False):
        share = np.sort(one.lamps[one.lamps > 0])[::-1] / one.lamps.sum()
        label = f"{one.name}: {one.effective_lamps:,.4g} effective lamps"
        axes.loglog(np.arange(1, len(share) + 1), 100 * share, color=colour, marker="." if len(share) < 50 else "")
        axes.lines[-1].set_label(label)
    axes.set(xlabel="lamps, from the one that is chosen most often", ylabel="share of the samples, %", title=title)
    axes.grid(True, which="both", alpha=0.2)
    axes.legend(frameon=False)
    return png_of(figure)
