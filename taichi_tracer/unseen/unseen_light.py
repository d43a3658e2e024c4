"""How much light may a picture miss that none of its samples met?

An estimate from samples cannot know a small sun that no sample has met. But near misses show it
(``unseen.near_misses``). Let B look-ups go into directions D near the sun, of which K met the sun S itself. If the
directions in D are about even, the number of look-ups that should meet the sun is about

    λ = (B + 2) Ω_S / Ω_D.

Ω_S and Ω_D are the solid angles. The 2 is for what B itself could have missed. K counts, too. If more than M look-ups
were missing, it would be improbable that only K met the sun: M is the upper 95 % limit of the mean of a Poisson
distribution, less K. Therefore λ is at most M. And a flat mirror may look beside the sun in all its pixels: then B is
large, and the sun is not in the mirror. If λ is so large that K or fewer would meet the sun with a probability of less
than 0.1 %, the directions are not even, and nothing is added. A look-up that meets the sun adds about c = w L_S / n to
its pixel, if the pixel has n samples, L_S is the radiance of the sun, and w is the reflectance. As long as K is small,
the light λ c may be missing. It lies in N_eff pixels of N, so that it adds to the mean square error

    u² = (λ c)² / (N_eff N).

Eye rays and mirrors find the sun in a single pixel, if they find it at all: N_eff = 1. Lobes find it anywhere where
they look: with B_i of the B look-ups in pixel i, N_eff = B² / Σ B_i (B_i − 1). If K is at least ``KNOWN``, the samples
themselves show the error, and nothing is added.
"""

import math
from collections.abc import Callable
from typing import Any

import numpy as np

from taichi_tracer.system.fields.lru import Lru
from taichi_tracer.unseen import rare_light
from taichi_tracer.unseen.caustics import caustics, has_caustics
from taichi_tracer.unseen.mirror_chains import MirrorChains, has_mirrors
from taichi_tracer.unseen.mirrored_lamps import mirrored_lamps
from taichi_tracer.unseen.near_misses import LOBE, NearMissCounter, NearMisses, counter_for
from taichi_tracer.unseen.rare_light import KNOWN, RareLight, rows_of
from taichi_tracer.unseen.small_lamps import small_lamps

RARE = "rare_light"  # the name of the array in a checkpoint
KEPT_COUNTERS = 8  # going back to an environment that was counted a short time ago compiles nothing
MOST_MISSED = (3.00, 3.74, 4.30, 4.75, 5.15, 5.51, 5.84, 6.15, 6.43, 6.71)  # M, for K from 0 to 9
NOT_EVEN = (6.91, 9.23, 11.23, 13.06, 14.79, 16.45, 18.06, 19.63, 21.16, 22.66)  # the same at 99.9 %, not less K
REFLECTED = 0.6  # of the light, by a surface that shows the sun: a bright one
SAFETY = 4  # times u: so many that the interval holds the truth (``python -m benchmarks.claims``)
OF_FEW_RAYS = 1.2  # times light of which only some thousand rays are known


def unseen_light(near: NearMisses | None, samples: float, mean: float) -> float:
    """The relative RMSE that light may add that no sample met, as a bound: SAFETY · u / mean.

    Args:
        near: what was counted; None if nothing can be missed.
        samples: per pixel. mean: of the picture.
    """
    if near is None or not mean > 0 or samples == 0:
        return 0.0
    pixels = near.per_pixel.size
    b = near.per_pixel.astype(np.float64)
    spread_of_lobes = max(1.0, b.sum() ** 2 / max(1.0, (b * (b - 1)).sum()))
    squares = 0.0
    for (radiance, share), looked, met in zip(near.levels, near.near, near.met, strict=True):
        for kind, (count, hits) in enumerate(zip(looked, met, strict=True)):
            if count > 0 and hits < KNOWN:
                expected = (count + 2) * share
                if expected > NOT_EVEN[int(hits)]:
                    continue
                missing = min(expected, MOST_MISSED[int(hits)]) * REFLECTED * radiance / samples
                squares += missing**2 / ((spread_of_lobes if kind == LOBE else 1.0) * pixels)
    return SAFETY * math.sqrt(squares) / mean


