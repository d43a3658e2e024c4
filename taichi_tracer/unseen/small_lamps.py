"""How much light does a picture miss because its eye rays may pass beside a lamp that is smaller than a pixel?

The image of a lamp covers the area P of the picture, in pixels. If P is below 1, and if the share V of the lamp is seen
from the eye, then a sample of its pixel meets the lamp with the probability P V, and shows its radiance L. If n samples
have most likely not met it, the light P V L is missing in this pixel. As in ``other_technique``, lamps that are about
as rarely met are counted together: of many small lamps, samples know enough. The mean square error grows by

    u² = (1/N) Σ_i (Σ P V L)²,

a sum over the pixels i and over the lamps that are missing in each of them.

Nothing is sampled here: the lamps are projected with numpy, once for each view. Rays are traced only to lamps that are
so small in this view; they say what is seen. The ray of a camera that maps pixels in a way of its own does not lead to
the lamp, and then nothing is added.
"""

import math
from typing import Any

import numpy as np

from taichi_tracer.lights.choice import LampTable
from taichi_tracer.unseen.unseen_light import ABOUT_AS_RARE, KNOWN, expected

POINTS = np.array([[1, 1, 1], [4, 1, 1], [1, 4, 1], [1, 1, 4]]) / np.array([[3], [6], [6], [6]])  # of a triangle
OFF = 1e-3  # of the distance: a ray that passes a lamp's point by more does not lead to it


class SmallLamps:
    """The lamps that a view shows directly, and that are smaller than a pixel.

    Attributes:
        pixel: (n,) the number of a pixel that shows a part of a lamp. chance: (n,) with which a sample meets the lamp.
        light: (n,) what this part adds to the pixel, as the root mean square of the channels. pixels: N.
    """

    def __init__(self, pixel: np.ndarray, chance: np.ndarray, light: np.ndarray, pixels: int) -> None:
        self.pixel, self.chance, self.light, self.pixels = pixel, chance, light, pixels

    def missed(self, samples: float) -> float:
        """u in the unit of the picture, for a picture with so many samples per pixel."""
        met = expected(np.sort(self.chance), ABOUT_AS_RARE * self.chance, 1 / len(POINTS))
        is_missed = samples * met < KNOWN
        of_pixel = np.bincount(self.pixel[is_missed], self.light[is_missed])
        return math.sqrt(float(np.square(of_pixel).sum()) / self.pixels)


def small_lamps(scene_data: Any, camera: Any, crop: tuple[int, ...]) -> SmallLamps:
    """The lamps that a view shows directly, and that are smaller than a pixel.

    Args:
        crop: (x0, x1, y0, y1), the pixels of the picture.
    """
    x0, x1, y0, y1 = crop
    pixels, mesh, table = (x1 - x0) * (y1 - y0), scene_data.geometry.mesh, scene_data.lamps.table
    corners = corners_of(mesh, table, camera)
    with np.errstate(all="ignore"):
        image = pixels_of(camera, corners)
        a, b = image[:, 1] - image[:, 0], image[:, 2] - image[:, 0]
        area = abs(a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0]) * np.where(table.primitives >= 0, 0.5, math.pi)
        at = np.floor(POINTS @ image + 0.5)  # (L, 4, 2): the pixels of some points
        is_inside = ((at >= (x0, y0)) & (at < (x1, y1))).all(axis=2)
    lamp = np.flatnonzero((area > 0) & (area < 1) & is_inside.any(axis=1))
    if lamp.size == 0:
        return SmallLamps(lamp, area[lamp], area[lamp], pixels)
    to, places = ((POINTS @ one[lamp]).reshape(-1, one.shape[2]) for one in (corners, image))
    is_seen = meets(scene_data, camera, places, to, np.repeat(lamp, len(POINTS))).reshape(-1, len(POINTS))
    of_points = is_seen * area[lamp, None] / len(POINTS)
    chance = np.broadcast_to(of_points.sum(axis=1, keepdims=True), of_points.shape)
    light = of_points * radiance_of(mesh, scene_data.materials, table)[lamp, None]
    number = (at[lamp, :, 0] - x0) + (x1 - x0) * (at[lamp, :, 1] - y0)
    shown = is_inside[lamp] & is_seen
    return SmallLamps(number[shown].astype(np.int64), chance[shown], light[shown], pixels)


