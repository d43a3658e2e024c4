"""Albedo and texture coordinates of the surfaces that rays hit."""

from dataclasses import dataclass
from typing import Any

import numpy as np
import taichi as ti
import taichi.math as tm

from taichi_tracer.ray import RayHits, no_hit


@dataclass
class AlbedoUv:
    """Arrays with one row per ray, 0 for a ray that hits nothing.

    Attributes:
        uv: (n, 2) where the texture is looked up, not only its fractional part; 0 in a scene without textures.
        albedo: (n, 3) linear Kd with its texture and the colours of vertices.
    """

    uv: np.ndarray
    albedo: np.ndarray


def albedo_uv_of(scene: Any, hits: RayHits) -> AlbedoUv:
    """Albedo and uv of the surfaces that rays hit, in the precision of ``hits``; ``scene`` is a ``SceneInKernels``."""
    n, dtype = len(hits), hits.distance.dtype
    looks = AlbedoUv(np.zeros((n, 2), dtype), np.zeros((n, 3), dtype))
    if n > 0:
        inputs = (hits.triangle_id, hits.material_id, hits.barycentric_coords)
        _look_up(scene, *map(np.ascontiguousarray, inputs), looks.uv, looks.albedo)
    return looks


@ti.kernel
def _look_up(
    scene: ti.template(),
    triangle_ids: ti.types.ndarray(ndim=1),
    material_ids: ti.types.ndarray(ndim=1),
    barycentric: ti.types.ndarray(ndim=2),
    uv: ti.types.ndarray(ndim=2),
    albedo: ti.types.ndarray(ndim=2),
):
    for i in range(triangle_ids.shape[0]):
        hit = no_hit()
        hit.triangle_id, hit.material_id = triangle_ids[i], material_ids[i]
        hit.barycentric_coords = tm.vec2(barycentric[i, 0], barycentric[i, 1])
        if hit.triangle_id >= 0:
            color = scene.material_at(hit).Kd
            for k in ti.static(range(3)):
                albedo[i, k] = color[k]
            if ti.static(scene.effects.textures):
                place = scene.textures.coordinates_at(hit)
                for k in ti.static(range(2)):
                    uv[i, k] = place[k]
