"""Where do samples of the light go? Counts of directions for an environment, and of lamps for a scene.

A map shows all directions as latitude and longitude, like an environment: u = 1/2 + atan2(z, x)/2π from the left, and
v = 1/2 + asin(y)/π from the bottom. Each of its cells counts the samples that went there. Uniform directions fill it in
proportion to the solid angle of the cells; importance sampling fills it in proportion to the light, too (A3-6).
"""

import copy
import time
from dataclasses import dataclass

import numpy as np
import taichi as ti

from taichi_tracer.contracts.lab import WHOLE, Rows, bound
from taichi_tracer.environment import Environment
from taichi_tracer.files.page import png_of
from taichi_tracer.formulas import vector_math as tm
from taichi_tracer.formulas.warps import uniform_sphere
from taichi_tracer.lights.environment_light import EnvironmentLight
from taichi_tracer.lights.lamps import Lamps
from taichi_tracer.scene_data import SceneData
from taichi_tracer.studies.tables import in_columns
from taichi_tracer.system import runtime
from taichi_tracer.system.errors import InputError
from taichi_tracer.system.parts import PARTS

CHUNK = 1 << 20  # samples of one call of a kernel
MAP_SIZE = 256, 128  # cells of a map of directions


@dataclass(frozen=True)
class Counts:
    """Where the samples of one technique went.

    Attributes:
        name: of the technique.
        cells: (height, width) int64, how many samples went into each cell of the map, top row first.
        seconds: of taking them, without the time of compiling and of counting.
        lamps: (L,) int64, how many chose each lamp of a scene, up to the last one chosen; empty for an environment.
        deviation: the standard deviation of one sample of the light that arrives, if nothing blocks it, divided by its
            mean; NaN for an environment.
    """

    name: str
    cells: np.ndarray
    seconds: float
    lamps: np.ndarray
    deviation: float

    @property
    def total(self) -> int:
        """How many samples were taken."""
        return int(self.cells.sum())

    @property
    def effective_lamps(self) -> float:
        """As many lamps with equal shares would have the same entropy: 2^H, with H = −Σ p log₂ p of the shares p."""
        share = self.lamps[self.lamps > 0] / self.lamps.sum()
        return float(2.0 ** -(share * np.log2(share)).sum())


def cells_of(directions: np.ndarray, size: tuple[int, int]) -> np.ndarray:
    """(rows, columns) how many of (n, 3) unit directions are in each cell of a map, the top row first."""
    u = 0.5 + np.arctan2(directions[:, 2], directions[:, 0]) / (2 * np.pi)
    from_top = 0.5 - np.arcsin(np.clip(directions[:, 1], -1, 1)) / np.pi
    return np.histogram2d(from_top, u, size[::-1], [(0, 1), (0, 1)])[0].astype(np.int64)


@ti.func
def lamp_sample(lamps: ti.template(), xi, x, n):
    """The direction, the lamp, and the light that arrives if nothing blocks it, over the density."""
    lamp, _, _ = lamps.choice.choose(x, n, xi.x)
    w_i, _, radiance, pdf = lamps.sample_from(x, n, xi)
    return w_i, lamp, radiance.dot(tm.vec3(1.0 / 3)) * ti.max(0.0, tm.dot(n, w_i)) / pdf


def counted(name: str, take: Rows, count: int, size: tuple[int, int], seed: int, *given) -> Counts:
    """The counts of a technique.

    Args:
        take: two random numbers and what is ``given`` → direction; of lamps, see ``lamp_sample``.
        size: columns and rows of the map.
    """
    rng, cells, seconds = np.random.default_rng(seed), np.zeros(size[::-1], np.int64), 0.0
    lamps, sums = np.zeros(0, np.int64), np.zeros(2)
    take(np.full(2, 0.5), *given)  # compiles
    for first in range(0, count, CHUNK):
        n = min(CHUNK, count - first)
        xi = rng.random((n, 2), np.float32)
        start = time.perf_counter()
        directions, *of_lamps = (answers[:, 0].astype(np.float64) for answers in take.calls([xi, *given]))
        seconds += time.perf_counter() - start
        cells += cells_of(directions, size)
        if len(of_lamps) == 2:
            found = np.bincount(of_lamps[0].astype(int), minlength=len(lamps))
            lamps = found + np.pad(lamps, (0, len(found) - len(lamps)))
            sums += of_lamps[1].sum(), np.square(of_lamps[1]).sum()
    mean, square = sums / count
    deviation = float(np.sqrt(max(0.0, square - mean**2)) / mean) if mean > 0 else float("nan")
    return Counts(name, cells, seconds, lamps, deviation)