def missed_directly(renderer: Any) -> float:
    """What lamps that are smaller than a pixel may add to a renderer's picture; 0 if none is in view."""
    if renderer.scene_data.lamps.count == 0 or not renderer.shows_light or renderer.replaced or renderer.samples == 0:
        return 0.0
    if renderer.small_lamps is None or renderer.small_lamps[0] != renderer._shown:
        found = small_lamps(renderer.scene_data, renderer.camera, renderer.film.crop)
        renderer.small_lamps = renderer._shown, found
    return renderer.small_lamps[1].missed(renderer.samples)


def corners_of(mesh: Any, table: LampTable, camera: Any) -> np.ndarray:
    """(L, 3, 3) the corners of triangles; of spheres the centre, and the ends of two radii across the gaze."""
    is_triangle = table.primitives >= 0
    corners = np.empty((len(table), 3, 3))
    corners[is_triangle] = mesh.vertices[mesh.faces[table.primitives[is_triangle]]]
    spheres = mesh.spheres[-1 - table.primitives[~is_triangle]].astype(np.float64)
    axes = np.asarray(camera.compute_matrix(), np.float64)[:3, :2].T
    corners[~is_triangle] = spheres[:, None, :3]
    corners[~is_triangle, 1:] += spheres[:, None, 3:] * axes
    return corners


def pixels_of(camera: Any, points: np.ndarray) -> np.ndarray:
    """(..., 2) where the camera shows points (..., 3), as ``camera.rays`` counts pixels; NaN behind a pinhole."""
    of_camera = np.linalg.inv(np.asarray(camera.compute_matrix(), np.float64))
    local = points @ of_camera[:3, :3].T + of_camera[:3, 3]
    depth = np.ones_like(local[..., 2:]) if camera.is_parallel else np.where(local[..., 2:] > 0, local[..., 2:], np.nan)
    ndc = (local[..., :2] / depth - camera.compute_centre()) / np.asarray(camera.compute_half_size())
    return (ndc + 1) / 2 * (int(camera.width), int(camera.height)) - 0.5


def meets(scene_data: Any, camera: Any, pixel: np.ndarray, points: np.ndarray, lamp: np.ndarray) -> np.ndarray:
    """(n,) bool: whether the ray through each place of the picture leads to its point, and meets the lamp there.

    Args:
        pixel: (n, 2) places. points: (n, 3). lamp: (n,) the numbers of the lamps.
    """
    table = scene_data.lamps.table
    place = np.nan_to_num(pixel, nan=-1.0, posinf=-1.0, neginf=-1.0)
    origins, directions = camera.rays(place[:, 0], place[:, 1])
    along = ((points - origins) * directions).sum(axis=1)
    beside = np.linalg.norm(points - origins - along[:, None] * directions, axis=1)
    hits = scene_data.intersect(origins, directions)
    is_lit = table.two_sided | ~hits.is_backfacing
    return hits.is_hit & is_lit & (hits.triangle_id == table.ids[lamp]) & (beside < OFF * abs(along))


def radiance_of(mesh: Any, materials: Any, table: LampTable) -> np.ndarray:
    """(L,) the radiance of each lamp, as the root mean square of the channels."""
    is_triangle = table.primitives >= 0
    of = np.empty(len(table), np.int64)
    of[is_triangle] = np.asarray(mesh.face_materials)[table.primitives[is_triangle]]
    of[~is_triangle] = np.asarray(mesh.sphere_materials)[-1 - table.primitives[~is_triangle]]
    return np.sqrt(np.square(np.array([m.Ke for m in materials], np.float64)[of]).mean(axis=1))
