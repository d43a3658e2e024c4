"""A picture of leaks: a closed white sphere, lit from inside, in front of a red background."""

import numpy as np

from taichi_tracer.studies.hard.case import Stage
from taichi_tracer.studies.hard.closed_meshes import ClosedSphere
from taichi_tracer.studies.hard.meshes import as_f32
from taichi_tracer.studies.hard.modes import Mode

SIZE = 320  # pixels
RED = (0.9, 0.0, 0.05)
RADIUS, CENTRE = 4.0, np.array([100.0, -33.0, 14.0])


def leak_map(mode: Mode, size: int = SIZE) -> np.ndarray:
    """(size, size, 3) in [0, 1], top row first: what an eye within a closed sphere sees, red where a ray gets out.

    Each pixel's ray is not sent through the pixel's centre but at the point of an edge that is nearest to what lies
    there: a regular ray would meet an edge once in millions.
    """
    stage = Stage("leak map", [ClosedSphere("leak map", "leak map", RADIUS, CENTRE, 64, 33)])
    on = stage.build(mode)["leak map"]
    eye = as_f32(CENTRE + RADIUS * np.array([0.1, 0.05, 0.6]))
    ndc = 2 * (np.arange(size) + 0.5) / size - 1
    x, y = np.meshgrid(ndc, -ndc)
    direction = np.stack([x, y, -np.ones_like(x)], axis=-1).reshape(-1, 3)
    eyes = np.broadcast_to(eye, direction.shape)
    seen = on.scene.intersect(eyes, direction)
    ids = np.maximum(on.own(seen), 0)
    v, w = seen.barycentric_coords.astype(np.float64).T
    weights = np.stack([1 - v - w, v, w], axis=1)
    weights[np.arange(len(weights)), weights.argmin(axis=1)] = 0
    weights /= weights.sum(axis=1, keepdims=True)
    target = (on.corners(ids) * weights[:, :, None]).sum(axis=1)
    is_hit = on.scene.intersect(eyes, as_f32(target - eye)).is_hit

    to_light = CENTRE + RADIUS * np.array([-0.35, 0.55, 0.1]) - target
    distance = np.linalg.norm(to_light, axis=1)
    cosine = np.abs((seen.geometric_normal * to_light).sum(axis=1)) / distance
    irradiance = cosine * (RADIUS / distance) ** 2
    shade = 0.5 + 0.5 * irradiance / (irradiance + 0.8)
    image = np.where((is_hit & seen.is_hit)[:, None], shade[:, None], RED)
    on.scene.destroy()
    return image.reshape(size, size, 3)
