"""What is taken out of a mesh before rays meet it, and what is refused."""

import numpy as np
import pytest
from shapes import SQUARE

import taichi_tracer as tt
from taichi_tracer.geometry import Mesh, check, clean


def square_with(extra_vertices=(), extra_faces=()):
    vertices, faces = SQUARE
    return Mesh(
        vertices=np.concatenate([vertices, np.reshape(extra_vertices, (-1, 3))]),
        faces=np.concatenate([faces, np.reshape(extra_faces, (-1, 3))]).astype(np.int64),
        source="square",
    )


@pytest.mark.parametrize(
    ("vertices", "face", "cause"),
    [
        ([np.nan, 0, 0], [0, 1, 4], "1 with a NaN or infinite vertex"),
        ([0, np.inf, 0], [0, 4, 2], "1 with a NaN or infinite vertex"),
        ([1e39, 0, 0], [0, 1, 4], "1 with a NaN or infinite vertex"),  # infinite in f32
        ([], [0, 1, 1], "1 without area"),
        ([0, -1, 0], [0, 1, 4], "1 without area"),  # collinear
    ],
)
def test_unhittable_triangles_are_dropped_counted_and_told(vertices, face, cause):
    mesh = clean(square_with(vertices, face), np.float32)
    assert mesh.dropped == 1
    assert mesh.notes == [f"square: 1 of 3 triangles dropped ({cause})"]
    assert np.isfinite(mesh.vertices).all()
    np.testing.assert_array_equal(mesh.faces[:2], SQUARE[1])  # the others keep their ids


def test_a_good_mesh_is_left_alone():
    mesh = clean(square_with(), np.float32)
    assert (mesh.dropped, mesh.notes) == (0, [])
    assert mesh.vertices.dtype == np.float32


@pytest.mark.parametrize("scale", [1e-18, 1e-6, 1.0, 1e6, 1e18])
def test_small_and_large_triangles_stay(scale):
    mesh = square_with()
    mesh.vertices = mesh.vertices * scale
    assert clean(mesh, np.float32).dropped == 0


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"faces": np.array([[0, 1, 2], [0, 1, 4]])}, "triangle 1 has vertex index 4, which is out of range"),
        ({"faces": np.array([[0, -1, 2]])}, "triangle 0 has vertex index -1"),
        ({"faces": np.zeros((1, 4), int)}, "faces must have the shape (n, 3), not (1, 4)"),
        ({"vertices": np.zeros((4, 2))}, "vertices must have the shape (n, 3), not (4, 2)"),
        ({"normals": np.ones((1, 3)), "face_normals": np.full((2, 3), 1)}, "triangle 0 has normal index 1"),
    ],
)
def test_arrays_that_do_not_fit_are_refused(change, message):
    mesh = square_with()
    for name, value in change.items():
        setattr(mesh, name, value)
    with pytest.raises(tt.InputError) as error:
        check(mesh)
    assert str(error.value).startswith("square: ")
    assert message in str(error.value)


def test_shading_normals_are_interpolated_and_face_the_ray(precision):
    """Vertex normals by their own ids; the geometric normal where a corner has none, or where they cancel (C-17)."""
    vertices = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0]] * 3, float) + np.repeat(
        [[0, 0, 0], [2, 0, 0], [4, 0, 0]], 3, 0
    )
    normals = np.array([[0, 0, 2], [1, 0, 1], [0, 1, 1], [0, 0, -2.0]])
    mesh = Mesh(
        vertices=vertices,
        faces=np.arange(9).reshape(3, 3),
        normals=normals,
        face_normals=np.array([[0, 1, 2], [0, -1, 2], [0, 3, 3]]),
    )
    scene = tt.SceneData(mesh)
    origins = np.array([[0.25, 0.5, 1], [2.25, 0.25, 1], [4.25, 0.25, 1.0]])
    hits = scene.intersect(origins, [0, 0, -1])
    smooth = 0.25 * normals[0] + 0.25 * normals[1] + 0.5 * normals[2]
    expected = [smooth / np.linalg.norm(smooth), [0, 0, 1], [0, 0, 1]]
    np.testing.assert_allclose(hits.normal, expected, atol=1e-6)
    below = scene.intersect(origins * [1, 1, -1], [0, 0, 1])
    np.testing.assert_allclose(below.normal, -np.array(expected), atol=1e-6)
    np.testing.assert_allclose(below.geometric_normal, [[0, 0, -1]] * 3, atol=1e-6)
    assert below.is_backfacing.all()
    assert not hits.is_backfacing.any()