class UnseenLight:
    """What is known of the light that no sample of a picture met. Its arrays are kept and merged with the samples.

    Attributes:
        counter: what counts the near misses of the samples; None if nothing is counted.
        rare: rows of light that samples find rarely, see ``rare_light.rows_of``.
    """

    def __init__(self) -> None:
        self.rare = np.zeros((0, rare_light.COLUMNS))
        self.counter: NearMissCounter | None = None
        self._before: NearMisses | None = None  # of the samples that were loaded or merged
        self._of: Any = None  # the environment of the counter
        self._counters = Lru(KEPT_COUNTERS)

    def begin(self, environment: Any, kernel_scene: Callable[[], Any], width: int, height: int) -> None:
        """Count the near misses of an environment, if light can be missed; None counts nothing.

        Args:
            kernel_scene: gives the ``SceneInKernels`` that has this environment.
        """
        is_over = self.counter is not None and self.counter.is_over()
        if is_over:
            self._counters = Lru(KEPT_COUNTERS)
        if environment is not self._of or is_over:
            self.counter = None
            if environment is not None:
                scene = kernel_scene()
                self.counter = self._counters.get(scene, lambda: counter_for(scene, width, height))
            self._of = environment

    def watched(self, parts: Any) -> Any:
        """The ``SampleParts``, whose scene and sampler call the counter."""
        if self.counter is None:
            return parts
        scene, sampler = self.counter.watched(parts.scene, parts.sampler, parts.integrator)
        return parts._replace(scene=scene, sampler=sampler)

    def counted(self) -> NearMisses | None:
        """The near misses of all samples; None if nothing is counted."""
        return _sum(self._before, None if self.counter is None else self.counter.counts())

    def bound(self, samples: float, mean: float) -> float:
        """``unseen_light`` of what was counted."""
        return unseen_light(self.counted(), samples, mean)

    def reset(self) -> None:
        """Forget what was counted."""
        self._before = None
        self.rare = self.rare[:0]
        if self.counter is not None:
            self.counter.clear()

    def merge(self, other: "UnseenLight") -> None:
        """Add what was counted for other samples."""
        self._before = _sum(self._before, other.counted())
        self.rare = self.rare if len(self.rare) else other.rare

    def to_arrays(self) -> dict[str, np.ndarray]:
        """The arrays of a checkpoint, see ``NearMisses.to_arrays``; none if nothing is counted."""
        counted = self.counted()
        rare = {RARE: self.rare} if len(self.rare) else {}
        return rare if counted is None else rare | counted.to_arrays()

    def from_arrays(self, arrays: dict[str, np.ndarray]) -> None:
        """The inverse of ``to_arrays``."""
        self.reset()
        self._before = NearMisses.from_arrays(arrays)
        self.rare = arrays.get(RARE, self.rare)


def _sum(first: NearMisses | None, second: NearMisses | None) -> NearMisses | None:
    return first if second is None else second if first is None else first + second


class RarelyMet:
    """The rare light of a renderer's picture, which is found once for each view.

    Args:
        renderer: a ``ProgressiveRenderer``.
    """

    def __init__(self, renderer: Any) -> None:
        self.renderer = renderer
        self._of: Any = None  # the state of the picture for which it was found
        self._found: list[tuple[float, RareLight]] = []
        self._chains: MirrorChains | None = None

    def rows(self) -> np.ndarray:
        """All of it, see ``rare_light.rows_of``; no rows if samples find everything."""
        renderer = self.renderer
        if renderer.scene_data.lamps.count == 0 or not renderer.shows_light or renderer.replaced:
            return rows_of([])
        if self._of != renderer._shown:
            self._of, self._found = renderer._shown, self._find()
        return rows_of(self._found)

    def _find(self) -> list[tuple[float, RareLight]]:
        renderer = self.renderer
        scene, camera, crop = renderer.scene_data, renderer.camera, renderer.film.crop
        kernel_scene = renderer.kernel_scene()
        if not has_mirrors(kernel_scene):
            return [(1.0, small_lamps(scene, camera, crop, scene.intersect))]
        if self._chains is None or self._chains.scene is not kernel_scene:
            self._chains = MirrorChains(kernel_scene)
        settings = getattr(renderer.active, "settings", None)
        bounces = 1 if settings is None else int(settings["max_bounces"])
        view = self._chains, scene, camera, crop, bounces
        found = [(1.0, small_lamps(scene, camera, crop, self._chains.intersect)), (OF_FEW_RAYS, mirrored_lamps(*view))]
        if has_caustics(kernel_scene, bounces):
            found.append((OF_FEW_RAYS, caustics(*view)))
        return found
