"""How much light does a picture miss because a mirror or glass shows a lamp as less than a pixel?

A sample meets such an image of a lamp with the probability P, which is the share of the pixel that the image covers; it
shows T L, where T is what the mirrors and glasses leave of the radiance L. How large the image is, rays tell that pass
*near* the lamp. Some thousand eye rays go through the pixels that show a mirror or glass, and follow it. Around a lamp
of the area A, which such a ray sees at the angle θ from the distance t, lies a disc with the radius R = t · ``NEAR``.
If a mirror is about flat for such small angles, the share of the rays that meet the lamp is that of the rays that pass
the disc, times A cos θ / (π R²). So each ray that passes it stands for

    P = (pixels / rays) A cos θ / (π R²),      E = P T L

of an image: see ``rare_light``. All that a material shows of a lamp counts as one image. This is rather too much.
"""

import math
from typing import Any

import numpy as np
import taichi as ti
import taichi.math as tm

from taichi_tracer.ray import Ray
from taichi_tracer.unseen.caustics import MOST_MIRRORS, RAYS
from taichi_tracer.unseen.rare_light import RareLight, none_in
from taichi_tracer.unseen.small_lamps import radiance_of

NEAR = 0.1  # radians around a lamp
SEED = 0x313A
MOST_LAMPS = 256  # the most powerful ones
MOST_PIXELS = 1 << 18  # that are asked for mirrors
NUMBERS = 9  # of what a ray has found, see ``_follow``


def has_mirrors(scene: Any) -> bool:
    """Whether a scene has lamps, and mirrors or glass. ``scene`` is a ``SceneInKernels``."""
    return scene.lights.has_lamps and any(scene.material_library.brdfs[i].is_delta for i in scene.effects.brdfs)


