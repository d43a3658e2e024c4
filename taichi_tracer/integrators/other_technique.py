"""How much light does an estimator miss because it draws its directions with the wrong technique?

An estimator that draws directions only from the lights misses what a narrow lobe reflects, because hardly any of them
falls into the lobe. One that draws them only from the BRDF misses a small lamp. What was never met leaves no trace in
the samples, so that their spread cannot tell of it. But a few samples of the other technique show it at once.

Let the other technique draw ω_i with the density q, and let it find the light E = f_r cos θ_i L / q. It has about one
sample in the solid angle 1/q around ω_i. A sample of the estimator, with the density p, falls there with the
probability P = p / q. If the pixel has n samples, n P of them meet this light.

Such numbers are added up over all pixels of the picture, and over all directions that are about as rare: up to
``ALIKE`` times as probable. If the sum is below ``KNOWN``, the light is most likely missing everywhere. With E_ik of
the samples k = 1 … K of pixel i that are so rare, and 0 instead of the others, the mean square error grows by

    u² = (1/N) Σ_i ((1/K) Σ_k E_ik)².

Not even the other technique need find a small sun in a lobe that is much narrower. Its near misses are counted, and
bound what both may miss: see ``picture.unseen_light``.

Only the surfaces that eye rays hit are looked at. Estimators that use both techniques miss nothing in this way, and
nothing is done or compiled for them.

Both densities are those of multiple importance sampling: Veach & Guibas, "Optimally combining sampling techniques for
Monte Carlo rendering", SIGGRAPH 1995.
"""

import math

import numpy as np
import taichi as ti
import taichi.math as tm

from taichi_tracer.integrators.next_event import light_along, sample_of_lights
from taichi_tracer.lights.near_misses import begin_counting, counter_for
from taichi_tracer.picture.pixel_sums import is_finite
from taichi_tracer.picture.unseen_light import KNOWN, unseen_light

SAMPLES = 4  # of the other technique, in each pixel that is looked at
MOST = 128  # pixels along each side that are looked at; of larger pictures, one pixel of each tile
ALIKE = 4.0  # directions that are up to so many times as probable are counted together
SAFETY = 1.2  # times u: the tiles and the few samples of a pixel make u rough
SEED = 0x85EBCA6B  # combined with the seed of the picture, so that these samples are not its own
SPHERE = 4 * math.pi  # the solid angle of all directions


class BothTechniques:
    """What ``NearMissCounter`` must know of these samples: it counts only narrow lobes, and what mirrors find."""

    samples_lights, samples_brdf = True, True


def other_techniques(scene, integrator, pixels: int) -> tuple[str, ...]:
    """The techniques, "brdf" or "lights", that find light which an integrator may never meet.

    Args:
        scene: a ``SceneInKernels``. pixels: of the picture.
    """
    if not (integrator.needs_light and scene.effects.samples_lights):
        return ()
    found = []
    geometry = scene.geometry
    if not integrator.samples_brdf and scene.material_library.has_narrow_lobes(geometry.mesh.used_materials()):
        found.append("brdf")
    # Bright spots of an environment are known by near misses (``lights.near_misses``).
    if not integrator.samples_lights and scene.lights.has_lamps:
        size = float((geometry.high - geometry.low).max())
        if pixels * scene.lights.lamps.table.areas.sum() < KNOWN * SPHERE * size * size:
            found.append("lights")
    return tuple(found)


