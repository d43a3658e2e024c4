"""Which meshes have surfaces that see each other? Convex bodies, planes, and bodies with a dent or a neighbour."""

import numpy as np
import pytest

from taichi_tracer.formulas.convexity import MOST_DISTANCES, sides_that_see_others

TETRAHEDRON = (
    np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]], float),
    np.array([[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]]),
)
SQUARE = np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]], float), np.array([[0, 1, 2], [0, 2, 3]])


def turned(vertices, seed):
    """Rotated and moved, and rounded to f32, so that no four vertices lie exactly in a plane."""
    rng = np.random.default_rng(seed)
    rotation, _ = np.linalg.qr(rng.normal(size=(3, 3)))
    rotation *= np.sign(np.linalg.det(rotation))
    return (vertices @ rotation + rng.uniform(-3, 3, 3)).astype(np.float32)


@pytest.mark.parametrize("seed", range(10))
def test_convex_bodies_and_planes_in_any_position(seed):
    assert sides_that_see_others(turned(TETRAHEDRON[0], seed), TETRAHEDRON[1]) == "backs"
    assert sides_that_see_others(turned(SQUARE[0], seed), SQUARE[1]) == "none"


@pytest.mark.parametrize("seed", range(10))
def test_a_vertex_in_front_of_a_triangle_is_found(seed):
    """A second body far away, a dent, and a body that is inside out."""
    vertices, faces = TETRAHEDRON
    two = np.concatenate([vertices, vertices + [5, 1, 2]]), np.concatenate([faces, faces + 4])
    assert sides_that_see_others(turned(two[0], seed), two[1]) == "all"
    assert sides_that_see_others(turned(vertices, seed), faces[:, ::-1]) == "all"
    dented = np.concatenate([vertices, [[0.3, 0.3, 0.3]]])
    dent = np.concatenate([faces[:3], [[1, 2, 4], [2, 3, 4], [3, 1, 4]]])
    assert sides_that_see_others(turned(dented, seed), dent) == "all"


def test_large_meshes_are_not_compared_completely():
    count = int(np.sqrt(MOST_DISTANCES)) + 1
    angle = 2 * np.pi * np.arange(count) / count
    ring = np.stack([np.cos(angle), np.sin(angle), np.zeros(count)], axis=1)
    fan = np.stack([np.zeros(count - 2, int), np.arange(1, count - 1), np.arange(2, count)], axis=1)
    assert sides_that_see_others(ring[:100], fan[:98]) == "none"
    assert sides_that_see_others(np.tile(ring, (2, 1)), np.concatenate([fan, fan + count])) == "all"


def test_nothing_and_triangles_without_area():
    assert sides_that_see_others(np.zeros((0, 3)), np.zeros((0, 3), int)) == "none"
    assert sides_that_see_others(SQUARE[0], np.array([[0, 0, 1], [0, 1, 2], [0, 2, 3]])) == "none"
