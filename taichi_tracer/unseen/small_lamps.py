"""How much light does a picture miss because its eye rays may pass beside a lamp that is smaller than a pixel?

The image of a lamp covers the area P of the picture, in pixels. If P is below 1, and if the share V of the lamp is seen
from the eye, then a sample of its pixel meets the lamp with the probability P V, and shows its radiance L. So it adds
P V L to the pixel on average: see ``rare_light``.

Nothing is sampled here: the lamps are projected with numpy, once for each view. Rays are traced only to lamps that are
so small in this view; they say what is seen. The ray of a camera that maps pixels in a way of its own does not lead to
the lamp, and then nothing is added.
"""

import math
from typing import Any

import numpy as np

from taichi_tracer.lights.choice import LampTable
from taichi_tracer.unseen.rare_light import rows_of

POINTS = np.array([[1, 1, 1], [4, 1, 1], [1, 4, 1], [1, 1, 4]]) / np.array([[3], [6], [6], [6]])  # of a triangle
OFF = 1e-3  # of the distance: a ray that passes a lamp's point by more does not lead to it


def small_lamps(scene_data: Any, camera: Any, crop: tuple[int, ...]) -> np.ndarray:
    """Rows of the lamps that a view shows directly, and that are smaller than a pixel.

    Args:
        crop: (x0, x1, y0, y1), the pixels of the picture.
    """
    table = scene_data.lamps.table
    corners = corners_of(scene_data.geometry.mesh, table, camera)
    with np.errstate(all="ignore"):
        image = pixels_of(camera, corners)
        a, b = image[:, 1] - image[:, 0], image[:, 2] - image[:, 0]
        area = abs(a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0]) * np.where(table.primitives >= 0, 0.5, math.pi)
        number, is_inside = pixel_numbers(POINTS @ image, crop)  # (L, 4): the pixels of some points
    lamp = np.flatnonzero((area > 0) & (area < 1) & is_inside.any(axis=1))
    to, places = ((POINTS @ one[lamp]).reshape(-1, one.shape[2]) for one in (corners, image))
    hits, leads, _ = look(scene_data, camera, places, to)
    is_lamp = hits.triangle_id == np.repeat(table.ids[lamp], len(POINTS))
    is_seen = (hits.is_hit & leads & (table.two_sided | ~hits.is_backfacing) & is_lamp).reshape(-1, len(POINTS))
    shown, point = np.nonzero(is_inside[lamp] & is_seen)
    chance = area[lamp[shown]] / len(POINTS)
    return rows_of(number[lamp[shown], point], chance, chance * radiance_of(scene_data)[lamp[shown]])


def corners_of(mesh: Any, table: LampTable, camera: Any) -> np.ndarray:
    """(L, 3, 3) the corners of triangles; of spheres the centre, and the ends of two radii across the gaze, if any."""
    is_triangle = table.primitives >= 0
    corners = np.empty((len(table), 3, 3))
    corners[is_triangle] = mesh.vertices[mesh.faces[table.primitives[is_triangle]]]
    spheres = mesh.spheres[-1 - table.primitives[~is_triangle]].astype(np.float64)
    axes = np.eye(3)[:2] if camera is None else camera.matrix()[:3, :2].T
    corners[~is_triangle] = spheres[:, None, :3]
    corners[~is_triangle, 1:] += spheres[:, None, 3:] * axes
    return corners


def pixels_of(camera: Any, points: np.ndarray) -> np.ndarray:
    """(..., 2) where the camera shows points (..., 3), as ``camera.rays`` counts pixels; NaN behind a pinhole."""
    of_camera = np.linalg.inv(camera.matrix())
    local = points @ of_camera[:3, :3].T + of_camera[:3, 3]
    depth = np.ones_like(local[..., 2:]) if camera.is_parallel else np.where(local[..., 2:] > 0, local[..., 2:], np.nan)
    ndc = (local[..., :2] / depth - camera.compute_centre()) / np.asarray(camera.compute_half_size())
    return (ndc + 1) / 2 * (int(camera.width), int(camera.height)) - 0.5


def pixel_numbers(places: np.ndarray, crop: tuple[int, ...]) -> tuple[np.ndarray, np.ndarray]:
    """(...,) the number in the crop of the pixel of each place (..., 2), the lowest row first; whether it has one."""
    x0, x1, y0, y1 = crop
    at = np.floor(places + 0.5)
    is_inside = ((at >= (x0, y0)) & (at < (x1, y1))).all(axis=-1)
    return (at[..., 0] - x0) + (x1 - x0) * (at[..., 1] - y0), is_inside


def look(scene_data: Any, camera: Any, pixel: np.ndarray, points: np.ndarray) -> tuple[Any, np.ndarray, np.ndarray]:
    """What the rays through places of the picture hit; whether each leads to its point; and how far that is.

    Args:
        pixel: (n, 2) places. points: (n, 3).
    """
    place = np.nan_to_num(pixel, nan=-1.0, posinf=-1.0, neginf=-1.0)
    origins, directions = camera.rays(place[:, 0], place[:, 1])
    along = ((points - origins) * directions).sum(axis=1)
    beside = np.linalg.norm(points - origins - along[:, None] * directions, axis=1)
    return scene_data.intersect(origins, directions), beside < OFF * abs(along), along


def area_of_pixel(camera: Any, points: np.ndarray) -> np.ndarray:
    """(n,) the area that a pixel covers at each point, across the ray."""
    to_world = camera.matrix()
    from_eye = points - to_world[:3, 3]
    step = OFF * np.linalg.norm(from_eye, axis=1, keepdims=True)
    ray = np.broadcast_to(to_world[:3, 2], points.shape) if camera.is_parallel else from_eye
    a = np.cross(ray, to_world[:3, 1])
    b = np.cross(ray, a)
    a, b = (step * one / np.linalg.norm(one, axis=1, keepdims=True) for one in (a, b))
    by_a, by_b = (pixels_of(camera, points + one) - pixels_of(camera, points - one) for one in (a, b))
    return (2 * step[:, 0]) ** 2 / abs(by_a[:, 0] * by_b[:, 1] - by_a[:, 1] * by_b[:, 0])


def radiance_of(scene_data: Any) -> np.ndarray:
    """(L,) the radiance of each lamp, as the root mean square of the channels."""
    emission = np.array([material.Ke for material in scene_data.materials], np.float64)
    return np.sqrt(np.square(emission[scene_data.lamps.table.materials]).mean(axis=1))