def environment_counts(
    environment: Environment, count: int = 1_000_000, size: tuple[int, int] = MAP_SIZE, seed: int = 0
) -> list[Counts]:
    """Uniform directions against importance sampling of an environment.

    Args:
        count: samples of each technique. size: columns and rows of the maps.
    """
    runtime.ensure()
    light = EnvironmentLight(environment, effects=None)  # only for directions, which depend on no effect of a scene
    light.prepare()
    kinds = {"uniform": Rows(uniform_sphere, (2,), (3,)), "importance": Rows(light.sample_direction, (2,), (3, 1))}
    return [counted(name, take, count, size, seed) for name, take in kinds.items()]


def lamp_counts(
    scene: SceneData, point, normal, count: int = 1_000_000, size: tuple[int, int] = MAP_SIZE, seed: int = 0
) -> list[Counts]:
    """The lamps of a scene that each registered choice of lamps takes for one point.

    Args:
        point, normal: (3,) of the surface that is lit.
        count, size, seed: as for ``environment_counts``.

    Raises:
        InputError: no surface of the scene emits light.
    """
    if scene.lamps.count == 0:
        raise InputError(f"{scene.source}: no surface emits light: give a scene in which a material has Ke > 0")
    found = []
    for choice in PARTS.all("lamp choice"):
        lamps = Lamps(scene.geometry, scene.material_library, copy.copy(choice), scene.lamps.two_sided)
        lamps.prepare()
        take = Rows(bound(lamp_sample, lamps), (2, 3, 3), (3, WHOLE, 1))
        found.append(counted(choice.name, take, count, size, seed, point, normal))
    return found


def lit_point(scene: SceneData, point=None) -> tuple[np.ndarray, np.ndarray]:
    """(point, normal) of the surface that the eye sees at a point: (0, 1, 0) where it sees none there.

    Args:
        point: (3,); None is what the scene's view shows in its middle.

    Raises:
        InputError: there is nothing in the middle.
    """
    eye, at = np.asarray(scene.view["eye"], np.float64), np.asarray(scene.view["at"] if point is None else point, float)
    hits = scene.intersect(eye, at - eye)
    place, normal = hits.position[0].astype(np.float64), hits.normal[0].astype(np.float64)
    if point is None and not hits.is_hit[0]:
        raise InputError(f"{scene.source}: the middle of the view shows no surface: give a point (--point X Y Z)")
    if point is None:
        return place, normal
    size = np.linalg.norm(scene.geometry.high - scene.geometry.low)
    is_there = hits.is_hit[0] and np.linalg.norm(place - at) < 1e-3 * size
    return at, normal if is_there else np.array([0.0, 1, 0])


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
                "deviation": f"{one.deviation:.2f}",
                "ns/sample": f"{1e9 * one.seconds / one.total:.0f}",
                "seconds": f"{one.seconds:.3f}",
            }
            for one in found
        ]
    )


def top_table(found: list[Counts], scene: SceneData, most: int) -> list[str]:
    """Lines of text: the lamps that each choice takes most often, by their ids and materials."""
    table, rows = scene.lamps.table, []
    for one in found:
        for lamp in np.argsort(-one.lamps, kind="stable")[: min(most, np.count_nonzero(one.lamps))]:
            name, share = scene.materials[table.materials[lamp]].name, one.lamps[lamp] / one.lamps.sum()
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
