"""Small meshes for tests, as (vertices, faces); meshes that have spheres as well; boxes; and rays."""

import numpy as np

from taichi_tracer.contracts.lab import SQUARE as SQUARE
from taichi_tracer.contracts.lab import lattice as lattice
from taichi_tracer.contracts.lab import soup as soup
from taichi_tracer.contracts.lab import sphere as sphere
from taichi_tracer.geometry import Mesh


def with_spheres(spheres, vertices=None, faces=None, **more):
    """A ``Mesh`` of spheres, and of triangles if there are any: in turn as long as both last, to mix their numbers."""
    spheres = np.asarray(spheres, float).reshape(-1, 4)
    if faces is None:
        vertices, faces = np.zeros((1, 3)), np.zeros((0, 3), np.int32)
    sphere_ids = np.unique(np.linspace(0, len(spheres) + len(faces) - 1, len(spheres)).astype(np.int32))
    assert len(sphere_ids) == len(spheres)
    more.setdefault("sphere_materials", np.zeros(len(spheres), np.int32))
    return Mesh(vertices=vertices, faces=faces, spheres=spheres, sphere_ids=sphere_ids, **more)


def random_spheres(rng, count, size=1.0):
    """(count, 4) in a cube of side 6; every number is one of f32."""
    spheres = np.concatenate([rng.uniform(-3, 3, (count, 3)), rng.uniform(0.05, size, (count, 1))], axis=1)
    return spheres.astype(np.float32).astype(float)


def random_rays(rng, count, reach=5):
    """Origins in a cube and directions of all lengths, some of them along the axes, in f32."""
    origins = rng.uniform(-reach, reach, (count, 3)).astype(np.float32)
    directions = (rng.normal(size=(count, 3)) * 10.0 ** rng.uniform(-6, 6, (count, 1))).astype(np.float32)
    directions[::9] *= [0, 0, 1]
    directions[1::9] *= np.float32([1, -0.0, 1])
    return origins, directions


def random_boxes(rng, count):
    centre, half = rng.uniform(-1, 1, (count, 3)), rng.exponential(0.02, (count, 3))
    return np.concatenate([centre - half, centre + half], axis=1)


def spheres_of_many_sizes():
    """The boxes of triangles of spheres within each other, and of two small ones far away."""
    parts = [sphere(8, 5, 10.0**k) for k in range(-6, 7)]
    parts += [sphere(16, 9, 4.0, (1e4, -3333, 1429)), sphere(16, 9, 4.0, (1e6, -333333, 142857))]
    corners = np.concatenate([vertices[faces] for vertices, faces in parts])
    return np.concatenate([corners.min(axis=1), corners.max(axis=1)], axis=1)


# Name → a function of a random number generator to (n, 6) boxes, each the low corner and the high one.
BOXES = {
    "one": lambda rng: random_boxes(rng, 1),
    "few": lambda rng: random_boxes(rng, 9),
    "many, in groups": lambda rng: random_boxes(rng, 20_000),
    "all the same": lambda rng: np.tile(random_boxes(rng, 1), (10_000, 1)),
    "points": lambda rng: np.tile(rng.uniform(size=(500, 3)), 2),
    "in a plane": lambda rng: random_boxes(rng, 9_000) * [1, 0, 1, 1, 0, 1],
    "exponentially spaced": lambda rng: 2.0 ** np.arange(-40, 40)[:, None] * np.array([[1, 1, 1, 1.2, 1.3, 1.4]]),
    "spheres of many sizes": lambda rng: spheres_of_many_sizes(),
    "huge and tiny": lambda rng: random_boxes(rng, 300) * 10.0 ** rng.integers(-6, 7, (300, 1)),
}
