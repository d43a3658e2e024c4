"""How much light does an estimator miss because it draws its directions with the wrong technique?

An estimator that draws directions only from the lights misses what a narrow lobe reflects, because hardly any of them
falls into the lobe. One that draws them only from the BRDF misses a small lamp. What was never met leaves no trace in
the samples, so that their spread does not show it. But a few samples of the other technique show it at once.

Let the other technique draw ω_i with the density q, and let it find the light E = f_r cos θ_i L / q. It has about one
sample in the solid angle 1/q around ω_i. A sample of the estimator, with the density p, falls there with the
probability P = p / q. If the pixel has n samples, n P of them meet this light.

Such numbers are added up over all pixels of the picture, and over all directions that are about as rare: up to
``ABOUT_AS_RARE`` times as probable. If the sum is below ``KNOWN``, the light is most likely missing everywhere. With
E_ik of the samples k = 1 … K of pixel i that are so rare, and 0 instead of the others, the mean square error grows by

    u² = (1/N) Σ_i ((1/K) Σ_k E_ik)².

Not even the other technique need find a small sun in a lobe that is much narrower: ``mirror_chains`` follow it.

Only the surfaces that eye rays hit are looked at. Estimators that use both techniques miss nothing in this way, and
nothing is done or compiled for them.

Both densities are those of multiple importance sampling: Veach & Guibas, "Optimally combining sampling techniques for
Monte Carlo rendering", SIGGRAPH 1995.
"""

import math
from collections.abc import Callable
from typing import Any

import numpy as np
import taichi as ti
import taichi.math as tm

from taichi_tracer.integrators.base import Integrator
from taichi_tracer.integrators.next_event import light_along, sample_of_lights
from taichi_tracer.system.fields import memory
from taichi_tracer.system.fields.varying import varying
from taichi_tracer.system.parts.observed import observed
from taichi_tracer.system.parts.overrides import unfinished
from taichi_tracer.system.some_pixels import SomePixels
from taichi_tracer.unseen.narrow_lobes import has_narrow_lobes
from taichi_tracer.unseen.rare_light import ABOUT_AS_RARE, KNOWN, expected
from taichi_tracer.unseen.small_suns import Sun

SAMPLES = 4  # of the other technique, in each pixel that is looked at
MOST_TILES = 128  # pixels along each side that are looked at; of larger pictures, one pixel of each tile
SAFETY = 1.2  # times u: the tiles and the few samples of a pixel make u rough
SEED = 0x85EBCA6B  # combined with the seed of the picture, so that these samples are not its own
SPHERE = 4 * math.pi  # the solid angle of all directions


def other_techniques(scene, integrator, pixels: int, suns: list[Sun]) -> tuple[str, ...]:
    """The techniques, "brdf" or "lights", that find light which an integrator may never meet.

    Args:
        scene: a ``SceneInKernels``. pixels: of the picture. suns: of the scene.
    """
    brdfs = [scene.material_library.brdfs[i] for i in scene.effects.brdfs]
    if not (integrator.needs_light and scene.effects.samples_lights) or any(map(unfinished, brdfs)):
        return ()
    found = []
    geometry = scene.geometry
    if not integrator.samples_brdf and has_narrow_lobes(scene):
        found.append("brdf")
    if not integrator.samples_lights:
        shares = [float(sun.solid_angles.sum()) for sun in suns]
        if scene.lights.has_lamps:
            size, areas = float((geometry.high - geometry.low).max()), scene.lights.lamps.table.areas
            alike = expected(np.sort(areas), ABOUT_AS_RARE * areas, each=1.0)  # a large lamp says nothing of a small
            shares.append(alike.min() / size**2)
        if shares and pixels * min(shares) < KNOWN * SPHERE:
            found.append("lights")
    return tuple(found)


@ti.data_oriented
class OtherSample(Integrator):
    """One sample of the other technique at what an eye ray hits.

    Args:
        technique: "brdf" or "lights". integrator: the estimator that does not use it.
    """

    def __init__(self, technique: str, integrator: Integrator) -> None:
        self.from_brdf = technique == "brdf"
        self.knows_lights, self.knows_brdf = integrator.samples_lights, integrator.samples_brdf

    @ti.func
    def radiance(self, scene, ray, hit, rng):
        """(E, P, 0), with E as the root of the mean square of its channels; 0 if it finds no light."""
        found = tm.vec3(0)
        if hit.is_hit:
            surface = scene.surface_at(ray, hit)
            if not surface.is_delta():
                value, p, q = self.sample(scene, surface, rng)
                if q > 0 and abs(value).sum() < tm.inf:
                    found = tm.vec3(tm.sqrt(tm.dot(value, value) / 3), p / q, 0)
        return found

    @ti.func
    def sample(self, scene, surface, rng):
        """(E, p, q)."""
        value, p, q = tm.vec3(0), 1 / SPHERE, 0.0
        if ti.static(self.from_brdf):
            w_i = surface.sample(rng.next_2d())
            light, pdf = light_along(scene, surface, w_i, surface.weight(w_i))
            value, q = surface.weight(w_i) * light, surface.pdf(w_i)
            if ti.static(self.knows_lights):
                p = pdf
        else:
            f_cos, light, q, pdf = sample_of_lights(scene, surface, rng.next_2d_of_term())
            value = f_cos * light / q
            if ti.static(self.knows_brdf):
                p = pdf
        return value, p, q


