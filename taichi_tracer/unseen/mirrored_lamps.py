"""How much light does a picture miss because a mirror or glass shows a lamp or a sun as less than a pixel?

A sample meets such an image of a lamp with the probability P, which is the share of the pixel that the image covers; it
shows T L, where T is what the mirrors and glasses leave of the radiance L. How large the image is, rays tell that pass
*near* the lamp. Some thousand eye rays go through the pixels that show a mirror or glass, and follow it. Around a lamp
of the area A, which such a ray sees at the angle θ from the distance t, lies a disc with the radius R = t · ``NEAR``.
If a mirror is about flat for such small angles, the share of the rays that meet the lamp is that of the rays that pass
the disc, times A cos θ / (π R²). So each ray that passes it represents

    P = (pixels / rays) A cos θ / (π R²),      E = P T L

of an image: see ``rare_light``. All that a material shows of a lamp counts as one image. This is rather too much. For a
sun, A cos θ / (π R²) is its share of the directions that are near to it, see ``small_suns``.
"""

import math
from typing import Any

import numpy as np

from taichi_tracer.unseen.mirror_chains import OF_FEW_RAYS, RAYS, Ends, follow, mirrors_of
from taichi_tracer.unseen.rare_light import NONE
from taichi_tracer.unseen.small_lamps import radiance_of
from taichi_tracer.unseen.small_suns import Sun

NEAR = 0.1  # radians around a lamp
SEED = 0x313A
MOST_LAMPS = 256  # the most powerful ones
MOST_PIXELS = 1 << 18  # that are asked for mirrors


def mirrored_lamps(
    scene: Any, scene_data: Any, camera: Any, crop: tuple[int, ...], max_bounces: int, suns: list[Sun]
) -> np.ndarray:
    """Rows of the images of lamps and suns that a view shows in mirrors and glass.

    Args:
        scene: the ``SceneInKernels`` of ``scene_data``.
        crop: (x0, x1, y0, y1), the pixels of the picture. max_bounces: of its paths; 1 for direct light.
    """
    x0, x1, y0, y1 = crop
    rng = np.random.default_rng(SEED)
    places, stands_for = mirror_pixels(scene, scene_data, camera, crop, rng)
    if len(places) == 0:
        return NONE
    chosen = places[rng.integers(0, len(places), RAYS)]
    at = chosen + rng.random((RAYS, 2)) - 0.5
    ends = follow(scene, *camera.rays(at[:, 0], at[:, 1]), camera, max_bounces, rng)
    number = (chosen[ends.ray] - (x0, y0)) @ (1, x1 - x0)
    rows = []
    table, radiance = scene_data.lamps.table, radiance_of(scene_data)
    lamps = np.argsort(-table.areas * radiance)[:MOST_LAMPS]
    shown = [(share_of_lamp(ends, table, lamp), radiance[lamp]) for lamp in lamps]
    misses = np.isinf(ends.distance)
    shown += [(sun.share * (misses & sun.is_near(ends.direction)), sun.radiance.max()) for sun in suns]
    for share, L in shown:
        for material in np.unique(ends.material[share > 0]):
            own = (share > 0) & (ends.material == material)
            chance = share[own] * stands_for / RAYS
            rows.append((number[own][chance.argmax()], chance.sum(), OF_FEW_RAYS * (chance * ends.T[own]).sum() * L))
    found = np.array(rows, np.float64).reshape(-1, 3)
    return found[found[:, 1] < 1]


def mirror_pixels(
    scene: Any, scene_data: Any, camera: Any, crop: tuple[int, ...], rng: Any
) -> tuple[np.ndarray, float]:
    """(n, 2) pixels whose middle shows a mirror or glass, and how many pixels these represent."""
    x0, x1, y0, y1 = crop
    y, x = np.mgrid[y0:y1, x0:x1]
    all_places = rng.permutation(np.stack([x.ravel(), y.ravel()], axis=1))
    places = all_places[:MOST_PIXELS]
    hits = scene_data.intersect(*camera.rays(places[:, 0], places[:, 1]))
    is_mirror = mirrors_of(scene)
    found = places[hits.is_hit & is_mirror[np.clip(hits.material_id, 0, len(is_mirror) - 1)]]
    return found, len(found) * len(all_places) / len(places)


def share_of_lamp(ends: Ends, table: Any, lamp: int) -> np.ndarray:
    """(n,) which share of rays like each meets a lamp, A cos θ / (π R²); 0 for those that pass far from it."""
    centre, size = (table.low[lamp] + table.high[lamp]) / 2, np.linalg.norm(table.high[lamp] - table.low[lamp]) / 2
    begin, square = (np.einsum("nk,nk->n", one, ends.origin) for one in (ends.direction, ends.origin))
    along = ends.direction @ centre - begin
    beside = np.sqrt(np.maximum(0, square - 2 * (ends.origin @ centre) + centre @ centre - along**2))
    radius = np.maximum(NEAR * along, size)
    # What ends before the lamp is hidden from it; the lamp itself, and what it lies on, may be a little nearer.
    is_near = (along > 0) & (beside < radius) & (ends.distance > along - radius - size)
    cosine = 0.25 if table.primitives[lamp] < 0 else -(ends.direction @ table.normals[lamp])
    cosine = abs(cosine) if table.two_sided else np.maximum(cosine, 0)
    return is_near * np.minimum(1, table.areas[lamp] * cosine / (math.pi * radius**2))
