"""Parts of meshes: moved, turned inside out, and joined."""

import numpy as np
from shapes import SQUARE, with_spheres

from taichi_tracer.geometry import Mesh, check
from taichi_tracer.materials import Material
from taichi_tracer.mesh_parts import inverse_of, joined, move, reverse, similarities


def test_a_mirror_turns_triangles_round_so_that_outsides_stay_outside():
    mesh = Mesh(SQUARE[0].copy(), SQUARE[1].copy(), normals=np.array([[0, 0, 1.0]]), face_normals=np.zeros((2, 3), int))
    matrix = np.diag([2.0, 3.0, -4.0, 1.0])
    matrix[:3, 3] = 1, 2, 3
    move(mesh, matrix)
    corners = mesh.vertices[mesh.faces]
    normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    assert (normal[:, 2] < 0).all()
    assert mesh.normals[0, 2] < 0
    np.testing.assert_array_equal(mesh.vertices[0], [-1, -1, 3])


def test_reversed_triangles_keep_the_normals_of_their_corners():
    mesh = Mesh(*SQUARE, normals=np.eye(3), face_normals=np.array([[0, 1, 2], [2, -1, 0]]))
    expected = {tuple(pair) for pair in zip(mesh.faces.ravel(), mesh.face_normals.ravel(), strict=True)}
    reverse(mesh)
    corners = mesh.vertices[mesh.faces]
    assert (np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])[:, 2] < 0).all()
    assert {tuple(pair) for pair in zip(mesh.faces.ravel(), mesh.face_normals.ravel(), strict=True)} == expected


def test_ids_of_joined_parts_are_those_of_the_whole():
    plain, smooth = Mesh(*SQUARE), Mesh(*SQUARE, normals=np.eye(3), face_normals=np.array([[0, 1, 2], [2, -1, 0]]))
    smooth.face_materials, smooth.face_culls = np.array([1, 0]), np.array([True, False])
    whole = joined([plain, with_spheres([(0, 0, 0, 1)]), smooth, smooth], [Material("a"), Material("b")], "all")
    check(whole)
    np.testing.assert_array_equal(whole.vertices[whole.faces[2:4]], SQUARE[0][SQUARE[1]])
    np.testing.assert_array_equal(
        whole.face_normals, [[-1] * 3, [-1] * 3, [0, 1, 2], [2, -1, 0], [3, 4, 5], [5, -1, 3]]
    )
    np.testing.assert_array_equal(whole.face_materials, [0, 0, 1, 0, 1, 0])
    np.testing.assert_array_equal(whole.face_culls, [False, False, True, False, True, False])
    np.testing.assert_array_equal(whole.sphere_ids, [2])
    assert whole.source == "all"


def test_without_parts_and_normals_there_are_none():
    assert joined([], [], "nothing").num_primitives == 0
    assert joined([Mesh(*SQUARE)], [], "one").face_normals.shape == (0, 3)


def test_inverses_of_many_matrices(rng):
    linear = rng.normal(size=(50, 3, 3))
    np.testing.assert_allclose(inverse_of(linear), np.linalg.inv(linear), rtol=1e-9)
    assert not np.isfinite(inverse_of(np.zeros((1, 3, 3)))).any()


def test_factors_of_similarities(rng):
    turns, _ = np.linalg.qr(rng.normal(size=(20, 3, 3)))
    np.testing.assert_allclose(similarities(3 * turns), 3)
    assert np.isnan(similarities(turns @ np.diag([1.0, 1, 2]))).all()
    assert similarities(np.zeros((1, 3, 3))).tolist() == [0]
