"""How much light may a picture miss that none of its samples met?

An estimate from samples cannot know a small lamp that no sample has met. But the scene is known. Each file of this
folder has one reason for which samples miss light. It finds this light in numpy, or with a small kernel of its own: a
sample of pixel i finds it with the probability P, and it adds E to the pixel on average. What ``rare_light`` makes of
these numbers is added to the upper end of the error.
"""

from typing import Any

import numpy as np

from taichi_tracer.unseen.caustics import caustics, has_caustics
from taichi_tracer.unseen.mirror_chains import MirrorChains, has_mirrors
from taichi_tracer.unseen.mirrored_lamps import mirrored_lamps
from taichi_tracer.unseen.rare_light import RareLight, rows_of
from taichi_tracer.unseen.small_lamps import small_lamps
from taichi_tracer.unseen.small_suns import Sun, small_suns, suns_of

OF_FEW_RAYS = 1.2  # times light of which only some thousand rays are known


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
        self._suns_of: tuple = ()  # the scene and the state of the environment whose suns they are
        self._suns: list[Sun] = []

    def suns(self) -> list[Sun]:
        """The suns of the scene."""
        scene, environment = self.renderer.kernel_scene(), self.renderer.scene_data.environment
        state = scene, environment and environment.version
        if self._suns_of != state:
            self._suns_of, self._suns = state, suns_of(scene)
        return self._suns

    def rows(self) -> np.ndarray:
        """All of it, see ``rare_light.rows_of``; no rows if samples find everything."""
        renderer = self.renderer
        if not renderer.shows_light or renderer.replaced:
            return rows_of([])
        if renderer.scene_data.lamps.count == 0 and not self.suns():
            return rows_of([])
        if self._of != renderer._shown:
            self._of, self._found = renderer._shown, self._find()
        return rows_of(self._found)

    def _find(self) -> list[tuple[float, RareLight]]:
        renderer = self.renderer
        scene, camera, crop = renderer.scene_data, renderer.camera, renderer.film.crop
        kernel_scene, suns = renderer.kernel_scene(), self.suns()
        is_mirroring = has_mirrors(kernel_scene)
        if is_mirroring and (self._chains is None or self._chains.scene is not kernel_scene):
            self._chains = MirrorChains(kernel_scene)
        intersect = self._chains.intersect if is_mirroring else scene.intersect
        found = [
            (1.0, small_lamps(scene, camera, crop, intersect)),
            (1.0, small_suns(suns, camera, crop, intersect)),
        ]
        settings = getattr(renderer.active, "settings", None)
        bounces = 1 if settings is None else int(settings["max_bounces"])
        view = self._chains, scene, camera, crop, bounces
        if is_mirroring:
            found.append((OF_FEW_RAYS, mirrored_lamps(*view, suns)))
        if has_caustics(kernel_scene, bounces):
            found.append((OF_FEW_RAYS, caustics(*view)))
        return found
