"""Near misses of bright spots: how often rays looked beside a small sun, and how often they met it.

A small sun that no ray of a picture has met leaves no trace in the picture's samples. But the environment is known
before the first sample. If rays often look into directions close to the sun, others should meet it, and as long as they
have not, light is missing. Therefore, for each level of brightness, such look-ups are counted: those within
``NEAR`` of a bright spot, and among them those that met it. ``unseen.unseen_light`` computes from both numbers how
much light may be missing.

Only look-ups that decide what is found are counted: those of eye rays, of mirrors, and of lobes from which no sample of
the lights is taken. A lobe that is much narrower than a sun counts as a mirror's: samples of the lights hardly ever
fall into it, and the few that do have a weight that is next to nothing. An environment whose light is spread over large
areas has no bright spot, and nothing is counted.
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
import taichi as ti
import taichi.math as tm
from taichi.lang import impl

from taichi_tracer.environment import Environment
from taichi_tracer.system.compile_time import compile_time
from taichi_tracer.system.fields import memory
from taichi_tracer.system.fields.lru import Lru
from taichi_tracer.system.fields.tables import Tables
from taichi_tracer.system.fields.varying import varying
from taichi_tracer.system.parts.observed import observed, observed_scene
from taichi_tracer.system.parts.overrides import replaced
from taichi_tracer.unseen.narrow_lobes import is_like_mirror

NEAR = np.radians(10.0)  # wide enough that a picture with few samples has near misses, and a sky is even within it
LEVELS = (1 / 4, 1 / 40, 1 / 400)  # of the largest radiance: where each level ends below
SMALL_SPOT = 0.005  # of the sphere: what is larger is met by many rays
MATTERS = 0.01  # of all the light: what has less is not missed
ROWS = 64  # of the map of directions that are near; it has twice as many columns
KINDS = ("eye rays", "mirrors", "lobes")
EYE, MIRROR, LOBE = range(len(KINDS))
IF_HEAVY = 4  # is added to a kind that is only counted if its weight is large
BITS = len(LEVELS)
WEIGHT = 0.01  # what a look-up of a narrow lobe is multiplied by, at least, if it was drawn from the lobe itself
KEPT = 8  # estimators whose samples are counted: going back to one of so many compiles nothing
ENOUGH = 1000  # look-ups that met a level: more need not be counted


@dataclass(frozen=True)
class BrightLevel:
    """A level of brightness of an environment.

    Attributes:
        low, high: where it begins and ends: radiance, as a mean of red, green and blue, for an intensity of 1.
        radiance: of its brightest texel, in the same unit.
        share: the solid angle of its texels / the solid angle of all directions that are near to them.
    """

    low: float
    high: float
    radiance: float
    share: float


@dataclass
class NearMisses:
    """What was counted for one picture; the counts of disjoint samples may be added.

    Attributes:
        levels: (n, 2) of each level: its largest radiance, with the intensity, and its ``share``.
        near, met: (n, 3) of each level and each of ``KINDS``: look-ups that are near, and those of them that met it.
        per_pixel: (width, height) near look-ups of lobes.
    """

    levels: np.ndarray
    near: np.ndarray
    met: np.ndarray
    per_pixel: np.ndarray

    def __add__(self, other: "NearMisses") -> "NearMisses":
        counts = self.near + other.near, self.met + other.met, self.per_pixel + other.per_pixel
        return NearMisses(self.levels, *counts)

    def to_arrays(self) -> dict[str, np.ndarray]:
        """The arrays of a checkpoint, see ``Film.to_arrays``."""
        levels = np.concatenate([self.levels, self.near, self.met], axis=1)
        return {"near_misses": levels, "near_per_pixel": self.per_pixel.astype(np.int32)}

    @classmethod
    def from_arrays(cls, arrays: dict[str, np.ndarray]) -> "NearMisses | None":
        """The inverse of ``to_arrays``; None if the arrays have no near misses."""
        if "near_misses" not in arrays:
            return None
        levels, near, met = np.split(arrays["near_misses"], [2, 2 + len(KINDS)], axis=1)
        return cls(levels, near.astype(np.int64), met.astype(np.int64), arrays["near_per_pixel"].astype(np.int64))


def levels_of(environment: Environment) -> tuple[tuple[BrightLevel, ...], np.ndarray]:
    """The levels that are small and matter, and the map of directions.

    Returns:
        The levels; and (ROWS, 2 ROWS) uint8, row 0 at the zenith: bit i is set where level i is near.
    """
    pixels = environment.pixels.astype(np.float64)
    h, w = pixels.shape[:2]
    brightness = (pixels[..., 0] + pixels[..., 1] + pixels[..., 2]) / 3  # in a third of the time of mean(axis=2)
    edges = np.cos(np.pi * np.arange(h + 1) / h)
    solid_angle = np.repeat((edges[:-1] - edges[1:])[:, None] * 2 * np.pi / w, w, axis=1)
    light = brightness * solid_angle
    found: list[BrightLevel] = []
    zones = np.zeros((ROWS, 2 * ROWS), np.uint8)
    cells, areas = _centres(ROWS, 2 * ROWS)
    high = np.inf
    for fraction in LEVELS:
        low = fraction * brightness.max()
        is_level = (brightness >= low) & (brightness < high)
        of_sphere = solid_angle[brightness >= low].sum() / (4 * np.pi)
        if of_sphere > SMALL_SPOT or low == 0:
            break
        if light[is_level].sum() > MATTERS * light.sum():
            rows, columns = np.nonzero(is_level)
            spots = np.unique(np.stack([rows * ROWS // h, columns * 2 * ROWS // w]), axis=1)
            spot = cells[spots[0], spots[1]]
            is_near = (cells @ spot.T).max(axis=2) > np.cos(NEAR + np.pi / ROWS / 2)
            share = solid_angle[is_level].sum() / areas[is_near].sum()
            zones |= is_near.astype(np.uint8) << len(found)
            found.append(BrightLevel(low, high, float(brightness[is_level].max()), float(share)))
        high = low
    return tuple(found), zones


def _centres(rows: int, columns: int) -> tuple[np.ndarray, np.ndarray]:
    """(rows, columns, 3) directions of the centres of cells, as ``Environment.coords`` has them, and their areas."""
    v, u = np.meshgrid((np.arange(rows) + 0.5) / rows, (np.arange(columns) + 0.5) / columns, indexing="ij")
    elevation, azimuth = np.pi * (0.5 - v), 2 * np.pi * (u - 0.5)
    x, z = np.cos(elevation) * np.cos(azimuth), np.cos(elevation) * np.sin(azimuth)
    return np.stack([x, np.sin(elevation), z], axis=-1), np.cos(elevation) * 2 * (np.pi / rows) * (np.pi / columns)


@ti.data_oriented
class NearMissCounter:
    """Counts the near misses of one picture, inside its kernel; see ``NearMisses``.

    Args:
        light: the environment as a light, an ``EnvironmentLight``.
        levels, zones: of ``levels_of``.
        width, height: the size of the picture in pixels.
    """

    def __init__(self, light, levels: tuple[BrightLevel, ...], zones: np.ndarray, width: int, height: int) -> None:
        self.light, self.levels = light, levels
        self.ends = varying(tuple((float(level.low), float(level.high)) for level in levels))
        self._memory = memory.Memory()
        fields = self._memory.fields
        self.zones, self.per_pixel = ti.field(ti.u8), ti.field(ti.i32)
        self.near, self.met = ti.field(ti.i32), ti.field(ti.i32)
        fields.dense(ti.ij, zones.shape).place(self.zones)
        fields.dense(ti.ij, (width, height)).place(self.per_pixel)
        fields.dense(ti.ij, (len(levels), len(KINDS))).place(self.near, self.met)
        self._memory.allocate()
        self._memory.write(self.zones, zones)
        self._zeros = Tables()
        for field in (self.per_pixel, self.near, self.met):
            self._zeros.put(field, np.zeros(field.shape, np.int32))
        self._watched = Lru(KEPT)

    def is_over(self) -> bool:
        """Whether its fields are gone, because Taichi was started again."""
        return self._memory.is_over()

    def clear(self) -> None:
        """Forget all counts."""
        self._zeros.load(self._memory)

    def counts(self) -> NearMisses:
        """What was counted so far."""
        intensity = self.light.environment.intensity
        levels = np.array([[level.radiance * intensity, level.share] for level in self.levels])
        return NearMisses(
            levels, *(self._memory.read(f).astype(np.int64) for f in (self.near, self.met, self.per_pixel))
        )

    def watched(self, scene: Any, sampler: Any, integrator: Any) -> tuple[Any, Any]:
        """Copies of a scene and of a sampler that count the look-ups of an integrator's samples."""
        return self._watched.get((scene, sampler, integrator), lambda: self._watch(scene, sampler, integrator))

    def _watch(self, scene: Any, sampler: Any, integrator: Any) -> tuple[Any, Any]:
        observers = {"scene": {"surface_at": reaching, "visible": looking_at}, "lights": {"arriving": looking_along}}
        return observed_scene(scene, observers, self), observed(sampler, {"start": beginning}, (self, integrator))

    @compile_time
    def begin(self, x, y, integrator) -> None:
        """Begin a sample of a pixel."""
        self.x, self.y = x, y
        self.samples_lights, self.samples_brdf = integrator.samples_lights, integrator.samples_brdf
        self.surfaces, self.is_scattered, self.is_delta, self.is_narrow = (impl.expr_init(0) for _ in range(4))

    @ti.func
    def reach(self, surface):
        """Note that the path has reached a surface."""
        self.surfaces += 1
        self.is_delta = ti.cast(surface.is_delta(), ti.i32)
        if ti.static(self.samples_lights):  # otherwise it counts as a lobe, as all others do
            self.is_narrow = ti.cast(is_like_mirror(surface.material), ti.i32)
        if self.is_delta == 0 and self.is_narrow == 0:
            self.is_scattered = 1

    @ti.func
    def look_along(self, ray, hit, light):
        """Count what arrives along a ray, if it hits nothing."""
        if not hit.is_hit:
            self.look_up(ray.direction, light, tm.vec3(1))

    @ti.func
    def look_at(self, has_lamps: ti.template(), light, surface, w_i, factor):
        """Count the light that is visible from a surface; where there are lamps, ``look_along`` counts it."""
        if ti.static(not has_lamps):
            if light.max() > 0:
                self.look_up(w_i, light, factor)

    @ti.func
    def look_up(self, direction, radiance, factor):
        """Count a ray that nothing blocks, with the radiance that it found, and what this is multiplied by."""
        kind = self.weighted(self.kind_before_weight(), factor)
        if kind >= 0:
            u, v = self.light.environment.coords(self.light.with_y_up(direction))
            self.count(self.x, self.y, self.code(kind, u, v, radiance))

    @ti.func
    def kind_before_weight(self):
        """Which of ``KINDS`` the next look-up is; −1 if it is not counted; plus ``IF_HEAVY`` if its factor decides."""
        kind = ti.select(self.surfaces == 0, EYE, ti.select(self.is_scattered == 0, MIRROR, LOBE))
        is_counted = kind == EYE or self.is_delta == 1 or ti.static(not self.samples_lights)
        other = -1
        if ti.static(self.samples_brdf):
            other = ti.select(self.is_narrow == 1, kind + IF_HEAVY, -1)
        return ti.select(is_counted, kind, other)

    @ti.func
    def weighted(self, kind, factor):
        """The kind of a look-up whose light is multiplied by ``factor``, from ``kind_before_weight``."""
        is_heavy = factor.max() >= WEIGHT
        return ti.select(kind < IF_HEAVY, kind, ti.select(is_heavy, kind - IF_HEAVY, -1))

    @ti.func
    def code(self, kind, u, v, radiance):
        """What a look-up of a kind counts for, as one number: 0 for nothing.

        Bit i is set if it is near to level i, and bit ``BITS`` + i if it meets this level. Above these is its kind.
        """
        code = 0
        if kind >= 0:
            row = ti.min(ti.cast((1 - v) * ROWS, ti.i32), ROWS - 1)
            zone = ti.cast(self.zones[row, ti.min(ti.cast(u * 2 * ROWS, ti.i32), 2 * ROWS - 1)], ti.i32)
            if zone > 0:
                code = zone | kind << 2 * BITS
                brightness = radiance.sum() / 3 / self.light.environment.settings[0]
                for i in ti.static(range(len(self.ends))):
                    if self.ends[i][0] <= brightness < self.ends[i][1]:
                        code |= 1 << (BITS + i)
        return code

    @ti.func
    def count(self, x, y, code):
        """Count a look-up of a pixel with this ``code``."""
        if code > 0:
            kind = code >> 2 * BITS
            for i in ti.static(range(len(self.ends))):
                if (code >> i) & 1 and self.met[i, kind] < ENOUGH:
                    self.near[i, kind] += 1
                    if (code >> (BITS + i)) & 1:
                        self.met[i, kind] += 1
            if kind == LOBE:
                self.per_pixel[x, y] = self.per_pixel[x, y] + 1  # one thread has the pixel: not atomic


