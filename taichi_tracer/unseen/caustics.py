"""How much light do paths from the eye miss that comes from lamps over mirrors and glass?

Behind a rough surface, a path finds such a *caustic* only if it goes by chance over the mirror or the glass to the
lamp. If the lamp is small, that is rare, and what no path has found leaves no trace in the samples. But rays *from* the
lamps find caustics at once: Arvo, "Backward ray tracing", SIGGRAPH course 1986.

Some thousand rays start at the lamps, in proportion to what these emit: each carries the power Φ. Where one of them
meets a rough surface after one or more mirrors or glasses, and where the eye sees this point in pixel i, it adds

    E = Φ T f_r cos θ / F

to the pixel: T is what the mirrors and glasses leave of the light, f_r the BRDF towards the eye, θ the angle between
the normal and the direction to the eye, and F the area at this distance that a pixel covers, across the ray. A path
that finds this light sees about V = π f_r T L, where L is the radiance of the lamp. So a sample finds it with the
probability P = E / V: see ``rare_light``.

Nothing of this is compiled unless a scene has lamps, and mirrors or glass, and paths of two bounces or more.
"""

from typing import Any

import numpy as np

from taichi_tracer.unseen.mirror_chains import OF_FEW_RAYS, RAYS, follow, has_mirrors
from taichi_tracer.unseen.rare_light import rows_of
from taichi_tracer.unseen.small_lamps import OFF, area_of_pixel, corners_of, look, pixel_numbers, pixels_of, radiance_of

SEED = 0xCA05  # of these rays: they are the same for every picture of a scene
BESIDE = 1e-5  # of the size of the scene: so far from its lamp does a ray start


def has_caustics(scene: Any, max_bounces: int) -> bool:
    """Whether paths can find a lamp over a mirror or glass behind a rough surface, in a ``SceneInKernels``."""
    return max_bounces >= 2 and scene.effects.scatters and scene.lights.has_lamps and has_mirrors(scene)


def rays_from(scene_data: Any, rng: "np.random.Generator") -> tuple[np.ndarray, np.ndarray, np.ndarray, float]:
    """Rays from the lamps, in proportion to what these emit, with the cosine of the angle to the normal.

    Returns:
        The number of the lamp of each ray; origins and directions; and the power of a ray, as the root mean square of
        the channels.
    """
    table, radiance = scene_data.lamps.table, radiance_of(scene_data)
    emitted = np.pi * table.areas * radiance * np.where(table.two_sided & (table.primitives >= 0), 2, 1)
    lamp = rng.choice(len(table), RAYS, p=emitted / emitted.sum())
    corners, normals = corners_of(scene_data.geometry.mesh, table, None)[lamp], table.normals[lamp].copy()
    u, v = np.sort(rng.random((2, RAYS)), axis=0)
    points = corners[:, 0] * u[:, None] + corners[:, 1] * (v - u)[:, None] + corners[:, 2] * (1 - v)[:, None]
    is_sphere = table.primitives[lamp] < 0
    outward = unit(rng.normal(size=(RAYS, 3)))
    normals[is_sphere] = outward[is_sphere]
    radius = (table.high - table.low)[lamp, :1] / 2
    points[is_sphere] = (corners[:, 0] + radius * outward)[is_sphere]
    normals *= np.where(table.two_sided & ~is_sphere & (rng.random(RAYS) < 0.5), -1, 1)[:, None]
    # A point of the unit sphere around the tip of the normal: its direction has the density cos θ / π.
    directions = unit(normals + (1 - 1e-6) * unit(rng.normal(size=(RAYS, 3))))
    size = np.ptp(scene_data.geometry.mesh.vertices, axis=0).max(initial=0.0)
    return lamp, points + BESIDE * size * normals, directions, float(emitted.sum()) / RAYS


def unit(vectors: np.ndarray) -> np.ndarray:
    """The vectors with the length 1."""
    return vectors / np.linalg.norm(vectors, axis=1, keepdims=True)


def caustics(scene: Any, scene_data: Any, camera: Any, crop: tuple[int, ...], max_bounces: int) -> np.ndarray:
    """Rows of the caustics that a view shows.

    Args:
        scene: the ``SceneInKernels`` of ``scene_data``.
        crop: (x0, x1, y0, y1), the pixels of the picture. max_bounces: of its paths.
    """
    rng = np.random.default_rng(SEED)
    lamp, origins, directions, power = rays_from(scene_data, rng)
    ends = follow(scene, origins, directions, camera, max_bounces - 1, rng)
    lit = np.flatnonzero(ends.f_T > 0)
    points = ends.origin[lit] + ends.distance[lit, None] * ends.direction[lit]
    with np.errstate(all="ignore"):
        place, covered = pixels_of(camera, points), area_of_pixel(camera, points)
        number, is_inside = pixel_numbers(place, crop)
    shown = np.flatnonzero(is_inside & (covered > 0))
    hits, leads, along = look(scene_data, camera, place[shown], points[shown])
    shown = shown[hits.is_hit & leads & (abs(hits.distance - along) < OFF * abs(along))]  # nothing is before the point
    end, of = lit[shown], lamp[ends.ray[lit[shown]]]
    light = power * ends.T[end] * ends.f_cos[end] / covered[shown]
    chance = light / (np.pi * ends.f_T[end] * radiance_of(scene_data)[of])
    # What comes from a large lamp is found soon, and says nothing of a small one: each lamp counts by itself.
    lamps = len(scene_data.lamps.table)
    pairs, row = np.unique(number[shown] * lamps + of, return_inverse=True)
    chances, lights = (np.bincount(row, of_pairs, len(pairs)) for of_pairs in (chance, light))
    return rows_of(pairs // lamps, chances, OF_FEW_RAYS * lights)
