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
from taichi_tracer.formulas.warps import uniform_sphere
from taichi_tracer.lights.environment_light import EnvironmentLight
from taichi_tracer.lights.lamps import Lamps
from taichi_tracer.samplers.independent import IndependentSampler
from taichi_tracer.scene_data import SceneData
from taichi_tracer.studies.drawing import COLOURS, png_of
from taichi_tracer.system import runtime
from taichi_tracer.system.errors import InputError
from taichi_tracer.system.registry import PARTS

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
        totals, seconds = np.zeros(size[0] * size[1], np.int64), 0.0
        directions.take(name == UNIFORM, seed, 0, size, np.empty(1, np.int32))  # compiles it
        for first in range(0, count, CHUNK):
            cells = np.empty(min(CHUNK, count - first), np.int32)
            start = time.perf_counter()
            directions.take(name == UNIFORM, seed, first, size, cells)
            ti.sync()
            seconds += time.perf_counter() - start
            totals += np.bincount(cells, minlength=len(totals))
            tell(len(cells))
        found.append(Counts(name, totals.reshape(size[::-1]), seconds))
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
    x, n, dtype = tm.vec3(*map(float, point)), tm.vec3(*map(float, normal)), runtime.dtype()
    found = []
    for choice in PARTS.all("lamp choice"):
        lamps = Lamps(scene.geometry, scene.material_library, copy.copy(choice), scene.lamps.two_sided)
        choices, seconds, sums = _Choices(lamps), 0.0, np.zeros(2)
        chosen_by, in_cell = np.zeros(lamps.count, np.int64), np.zeros(size[0] * size[1], np.int64)
        choices.take(x, n, seed, 0, size, np.empty((1, 2), np.int32), np.empty(1, dtype))  # compiles it
        for first in range(0, count, CHUNK):
            light = np.empty(min(CHUNK, count - first), dtype)
            sampled = np.empty((len(light), 2), np.int32)
            start = time.perf_counter()
            choices.take(x, n, seed, first, size, sampled, light)
            ti.sync()
            seconds += time.perf_counter() - start
            chosen_by += np.bincount(sampled[:, 0], minlength=lamps.count)
            in_cell += np.bincount(sampled[:, 1], minlength=len(in_cell))
            sums += light.sum(dtype=np.float64), np.square(light, dtype=np.float64).sum()
            tell(len(light))
        mean, square = sums / count
        deviation = float(np.sqrt(max(0.0, square - mean**2)) / mean) if mean > 0 else float("nan")
        found.append(Counts(choice.name, in_cell.reshape(size[::-1]), seconds, chosen_by, deviation))
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
    lines = [f"{'technique':<12}{'min':>10}{'mean':>12}{'median':>10}{'max':>12}{'empty cells':>14}{'seconds':>10}"]
    for one in found:
        empty = f"{(one.cells == 0).mean():.1%}"
        lines.append(
            f"{one.name:<12}{one.cells.min():>10,}{one.cells.mean():>12,.1f}{np.median(one.cells):>10,.0f}"
            f"{one.cells.max():>12,}{empty:>14}{one.seconds:>10.3f}"
        )
    return lines


def choice_table(found: list[Counts]) -> list[str]:
    """Lines of text: for each choice of lamps, how many lamps share the samples, and what that does to the noise."""
    lines = [
        f"{'choice':<12}{'chosen':>10}{'effective':>12}{'bits':>8}{'deviation':>12}{'ns/sample':>12}{'seconds':>10}"
    ]
    for one in found:
        chosen = f"{int((one.lamps > 0).sum()):,}"
        lines.append(
            f"{one.name:<12}{chosen:>10}{one.effective_lamps:>12,.1f}{one.entropy:>8.2f}"
            f"{one.deviation:>12.2f}{1e9 * one.seconds / one.total:>12.0f}{one.seconds:>10.3f}"
        )
    return lines


def top_table(found: list[Counts], scene: SceneData, most: int) -> list[str]:
    """Lines of text: the lamps that each choice takes most often, by their ids and materials."""
    table, geometry, names = scene.lamps.table, scene.geometry, [m.name for m in scene.materials]
    lines = [f"{'choice':<12}{'lamp':>10}{'share':>10}  material"]
    for one in found:
        for lamp, share in one.top(most):
            row = table.primitives[lamp]
            of = geometry.mesh.face_materials[row] if row >= 0 else geometry.mesh.sphere_materials[-1 - row]
            lines.append(f"{one.name:<12}{table.ids[lamp]:>10}{share:>10.2%}  {names[of]}")
    return lines


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
