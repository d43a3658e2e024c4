"""How much light may a picture miss that none of its samples met?

An estimate from samples cannot know a small lamp that no sample has met. But the scene is known. Each file of this
folder has one reason for which samples miss light. It finds this light in numpy, or with a small kernel of its own: a
sample of pixel i finds it with the probability P, and it adds E to the pixel on average. What ``rare_light`` makes of
these numbers is added to the upper end of the error.
"""

from typing import Any

import numpy as np

from taichi_tracer.unseen.caustics import caustics, has_caustics
from taichi_tracer.unseen.mirror_chains import has_mirrors
from taichi_tracer.unseen.mirrored_lamps import mirrored_lamps
from taichi_tracer.unseen.rare_light import of_kinds
from taichi_tracer.unseen.small_lamps import small_lamps
from taichi_tracer.unseen.small_suns import Sun, small_suns, suns_of
from taichi_tracer.unseen.technique_check import look, missed


class UnseenLight:
    """The light that samples of a renderer's picture find rarely or never, which is found once for each view.

    Args:
        renderer: a ``ProgressiveRenderer``.
    """

    def __init__(self, renderer: Any) -> None:
        self.renderer = renderer
        self._of: Any = None  # the state of the picture for which the following were found
        self._suns: list[Sun] = []
        self._rows = of_kinds([])
        self._by_others: list[tuple[np.ndarray, np.ndarray]] | None = None  # see ``technique_check.look``

    def rows(self) -> np.ndarray:
        """The rare light, see ``rare_light.of_kinds``; no rows if samples find everything."""
        renderer = self.renderer
        if self._of != renderer._shown:
            is_light = renderer.shows_light and not renderer.replaced
            self._of, self._by_others = renderer._shown, None
            self._suns = suns_of(renderer.kernel_scene()) if is_light else []
            has_sources = is_light and (renderer.scene_data.lamps.count > 0 or len(self._suns) > 0)
            self._rows = of_kinds(self._find() if has_sources else [])
        return self._rows

    def _find(self) -> list[np.ndarray]:
        renderer, scene = self.renderer, self.renderer.kernel_scene()
        view = renderer.scene_data, renderer.camera, renderer.film.crop
        found = [small_lamps(*view), small_suns(self._suns, *view)]
        settings = getattr(renderer.active, "settings", None)
        bounces = 1 if settings is None else int(settings["max_bounces"])
        if has_mirrors(scene):
            found.append(mirrored_lamps(scene, *view, bounces, self._suns))
        if has_caustics(scene, bounces):
            found.append(caustics(scene, *view, bounces))
        return found

    def missed_by_technique(self) -> float:
        """What only another technique finds, in the unit of the picture: see ``technique_check``; after ``rows``."""
        if self._by_others is None:
            self._by_others = look(self.renderer, self._suns)
        return missed(self._by_others, self.renderer.samples)