def beginning(watcher: Any, sampler: Any, start: Callable, seed: Any, x: Any, y: Any, index: Any) -> Any:
    """A sample begins; the watcher is its counter and its integrator."""
    counter, integrator = watcher
    counter.begin(x, y, integrator)
    return start(seed, x, y, index)


def reaching(counter: NearMissCounter, scene: Any, surface_at: Callable, *of: Any) -> Any:
    """A path reaches a surface."""
    surface = impl.expr_init(surface_at(*of))
    counter.reach(surface)
    return surface


def looking_at(counter: NearMissCounter, scene: Any, visible: Callable, *of: Any) -> Any:
    """A surface asks for the light from a direction."""
    found = impl.expr_init(visible(*of))
    counter.look_at(scene.lights.has_lamps, found[0], *of)
    return found


def looking_along(counter: NearMissCounter, lights: Any, arriving: Callable, ray: Any, hit: Any) -> Any:
    """Light arrives along a ray."""
    light = impl.expr_init(arriving(ray, hit))
    counter.look_along(ray, hit, light)
    return light


def counter_for(scene, width: int, height: int) -> NearMissCounter | None:
    """A counter for pictures of a scene, a ``SceneInKernels``; None if nothing bright can be missed."""
    light = next((one for one in scene.lights.far if one.name == "environment"), None)
    if light is None or scene.effects.environment != "image" or replaced(light.environment):
        return None
    levels, zones = levels_of(light.environment)
    return NearMissCounter(light, levels, zones, width, height) if levels else None
