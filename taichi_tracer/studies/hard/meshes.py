"""Meshes as (vertices, faces), in float64 numbers that f32 holds exactly: every precision meets the same triangles."""

import numpy as np


def as_f32(values) -> np.ndarray:
    """The nearest f32 numbers, as float64."""
    return np.asarray(values, np.float32).astype(np.float64)


def unit_rows(vectors: np.ndarray) -> np.ndarray:
    """(n, 3) vectors of length 1."""
    return vectors / np.linalg.norm(vectors, axis=1, keepdims=True)


def sphere(columns: int, rows: int, radius: float = 1.0, centre=(0.0, 0.0, 0.0)) -> tuple[np.ndarray, np.ndarray]:
    """A closed sphere of 2·columns·(rows − 1) triangles, fronts outside, poles on the y axis."""
    theta = np.linspace(0, np.pi, rows + 1)[1:-1, None]
    phi = np.linspace(0, 2 * np.pi, columns, endpoint=False)[None, :]
    ring = np.stack([np.sin(theta) * np.cos(phi), np.cos(theta) + 0 * phi, -np.sin(theta) * np.sin(phi)], axis=-1)
    vertices = np.concatenate([[[0, 1, 0]], ring.reshape(-1, 3), [[0, -1, 0]]])
    k = np.arange(columns)
    after = (k + 1) % columns
    last = len(vertices) - 1
    top = np.stack([0 * k, 1 + k, 1 + after], axis=1)
    bottom = np.stack([last + 0 * k, last - columns + after, last - columns + k], axis=1)
    r = np.arange(rows - 2)[:, None] * columns
    a, b = (1 + r + k).ravel(), (1 + r + after).ravel()
    upper, lower = np.stack([a, a + columns, b], axis=1), np.stack([b, a + columns, b + columns], axis=1)
    return as_f32(vertices * radius + np.asarray(centre)), np.concatenate([top, upper, lower, bottom])


def separate(triangles) -> tuple[np.ndarray, np.ndarray]:
    """(n, 3, 3) corners as a mesh whose triangles share no vertex."""
    vertices = as_f32(triangles).reshape(-1, 3)
    return vertices, np.arange(len(vertices)).reshape(-1, 3)


def join(meshes) -> tuple[np.ndarray, np.ndarray]:
    """Several meshes as one, their triangles one after the other."""
    offsets = np.cumsum([0] + [len(vertices) for vertices, _ in meshes])
    faces = [f + offset for (_, f), offset in zip(meshes, offsets, strict=False)]
    return np.concatenate([vertices for vertices, _ in meshes]), np.concatenate(faces)


def height_field(rng, cells: int, centre) -> tuple[np.ndarray, np.ndarray]:
    """cells² squares of two triangles over the xz plane; corners are even, so that edges' middles are integers, too."""
    x, z = np.meshgrid(np.arange(cells + 1), np.arange(cells + 1), indexing="ij")
    y = rng.integers(-1, 2, x.shape)
    vertices = 2.0 * np.stack([x - cells // 2, y, z - cells // 2], axis=-1).reshape(-1, 3) + centre
    i, j = (a.ravel() for a in np.meshgrid(np.arange(cells), np.arange(cells), indexing="ij"))
    a = i * (cells + 1) + j
    b, c, d = a + 1, a + cells + 1, a + cells + 2
    return vertices, np.concatenate([np.stack([a, b, c], axis=1), np.stack([b, d, c], axis=1)])


def box(low, high) -> tuple[np.ndarray, np.ndarray]:
    """The closed surface of an axis-parallel box, fronts outside."""
    corner = np.array([[x, y, z] for x in (0, 1) for y in (0, 1) for z in (0, 1)], float)
    low, high = np.asarray(low, float), np.asarray(high, float)
    quads = [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)]
    faces = [t for a, b, c, d in quads for t in ((a, b, c), (a, c, d))]
    return low + corner * (high - low), np.array(faces)


def edges_of(faces: np.ndarray) -> np.ndarray:
    """(E, 2) vertex ids of every edge."""
    corners = np.sort(faces[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2), axis=1)
    return np.unique(corners, axis=0)


def normals_of(vertices: np.ndarray, faces: np.ndarray) -> np.ndarray:
    """(F, 3) unit normals in float64."""
    v0, v1, v2 = (vertices[faces[:, k]] for k in range(3))
    return unit_rows(np.cross(v1 - v0, v2 - v0))
