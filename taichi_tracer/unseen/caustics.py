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
import taichi as ti
import taichi.math as tm

from taichi_tracer.ray import Ray
from taichi_tracer.system import runtime
from taichi_tracer.unseen.rare_light import RareLight, none_in
from taichi_tracer.unseen.small_lamps import area_of_pixel, corners_of, pixels_of, radiance_of, sees

RAYS = 1 << 16
MOST_MIRRORS = 8  # that a ray follows
SEED = 0xCA05  # of these rays: they are the same for every picture of a scene
BESIDE = 1e-5  # of the size of the scene: so far from its lamp does a ray start
NUMBERS = 6  # of what a ray has found, see ``_trace``


def has_caustics(scene: Any, integrator: Any) -> bool:
    """Whether an integrator's paths can find a lamp over a mirror or glass behind a rough surface.

    Args:
        scene: a ``SceneInKernels``.
    """
    settings = getattr(integrator, "settings", None)
    if settings is None or not scene.lights.has_lamps or not scene.effects.scatters or settings["max_bounces"] < 2:
        return False
    return any(scene.material_library.brdfs[i].is_delta for i in scene.effects.brdfs)


def rays_from(scene_data: Any, rng: np.random.Generator) -> tuple[np.ndarray, np.ndarray, np.ndarray, float]:
    """Rays from the lamps, in proportion to what these emit, with the cosine of the angle to the normal.

    Returns:
        The number of the lamp of each ray; origins and directions, in the running precision; and the power of a ray, as
        the root mean square of the channels.
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
    dtype = runtime.dtype()
    origins = (points + BESIDE * size * normals).astype(dtype)
    return lamp, origins, directions.astype(dtype), float(emitted.sum()) / RAYS


def unit(vectors: np.ndarray) -> np.ndarray:
    """The vectors with the length 1."""
    return vectors / np.linalg.norm(vectors, axis=1, keepdims=True)


@ti.data_oriented
class CausticTracer:
    """Sends rays from the lamps of a scene.

    Args:
        scene: a ``SceneInKernels``.
    """

    def __init__(self, scene: Any) -> None:
        self.scene = scene

    def light(self, scene_data: Any, camera: Any, crop: tuple[int, ...], integrator: Any) -> RareLight:
        """The caustics that a view shows."""
        x0, x1, y0, y1 = crop
        pixels = (x1 - x0) * (y1 - y0)
        rng = np.random.default_rng(SEED)
        lamp, origins, directions, power = rays_from(scene_data, rng)
        random = rng.random((RAYS, MOST_MIRRORS, 2), np.float32)
        landed = np.zeros((RAYS, NUMBERS), origins.dtype)
        most = min(MOST_MIRRORS, int(integrator.settings["max_bounces"]) - 1)
        eye = np.asarray(camera.compute_matrix(), np.float64)
        to_eye = [*(-eye[:3, 2] if camera.is_parallel else eye[:3, 3]), 0.0 if camera.is_parallel else 1.0]
        self._trace(origins, directions, random, landed, most, tm.vec4(*map(float, to_eye)))
        found = np.flatnonzero(landed[:, 5] > 0)
        if found.size == 0:
            return none_in(pixels)
        points = landed[found, :3].astype(np.float64)
        with np.errstate(all="ignore"):
            place, covered = pixels_of(camera, points), area_of_pixel(camera, points)
            at = np.floor(place + 0.5)
        shown = np.flatnonzero(((at >= (x0, y0)) & (at < (x1, y1))).all(axis=1) & (covered > 0))
        shown = shown[sees(scene_data, camera, place[shown], points[shown])]
        ray, at = found[shown], at[shown]
        light = power * landed[ray, 3] * landed[ray, 4] / covered[shown]
        chance = light / (landed[ray, 5] * radiance_of(scene_data)[lamp[ray]])
        number = (at[:, 0] - x0 + (x1 - x0) * (at[:, 1] - y0)).astype(np.int64)
        # What comes from a large lamp is found soon, and says nothing of a small one: each lamp counts by itself.
        pairs, row = np.unique(number * len(scene_data.lamps.table) + lamp[ray], return_inverse=True)
        of_lamp = np.bincount(row, chance, len(pairs)), np.bincount(row, light, len(pairs))
        return RareLight(pairs // len(scene_data.lamps.table), *of_lamp, pixels)

    @ti.kernel
    def _trace(
        self,
        origins: ti.types.ndarray(ndim=2),
        directions: ti.types.ndarray(ndim=2),
        random: ti.types.ndarray(ndim=3),
        landed: ti.types.ndarray(ndim=2),
        most: ti.i32,
        eye: tm.vec4,
    ):
        """Follow the rays. ``landed``: the point (3), T, f_r cos θ, and π f_r T, which is 0 if nothing was found."""
        for i in range(origins.shape[0]):
            ray = Ray(
                origin=tm.vec3(origins[i, 0], origins[i, 1], origins[i, 2]),
                direction=tm.vec3(directions[i, 0], directions[i, 1], directions[i, 2]),
            )
            hit = self.scene.ray_intersector.query_segment(ray, 0.0, tm.inf)
            T, mirrors, is_going = tm.vec3(1), 0, hit.is_hit
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
                elif mirrors > 0 and not surface.is_delta():
                    to_eye = tm.normalize(eye.xyz - eye.w * hit.position)
                    f = surface.eval(to_eye)
                    cosine = tm.dot(surface.normal, to_eye)
                    if cosine > 0:
                        for k in ti.static(range(3)):
                            landed[i, k] = hit.position[k]
                        landed[i, 3] = tm.sqrt(tm.dot(T, T) / 3)
                        landed[i, 4] = tm.sqrt(tm.dot(f, f) / 3) * cosine
                        landed[i, 5] = tm.pi * tm.sqrt(tm.dot(f * T, f * T) / 3)
