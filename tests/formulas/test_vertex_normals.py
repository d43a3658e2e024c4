"""Smooth normals against closed forms: spheres, boxes, cones; creases; and their independence of the triangulation."""

import numpy as np
import pytest
from shapes import sphere

from taichi_tracer.formulas.vertex_normals import (
    area_weighted,
    normals_and_angles,
    smooth_normals,
)

BOX = np.array([[x, y, z] for x in (0, 1) for y in (0, 1) for z in (0, 1)], float)
SIDES = [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)]
BOX_FACES = np.array([t for a, b, c, d in SIDES for t in ((a, b, c), (a, c, d))])


def per_corner(vertices, faces, crease):
    normals, ids = smooth_normals(np.asarray(vertices, float), np.asarray(faces), crease)
    return normals[ids]


def repeated(vertices, faces):
    """The same triangles, each with vertices of its own, as an STL has them."""
    return vertices[faces].reshape(-1, 3), np.arange(faces.size).reshape(-1, 3)


def test_the_corner_of_a_box_is_smooth_only_beyond_90_degrees():
    """Weighted by angle, its normal is (±1, ±1, ±1)/√3, although one side has twice as many triangles there."""
    flat, _ = normals_and_angles(BOX[BOX_FACES])
    np.testing.assert_allclose(per_corner(BOX, BOX_FACES, 89.9), np.repeat(flat[:, None], 3, axis=1), atol=1e-15)
    expected = (2 * BOX[BOX_FACES] - 1) / np.sqrt(3)
    np.testing.assert_allclose(per_corner(BOX, BOX_FACES, 90), expected, atol=1e-12)
    by_area = area_weighted(BOX, BOX_FACES)
    by_area /= np.linalg.norm(by_area, axis=1, keepdims=True)
    assert np.abs(by_area - (2 * BOX - 1) / np.sqrt(3)).max() > 0.1  # this weight depends on the diagonals


@pytest.mark.parametrize("crease", [20, 30, 90])
def test_vertices_that_are_repeated_at_one_place_count_as_one(crease):
    for vertices, faces in (sphere(12, 7), (BOX, BOX_FACES)):
        own = repeated(vertices, faces)
        np.testing.assert_allclose(per_corner(*own, crease), per_corner(vertices, faces, crease), atol=1e-14)


def test_edges_with_one_triangle_three_or_another_side_are_creases():
    faces = [[0, 1, 2], [0, 1, 3]]  # both go from 0 to 1: the fronts lie on different sides
    vertices = [[0, 0, 0], [0, 1, 0], [-1, 0, 0], [1, 0, 0.1]]
    flat, _ = normals_and_angles(np.asarray(vertices)[np.asarray(faces)])
    np.testing.assert_allclose(per_corner(vertices, faces, 180), np.repeat(flat[:, None], 3, axis=1), atol=1e-15)
    book = [[0, 1, 2], [1, 0, 3], [1, 0, 4]]
    pages = [*vertices, [1, 0, 0.5]]
    flat, _ = normals_and_angles(np.asarray(pages)[np.asarray(book)])
    np.testing.assert_allclose(per_corner(pages, book, 180), np.repeat(flat[:, None], 3, axis=1), atol=1e-15)


def test_a_crease_separates_the_triangles_around_a_vertex_into_groups():
    """A cylinder with its caps: round the side smooth, sharp at the rim."""
    n = 36
    phi = 2 * np.pi * np.arange(n) / n
    ring = np.stack([np.cos(phi), np.sin(phi), 0 * phi], axis=1)
    vertices = np.concatenate([ring, ring + [0, 0, 2], [[0, 0, 0], [0, 0, 2]]])
    k, m = np.arange(n), (np.arange(n) + 1) % n
    side = np.concatenate([np.stack([k, m, n + m], 1), np.stack([k, n + m, n + k], 1)])
    caps = np.concatenate([np.stack([m, k, 0 * k + 2 * n], 1), np.stack([n + k, n + m, 0 * k + 2 * n + 1], 1)])
    found = per_corner(vertices, np.concatenate([side, caps]), 30)
    outward = vertices * [1, 1, 0]
    np.testing.assert_allclose(found[: 2 * n], outward[side], atol=1e-12)
    np.testing.assert_allclose(np.abs(found[2 * n :, :, 2]), 1, atol=1e-12)


def test_triangles_without_area_and_vertices_that_are_not_finite_hurt_no_neighbour():
    vertices, faces = sphere(12, 7)
    more = np.concatenate([faces, [[0, 0, 1], [1, 2, 2], [0, 1, len(vertices)]]])
    found = per_corner(np.concatenate([vertices, [[np.nan, 0, 0]]]), more, 60)
    assert np.isfinite(found).all()
    true = per_corner(vertices, faces, 60)
    is_near = np.isin(faces, [0, 1, 2]).any(axis=1)
    np.testing.assert_allclose(found[: len(faces)][~is_near], true[~is_near], atol=1e-14)
    assert np.abs((found[: len(faces)] * vertices[faces]).sum(axis=2)).min() > 0.8


def test_vertex_normals_are_weighted_by_area():
    """Of a roof, whose one side is twice as large as the other."""
    vertices = np.array([[0, 0, 0], [1, 0, 0], [0, 0, 1], [0, 2, 0.0]])
    faces = np.array([[0, 2, 1], [0, 3, 2]])
    normals = area_weighted(vertices, faces)
    sides = [np.cross(vertices[b] - vertices[a], vertices[c] - vertices[a]) for a, b, c in faces]
    np.testing.assert_allclose(normals[0], sides[0] + sides[1])
    np.testing.assert_allclose(normals[1], sides[0])
    np.testing.assert_allclose(normals[3], sides[1])
