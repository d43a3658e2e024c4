"""Follows rays over mirrors and glass, and says where they end: for ``caustics`` and ``mirrored_lamps``.

One kernel is compiled for a scene that has lamps or suns, and mirrors or glass. Lobes that are so narrow that hardly
any direction from another density falls into them count as mirrors: only samples of the BRDF find what they reflect.
"""

from typing import Any, NamedTuple

import numpy as np
import taichi as ti

from taichi_tracer.formulas import vector_math as tm
from taichi_tracer.ray import ray_from
from taichi_tracer.system import runtime

# A lobe of a quarter of a degree, as wide as the sun: only samples of the BRDF find what it reflects.
LIKE_MIRROR_FROM = 1e5
RAYS = 1 << 16  # that are followed for each question
MOST_MIRRORS = 8  # on the way of a ray
OF_FEW_RAYS = 1.2  # times light of which only these rays are known
NUMBERS = 11  # of what a ray has found: see ``_follow``


class Ends(NamedTuple):
    """Where rays end that have met a mirror or glass, in float64.

    Attributes:
        ray: (n,) their numbers. origin, direction: (n, 3) of the last part of each. distance: (n,) how far this goes,
            infinite if it hits nothing.
        T: (n,) what the mirrors and glasses leave of the light. material: (n,) of the first of them.
        f_cos, f_T: (n,) f_r cos θ and f_r T of the rough surface at the end, towards the eye; 0 if there is none, or if
            it looks away from the eye. T and these are root mean squares of the channels.
    """

    ray: np.ndarray
    origin: np.ndarray
    direction: np.ndarray
    distance: np.ndarray
    T: np.ndarray
    material: np.ndarray
    f_cos: np.ndarray
    f_T: np.ndarray


def mirrors_of(scene: Any) -> np.ndarray:
    """(materials,) bool: which materials are mirrors, glass, or have lobes that are as narrow."""
    library = scene.material_library
    is_delta = np.array([library.brdfs[i].is_delta for i in library.brdf_of[scene.microfacets]])
    return is_delta | np.array([one.Ns >= LIKE_MIRROR_FROM for one in library.materials])


def has_mirrors(scene: Any) -> bool:
    """Whether a scene, a ``SceneInKernels``, has such materials."""
    return bool(mirrors_of(scene)[scene.geometry.mesh.used_materials()].any())


def follow(scene: Any, origins: np.ndarray, directions: np.ndarray, camera: Any, most: int, rng: Any) -> Ends:
    """Where rays end.

    Args:
        scene: a ``SceneInKernels``.
        origins, directions: (n, 3). camera: its eye looks at where they end.
        most: mirrors on the way. rng: a numpy random generator, which decides what glass reflects.
    """
    random = rng.random((len(origins), MOST_MIRRORS, 2), np.float32)
    to_world, dtype = camera.matrix(), runtime.dtype()
    eye = [*-to_world[:3, 2], 0.0] if camera.is_parallel else [*to_world[:3, 3], 1.0]
    found = np.empty((len(origins), NUMBERS), dtype)
    rays = (np.ascontiguousarray(one, dtype) for one in (origins, directions))
    _follow(scene, *rays, random, found, min(most, MOST_MIRRORS), np.array(eye, dtype))
    ray = np.flatnonzero(found[:, 7] > 0)
    end = found[ray].astype(np.float64)
    return Ends(ray, end[:, :3], end[:, 3:6], *end[:, 6:11].T)


@ti.kernel
def _follow(
    scene: ti.template(),
    origins: ti.types.ndarray(ndim=2),
    directions: ti.types.ndarray(ndim=2),
    random: ti.types.ndarray(ndim=3),
    found: ti.types.ndarray(ndim=2),
    most: ti.i32,
    eye: ti.types.ndarray(ndim=1),
):
    """``found``: origin (3), direction (3), distance, T, material, f_cos, f_T, see ``Ends``.

    T is 0 if no mirror was met. ``eye``: where it is, and 1; or the direction to it, and 0.
    """
    for i in range(origins.shape[0]):
        ray = ray_from(origins, directions, i)
        hit = scene.ray_intersector.query_segment(ray, 0.0, tm.inf)
        T, mirrors, is_going = tm.vec3(1), 0, hit.is_hit
        for k in ti.static(range(NUMBERS)):
            found[i, k] = 0.0  # a GPU gets no zeros of an array that the kernel only writes to
        found[i, 8] = hit.material_id
        while is_going:
            surface = scene.surface_at(ray, hit)
            is_mirror = surface.is_delta() or surface.material.Ns >= LIKE_MIRROR_FROM
            is_going = is_mirror and mirrors < most
            if is_going:
                w_i = surface.sample(tm.vec2(random[i, mirrors, 0], random[i, mirrors, 1]))
                T *= surface.weight(w_i)
                mirrors += 1
                ray = surface.ray_along(w_i)
                hit = scene.met(surface, ray)
                is_going = hit.is_hit and tm.component_max(T) > 0
            elif mirrors > 0 and not is_mirror:
                to_eye = tm.normalize(tm.vec3(eye[0], eye[1], eye[2]) - eye[3] * hit.position)
                f, cosine = surface.eval(to_eye), tm.dot(surface.normal, to_eye)
                if cosine > 0:
                    found[i, 9] = tm.sqrt(tm.dot(f, f) / 3) * cosine
                    found[i, 10] = tm.sqrt(tm.dot(f * T, f * T) / 3)
        if mirrors > 0:
            for k in ti.static(range(3)):
                found[i, k], found[i, 3 + k] = ray.origin[k], ray.direction[k]
            found[i, 6] = ti.select(hit.is_hit, hit.distance, tm.inf)
            found[i, 7] = tm.sqrt(tm.dot(T, T) / 3)
