"""Small meshes, as (vertices, faces)."""

import numpy as np


def sphere(columns=16, rows=9, radius=1.0, centre=(0, 0, 0)):
    """A closed sphere; 2·columns·(rows − 1) triangles, fronts outside."""
    theta, phi = np.meshgrid(
        np.linspace(0, np.pi, rows + 1)[1:-1], np.linspace(0, 2 * np.pi, columns, endpoint=False), indexing="ij"
    )
    ring = np.stack([np.sin(theta) * np.cos(phi), np.cos(theta), -np.sin(theta) * np.sin(phi)], -1).reshape(-1, 3)
    vertices = np.concatenate([[[0, 1, 0]], ring, [[0, -1, 0]]])
    last, faces = len(vertices) - 1, []
    for k in range(columns):
        nxt = (k + 1) % columns
        faces.append((0, 1 + k, 1 + nxt))
        faces.append((last, last - columns + nxt, last - columns + k))
        for r in range(rows - 2):
            a, b = 1 + r * columns + k, 1 + r * columns + nxt
            faces += [(a, a + columns, b), (b, a + columns, b + columns)]
    return vertices * radius + np.asarray(centre, float), np.array(faces, np.int32)


def soup(rng, count, size=0.3):
    """Random triangles in a unit cube."""
    centre = rng.uniform(-1, 1, (count, 1, 3))
    vertices = (centre + rng.normal(size=(count, 3, 3)) * size).reshape(-1, 3)
    return vertices, np.arange(3 * count, dtype=np.int32).reshape(-1, 3)


def lattice(rng, count):
    """Triangles with small integer corners: many ties, shared edges and exact hits."""
    vertices = rng.integers(-2, 3, (3 * count, 3)).astype(float)
    return vertices, np.arange(3 * count, dtype=np.int32).reshape(-1, 3)


SQUARE = (np.array([[-1, -1, 0], [1, -1, 0], [1, 1, 0], [-1, 1, 0]], float), np.array([[0, 1, 2], [0, 2, 3]], np.int32))
