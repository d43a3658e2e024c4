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
from taichi_tracer.unseen.small_suns import small_suns, suns_of
from taichi_tracer.unseen.technique_check import by_other_techniques


def find_rare_light(renderer: Any) -> np.ndarray:
    """The light that samples of a ``ProgressiveRenderer`` find rarely or never, see ``rare_light.of_kinds``.

    There are no rows if samples find everything, and where somebody's own method makes the picture.
    """
    if not renderer.shows_light or renderer.replaced:
        return of_kinds([])
    scene, view = renderer.kernel_scene(), (renderer.scene_data, renderer.camera, renderer.film.crop)
    suns = suns_of(scene)
    found = by_other_techniques(renderer, suns)
    if suns or renderer.scene_data.lamps.count > 0:
        found += [small_lamps(*view), small_suns(suns, *view)]
        settings = getattr(renderer.active, "settings", None)
        bounces = 1 if settings is None else int(settings["max_bounces"])
        if has_mirrors(scene):
            found.append(mirrored_lamps(scene, *view, bounces, suns))
        if has_caustics(scene, bounces):
            found.append(caustics(scene, *view, bounces))
    return of_kinds(found)