@ti.data_oriented
class TechniqueCheck:
    """What the other technique finds in a picture.

    Args:
        parts: what samples of the picture are made of, a ``picture.sample_parts.SampleParts``.
        crop: (x0, x1, y0, y1), the pixels of the picture.
        techniques: of ``other_techniques``.
    """

    def __init__(self, parts: Any, crop: tuple[int, ...], techniques: tuple[str, ...]) -> None:
        self.is_of, self.scene = (parts.scene, parts.integrator, crop, techniques), parts.scene
        x0, x1, self.x0, self.y0 = crop[0], crop[1], varying(crop[0]), varying(crop[2])
        size = x1 - x0, crop[3] - crop[2]
        self.step = varying(math.ceil(max(size) / MOST_TILES))
        self.columns, self.rows = (-(-n // self.step) for n in size)
        self.pixels = size[0] * size[1]
        self._memory = memory.Memory()
        self.samples = ti.Vector.field(2, ti.f32)  # (E, P) of each sample
        self._memory.fields.dense(ti.ijk, (SAMPLES, self.rows, self.columns)).place(self.samples)
        self._memory.allocate()
        self.parts = [self.observed(parts, technique) for technique in techniques]
        self.seen: object = None  # the state of the picture at which it was looked
        self.found: list[tuple[np.ndarray, np.ndarray]] = []

    def observed(self, parts: Any, technique: str) -> Any:
        """The parts of the samples of a technique: one of each tile of the picture, which are kept here."""
        sampler = observed(parts.sampler, {"start": starting}, self)
        eyes = observed(parts.eye_rays, {"hit_of": looking}, self)
        integrator = OtherSample(technique, parts.integrator)
        tiles = SomePixels(self.keep)
        tiles.choose((0, self.columns), (0, self.rows))
        return type(parts)(parts.scene, integrator, eyes, sampler, shares=tiles, film=tiles)

    @ti.func
    def pixel(self, x, y):
        """The pixel of the picture that represents a tile."""
        return self.x0 + x * self.step, self.y0 + y * self.step

    @ti.func
    def keep(self, x, y, value, k):
        """Keep sample k of a tile."""
        self.samples[ti.cast(k, ti.i32), y, x] = ti.cast(value.xy, ti.f32)

    def look(self, renderer: Any, state: object) -> None:
        """Take the samples of the present state of a renderer's picture, unless they were taken already."""
        if state == self.seen:
            return
        self.scene.lights.prepare()
        self.found = []
        for parts in self.parts:
            for k in range(SAMPLES):
                renderer._take_samples(parts, (renderer.seed ^ SEED) % 2**32, k, 1)
            light, chance = np.moveaxis(self._memory.read(self.samples), -1, 0)
            self.found.append((light, self.meetings(light, chance)))
        self.seen = state

    def meetings(self, light: np.ndarray, chance: np.ndarray) -> np.ndarray:
        """How many samples of the picture meet light that is as rare as that of each sample, for one sample per pixel.

        Args:
            light: E. chance: P; both (SAMPLES, rows, columns).
        """
        is_lit = light > 0
        rare_first = np.sort(chance[is_lit].astype(np.float64))
        each = self.pixels / (self.rows * self.columns * SAMPLES)
        return np.where(is_lit, expected(rare_first, ABOUT_AS_RARE * chance, each), np.inf)

    def missed(self, samples: float) -> float:
        """SAFETY · u in the unit of the picture, for a picture with so many samples per pixel."""
        squares = 0.0
        for light, meetings in self.found:
            is_missed = samples * meetings < KNOWN
            squares += float(np.square(np.where(is_missed, light, 0).mean(axis=0, dtype=np.float64)).mean())
        return SAFETY * math.sqrt(squares)


def starting(other: TechniqueCheck, sampler: Any, start: Callable, seed: Any, x: Any, y: Any, k: Any) -> Any:
    """The numbers of the pixel that represents a tile."""
    return start(seed, *other.pixel(x, y), k)


def looking(other: TechniqueCheck, eye_rays: Any, hit_of: Callable, x: Any, y: Any, rng: Any) -> Any:
    """The eye ray of the pixel that represents a tile."""
    return hit_of(*other.pixel(x, y), rng)


def missed_light(renderer: Any) -> float:
    """What the other technique finds in a renderer's picture, and its own does not; 0 if nothing can be missed."""
    scene, crop, integrator = renderer.kernel_scene(), renderer.film.crop, renderer.active
    pixels = (crop[1] - crop[0]) * (crop[3] - crop[2])
    techniques = () if renderer.replaced else other_techniques(scene, integrator, pixels, renderer.rarely_met.suns())
    if not techniques or renderer.samples == 0:
        return 0.0
    if renderer.other is None or renderer.other.is_of != (scene, integrator, crop, techniques):
        renderer.other = TechniqueCheck(renderer.plain_sample_parts(scene, integrator), crop, techniques)
    renderer.other.look(renderer, (renderer._shown, renderer.seed))
    return renderer.other.missed(renderer.samples)
