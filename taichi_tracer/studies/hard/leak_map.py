"""A picture of leaks: a closed white sphere, lit from inside, in front of a red background."""

import numpy as np

from taichi_tracer.studies.hard.case import Placed
from taichi_tracer.studies.hard.meshes import as_f32

SIZE = 320  # pixels
RED = (0.85, 0.0, 0.05)


def leak_map(on: Placed, size: int = SIZE) -> np.ndarray:
    """(size, size, 3) in [0, 1], top row first: what an eye within a closed sphere sees, red where nothing was hit.

    Each pixel's ray is not sent through the pixel's centre but at the point of an edge that is nearest to what lies
    there: a regular ray would meet an edge once in millions.
    """
    centre = (on.vertices.min(axis=0) + on.vertices.max(axis=0)) / 2
    radius = (on.vertices.max(axis=0) - on.vertices.min(axis=0)).max() / 2
    eye = as_f32(centre + radius * np.array([0.15, 0.1, 0.65]))
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
    hits = on.scene.intersect(eyes, as_f32(target - eye))

    light = centre + radius * np.array([-0.3, 0.5, 0.2])
    to_light = light - target
    distance = np.linalg.norm(to_light, axis=1)
    cosine = np.abs((hits.geometric_normal * to_light).sum(axis=1)) / distance
    shade = 0.35 + 0.65 * cosine * np.minimum(1, (0.55 * radius / distance) ** 2) ** 0.5
    image = np.where((on.own(hits) >= 0)[:, None], np.clip(shade, 0, 1)[:, None], RED)
    return image.reshape(size, size, 3)
