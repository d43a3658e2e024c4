"""What a renderer's samples find rarely, and have perhaps not found at all: small lamps, their images, and caustics."""

from typing import Any

import numpy as np

from taichi_tracer.unseen.caustics import caustics, has_caustics
from taichi_tracer.unseen.mirror_chains import MirrorChains, has_mirrors
from taichi_tracer.unseen.mirrored_lamps import mirrored_lamps
from taichi_tracer.unseen.rare_light import RareLight, rows_of
from taichi_tracer.unseen.small_lamps import small_lamps

SAFETY = 1.2  # times light of which only some thousand rays are known


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
        found = [(1.0, small_lamps(scene, camera, crop, self._chains.intersect)), (SAFETY, mirrored_lamps(*view))]
        if has_caustics(kernel_scene, bounces):
            found.append((SAFETY, caustics(*view)))
        return found
