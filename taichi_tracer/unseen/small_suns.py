"""How much light does a picture miss because its eye rays, mirrors and glass pass beside a sun?

The bright texels of an environment are divided into levels of brightness. If a level is small and has much of the
light, it is a *sun*. The image of one of its texels, of solid angle Ω, covers the area P = Ω / Ω_pixel of a pixel. If P
is below 1, a sample of the pixel meets the texel with the probability P and shows its radiance L: see ``rare_light``.
Only rays to suns inside the picture are traced.

In mirrors and glass, some thousand eye rays tell how many pixels show directions within ``NEAR`` of a sun: see
``mirrored_lamps``. A level that has the share Ω_sun / Ω_near of these directions is met by this share of the rays.
"""

from typing import Any

import numpy as np

from taichi_tracer.environment import Environment
from taichi_tracer.system.parts import replaced
from taichi_tracer.unseen.rare_light import NONE, rows_of
from taichi_tracer.unseen.small_lamps import area_of_pixel, look, pixel_numbers, pixels_of

NEAR = np.radians(10.0)  # wide enough that some rays are near, and a sky is even within it
LEVELS = (1 / 4, 1 / 40, 1 / 400)  # of the largest radiance: where each level ends below
SMALL_SPOT = 0.005  # of the sphere: what is larger is met by many rays
MATTERS = 0.01  # of all the light: what has less is not missed
ROWS = 64  # of the map of directions that are near; it has twice as many columns


class Sun:
    """One level of brightness of an environment.

    Attributes:
        directions: (n, 3) to the centres of its texels, in the scene. solid_angles: (n,) of the texels.
        radiance: (n,) of the texels, as the root mean square of the channels.
        spots: (k, 3) directions to the parts of the sphere in which it lies. share: Ω_sun / Ω_near.
    """

    def __init__(self, light: Any, rows: np.ndarray, columns: np.ndarray, solid_angles: np.ndarray) -> None:
        environment = light.environment
        h, w, turn = environment.height, environment.width, environment.rotation / 360
        v, u = (np.mgrid[:ROWS, : 2 * ROWS] + 0.5) / [[[ROWS]], [[2 * ROWS]]]
        cells, areas = direction_of(u + turn, v), np.cos(np.pi * (0.5 - v)) * (np.pi / ROWS) ** 2
        spots = np.unique(np.stack([rows * ROWS // h, columns * 2 * ROWS // w]), axis=1)
        self.spots, self.solid_angles = cells[spots[0], spots[1]], solid_angles
        self.share = solid_angles.sum() / areas[self.is_near(cells)].sum()
        self.radiance = environment.intensity * np.sqrt(np.square(environment.pixels[rows, columns]).mean(axis=1))
        self.directions = direction_of((columns + 0.5) / w + turn, (rows + 0.5) / h)
        if light.up_axis == "z":
            self.spots, self.directions = (d[:, [0, 2, 1]] * (1, -1, 1) for d in (self.spots, self.directions))

    def is_near(self, directions: np.ndarray) -> np.ndarray:
        """(...,) bool: whether directions in the scene, (..., 3), are near."""
        return (directions @ self.spots.T).max(axis=-1) > np.cos(NEAR + np.pi / ROWS / 2)


def direction_of(u: np.ndarray, v: np.ndarray) -> np.ndarray:
    """(..., 3) the directions of an environment with the u of ``Environment.coords``, and v from the zenith."""
    elevation, azimuth = np.pi * (0.5 - v), 2 * np.pi * (u - 0.5)
    x, z = np.cos(elevation) * np.cos(azimuth), np.cos(elevation) * np.sin(azimuth)
    return np.stack([x, np.sin(elevation), z], axis=-1)


def levels_of(environment: Environment) -> list[tuple[np.ndarray, np.ndarray, np.ndarray]]:
    """The levels that are small and matter: rows, columns and solid angles of their texels."""
    pixels = environment.pixels.astype(np.float64)
    h, w = pixels.shape[:2]
    brightness = (pixels[..., 0] + pixels[..., 1] + pixels[..., 2]) / 3  # in a third of the time of mean(axis=2)
    edges = np.cos(np.pi * np.arange(h + 1) / h)
    solid_angle = np.repeat((edges[:-1] - edges[1:])[:, None] * 2 * np.pi / w, w, axis=1)
    light = brightness * solid_angle
    found = []
    high = np.inf
    for fraction in LEVELS:
        low = fraction * brightness.max()
        is_level = (brightness >= low) & (brightness < high)
        if low == 0 or solid_angle[brightness >= low].sum() > SMALL_SPOT * 4 * np.pi:
            break
        if light[is_level].sum() > MATTERS * light.sum():
            found.append((*np.nonzero(is_level), solid_angle[is_level]))
        high = low
    return found


def suns_of(scene: Any) -> list[Sun]:
    """The suns of a ``SceneInKernels``."""
    light = next((one for one in scene.lights.far if one.name == "environment"), None)
    if light is None or scene.effects.environment != "image" or replaced(light.environment):
        return []
    return [Sun(light, *level) for level in levels_of(light.environment)]


def small_suns(suns: list[Sun], scene_data: Any, camera: Any, crop: tuple[int, ...]) -> np.ndarray:
    """Rows of the texels of suns that a view shows directly, and that are smaller than a pixel.

    Args:
        crop: (x0, x1, y0, y1), the pixels of the picture.
    """
    if camera.is_parallel or not suns:
        return NONE
    directions, solid_angles, radiance = (
        np.concatenate([getattr(sun, name) for sun in suns]) for name in ("directions", "solid_angles", "radiance")
    )
    points = camera.matrix()[:3, 3] + directions
    with np.errstate(all="ignore"):
        places = pixels_of(camera, points)
        chance = solid_angles / area_of_pixel(camera, points)
        number, is_inside = pixel_numbers(places, crop)
    shown = np.flatnonzero(is_inside & (chance < 1))
    hits, leads, _ = look(scene_data, camera, places[shown], points[shown])
    shown = shown[leads & ~hits.is_hit]
    return rows_of(number[shown], chance[shown], chance[shown] * radiance[shown])