@ti.data_oriented
class MirrorTracer:
    """Follows eye rays over mirrors and glass.

    Args:
        scene: a ``SceneInKernels``.
    """

    def __init__(self, scene: Any) -> None:
        self.scene = scene

    def light(self, scene_data: Any, camera: Any, crop: tuple[int, ...], max_bounces: int) -> RareLight:
        """The images of lamps that a view shows in mirrors and glass."""
        x0, x1, y0, y1 = crop
        pixels, rng = (x1 - x0) * (y1 - y0), np.random.default_rng(SEED)
        places, stands_for = self._mirror_pixels(scene_data, camera, crop, rng)
        if len(places) == 0:
            return none_in(pixels)
        chosen = places[rng.integers(0, len(places), RAYS)]
        at = chosen + rng.random((RAYS, 2)) - 0.5
        origins, directions = camera.rays(at[:, 0], at[:, 1])
        ends = np.zeros((RAYS, NUMBERS), origins.dtype)
        random = rng.random((RAYS, MOST_MIRRORS, 2), np.float32)
        self._follow(origins, directions, random, ends, min(MOST_MIRRORS, max_bounces))
        ends, chosen = ends[ends[:, 7] > 0].astype(np.float64), chosen[ends[:, 7] > 0]
        rows = []
        table, radiance = scene_data.lamps.table, radiance_of(scene_data)
        for lamp in np.argsort(-table.areas * radiance)[:MOST_LAMPS]:
            ray, share = near(ends, table, lamp)
            chance = share * stands_for / RAYS
            number = (chosen[ray, 0] - x0 + (x1 - x0) * (chosen[ray, 1] - y0)).astype(np.int64)
            for material in np.unique(ends[ray, 8]):
                own = ends[ray, 8] == material
                most = number[own][chance[own].argmax()]
                rows.append((most, chance[own].sum(), (chance[own] * ends[ray, 7][own]).sum() * radiance[lamp]))
        found = np.array(rows, np.float64).reshape(-1, 3)
        found = found[(found[:, 1] < 1) & (found[:, 1] > 0)]
        return RareLight(found[:, 0].astype(np.int64), found[:, 1], found[:, 2], pixels)

    def _mirror_pixels(self, scene_data: Any, camera: Any, crop: tuple[int, ...], rng: Any) -> tuple[np.ndarray, float]:
        """(n, 2) pixels whose middle shows a mirror or glass, and how many pixels these stand for."""
        x0, x1, y0, y1 = crop
        y, x = np.mgrid[y0:y1, x0:x1]
        places = np.stack([x.ravel(), y.ravel()], axis=1)
        count = len(places)
        if count > MOST_PIXELS:
            places = places[rng.choice(count, MOST_PIXELS, replace=False)]
        hits = scene_data.intersect(*camera.rays(places[:, 0], places[:, 1]))
        library = scene_data.material_library
        is_delta = np.array([library.brdfs[i].is_delta for i in library.brdf_of])
        found = places[hits.is_hit & is_delta[np.maximum(hits.material_id, 0)]]
        return found, len(found) * count / len(places)

    @ti.kernel
    def _follow(
        self,
        origins: ti.types.ndarray(ndim=2),
        directions: ti.types.ndarray(ndim=2),
        random: ti.types.ndarray(ndim=3),
        ends: ti.types.ndarray(ndim=2),
        most: ti.i32,
    ):
        """Follow the rays. ``ends``: where the last one starts (3), its direction (3), how far it goes, T, and the
        material of the first mirror. T is 0 if there is none."""
        for i in range(origins.shape[0]):
            ray = Ray(
                origin=tm.vec3(origins[i, 0], origins[i, 1], origins[i, 2]),
                direction=tm.vec3(directions[i, 0], directions[i, 1], directions[i, 2]),
            )
            hit = self.scene.ray_intersector.query_segment(ray, 0.0, tm.inf)
            T, mirrors, is_going = tm.vec3(1), 0, hit.is_hit
            ends[i, 8] = hit.material_id
            while is_going:
                surface = self.scene.surface_at(ray, hit)
                is_going = surface.is_delta() and mirrors < most
                if is_going:
                    w_i = surface.sample(tm.vec2(random[i, mirrors, 0], random[i, mirrors, 1]))
                    T *= surface.weight(w_i)
                    mirrors += 1
                    ray = surface.ray_along(w_i)
                    hit = self.scene.met(surface, ray)
                    is_going = hit.is_hit and T.max() > 0
            if mirrors > 0:
                for k in ti.static(range(3)):
                    ends[i, k], ends[i, 3 + k] = ray.origin[k], ray.direction[k]
                ends[i, 6] = ti.select(hit.is_hit, hit.distance, tm.inf)
                ends[i, 7] = tm.sqrt(tm.dot(T, T) / 3)


def near(ends: np.ndarray, table: Any, lamp: int) -> tuple[np.ndarray, np.ndarray]:
    """Which rays pass near a lamp that they might meet, and the share of them that meets it: A cos θ / (π R²).

    Args:
        ends: of ``MirrorTracer._follow``.
    """
    centre, size = (table.low[lamp] + table.high[lamp]) / 2, np.linalg.norm(table.high[lamp] - table.low[lamp]) / 2
    direction = ends[:, 3:6]
    to = centre - ends[:, :3]
    along = (to * direction).sum(axis=1)
    beside = np.linalg.norm(to - along[:, None] * direction, axis=1)
    radius = np.maximum(NEAR * along, size)
    # What ends before the lamp is hidden from it; the lamp itself, and what it lies on, may be a little nearer.
    ray = np.flatnonzero((along > 0) & (beside < radius) & (ends[:, 6] > along - radius - size))
    is_sphere = table.primitives[lamp] < 0
    cosine = np.full(len(ray), 0.25) if is_sphere else -(direction[ray] @ table.normals[lamp])
    cosine = abs(cosine) if table.two_sided else np.maximum(cosine, 0)
    share = np.minimum(1, table.areas[lamp] * cosine / (math.pi * radius[ray] ** 2))
    return ray[share > 0], share[share > 0]