@ti.data_oriented
class OtherTechnique:
    """What the other technique finds in a picture.

    Args:
        scene, integrator, sampler, eye_rays: of the picture: a ``SceneInKernels`` and three parts.
        crop: (x0, x1, y0, y1), the pixels of the picture.
        techniques: of ``other_techniques``.
    """

    def __init__(self, scene, integrator, sampler, eye_rays, crop, techniques: tuple[str, ...]) -> None:
        self.is_of = scene, integrator, crop, techniques
        self.scene, self.sampler, self.eye_rays, self.techniques = scene, sampler, eye_rays, techniques
        self.knows_lights, self.knows_brdf = integrator.samples_lights, integrator.samples_brdf
        x0, x1, self.x0, self.y0 = crop[0], crop[1], crop[0], crop[2]
        size = x1 - x0, crop[3] - crop[2]
        self.step = math.ceil(max(size) / MOST)
        self.columns, self.rows = (-(-n // self.step) for n in size)
        self.pixels = size[0] * size[1]
        self.near_misses = counter_for(scene, self.columns, self.rows) if "brdf" in techniques else None
        self.seen: object = None  # the state of the picture at which it was looked
        self.found: list[tuple[np.ndarray, np.ndarray]] = []

    def look(self, state: object, seed: int) -> None:
        """Take the samples of the present state of the picture, unless they were taken already."""
        if state == self.seen:
            return
        self.scene.lights.prepare()
        self.found = []
        if self.near_misses is not None:
            self.near_misses.clear()
        for technique in self.techniques:
            light, chance = (np.zeros((SAMPLES, self.rows, self.columns), np.float32) for _ in range(2))
            from_brdf = technique == "brdf"
            near_misses = self.near_misses if from_brdf else None
            self._sample(self.scene, from_brdf, near_misses, (seed ^ SEED) % 2**32, light, chance)
            self.found.append((light, self.meetings(light, chance)))
        self.seen = state

    @ti.kernel
    def _sample(
        self,
        scene: ti.template(),
        from_brdf: ti.template(),
        near_misses: ti.template(),
        seed: ti.u32,
        light: ti.types.ndarray(dtype=ti.f32, ndim=3),
        chance: ti.types.ndarray(dtype=ti.f32, ndim=3),
    ):
        for row, column in ti.ndrange(self.rows, self.columns):
            x, y = self.x0 + column * self.step, self.y0 + row * self.step
            for k in range(SAMPLES):
                begin_counting(near_misses, column, row, BothTechniques)
                rng = self.sampler.start(seed, x, y, ti.cast(k, ti.u32))
                ray, hit = self.eye_rays.hit_of(x, y, rng)
                if hit.is_hit:
                    surface = scene.surface_at(ray, hit)
                    if not surface.is_delta():
                        value, p, q = self.other_sample(scene, surface, rng, from_brdf)
                        if q > 0 and is_finite(value):
                            light[k, row, column] = ti.cast(tm.sqrt(tm.dot(value, value) / 3), ti.f32)
                            chance[k, row, column] = ti.cast(p / q, ti.f32)

    @ti.func
    def other_sample(self, scene: ti.template(), surface, rng, from_brdf: ti.template()):
        """(E, p, q) of one sample of the other technique."""
        value, p, q = tm.vec3(0), 1 / SPHERE, 0.0
        if ti.static(from_brdf):
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

    def meetings(self, light: np.ndarray, chance: np.ndarray) -> np.ndarray:
        """How many samples of the picture meet light that is as rare as that of each sample, for one sample per pixel.

        Args:
            light: E. chance: P; both (SAMPLES, rows, columns).
        """
        is_lit = light > 0
        rare_first = np.sort(chance[is_lit].astype(np.float64))
        if rare_first.size == 0:
            return np.full(light.shape, np.inf)
        each = self.pixels / (self.rows * self.columns * SAMPLES)
        total = np.concatenate([[0.0], np.cumsum(rare_first) * each])
        found = total[np.searchsorted(rare_first, ALIKE * chance, side="right")]
        return np.where(is_lit, found, np.inf)

    def missed(self, samples: float) -> float:
        """SAFETY · u in the unit of the picture, for a picture with so many samples per pixel; u² has near misses."""
        near = None if self.near_misses is None else self.near_misses.counts()
        squares = (unseen_light(near, SAMPLES, mean=1.0) / SAFETY) ** 2
        for light, meetings in self.found:
            is_missed = samples * meetings < KNOWN
            squares += float(np.square(np.where(is_missed, light, 0).mean(axis=0, dtype=np.float64)).mean())
        return SAFETY * math.sqrt(squares)
