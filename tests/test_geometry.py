"""What is taken out of a mesh before rays meet it, what is refused, and what of it kernels can read."""

import numpy as np
import pytest
from shapes import SQUARE

import taichi_tracer as tt
from taichi_tracer.formulas.vertex_normals import USUAL_CREASE
from taichi_tracer.geometry import Mesh, check, clean, smoothed


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
        ([np.nan, 0, 0], [0, 1, 4], "1 with a vertex that is NaN, infinite or too large"),
        ([0, np.inf, 0], [0, 4, 2], "1 with a vertex that is NaN, infinite or too large"),
        ([1e39, 0, 0], [0, 1, 4], "1 with a vertex that is NaN, infinite or too large"),  # infinite in f32
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


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"faces": np.array([[0, 1, 2], [0, 1, 4]])}, "faces[1, 2] is 4, which is out of range (0 to 3)"),
        ({"faces": np.array([[0, 1, 2], [0, -1, 2]])}, "faces[1, 1] is -1"),
        ({"faces": np.zeros((1, 4), int)}, "faces must have the shape (n, 3), not (1, 4)"),
        ({"vertices": np.zeros((4, 2))}, "vertices must have the shape (n, 3), not (4, 2)"),
        (
            {"normals": np.ones((1, 3)), "face_normals": np.full((2, 3), 1)},
            "face_normals[0, 0] is 1, which is out of range (-1 to 0)",
        ),
        ({"face_materials": np.array([0, 3])}, "face_materials[1] is 3, which is out of range (0 to 0)"),
        ({"face_materials": np.array([0])}, "face_materials must have the shape (2,), not (1,)"),
        ({"spheres": np.zeros((1, 3))}, "spheres must have the shape (n, 4), not (1, 3)"),
        ({"spheres": np.ones((2, 4))}, "sphere_materials must have the shape (2,), not (0,)"),
        (
            {"spheres": np.ones((2, 4)), "sphere_materials": np.zeros(2, int), "sphere_ids": np.array([1, 1])},
            "sphere_ids must ascend",
        ),
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


# ── smooth normals ──

FOLD = np.array([[0, 0, 0], [0, 1, 0], [-1, 0, 0], [1, 0, -1]], float), np.array([[0, 1, 2], [1, 0, 3]])  # by 45°


def fold(**more):
    return Mesh(vertices=FOLD[0], faces=FOLD[1], source="fold.ply", **more)


def test_smooth_is_an_angle_or_the_usual_one():
    assert not smoothed(fold(), False).has_vertex_normals
    bend = {}
    for smooth in (True, 0, 44.9, 45.1, np.float32(180)):
        mesh = smoothed(fold(), smooth)
        corners = mesh.normals[mesh.face_normals]
        bend[float(smooth)] = np.degrees(np.arccos(np.clip(corners[0, 0] @ corners[1, 1], -1, 1)))
    assert [round(angle) for angle in bend.values()] == [45, 45, 45, 0, 0]
    assert USUAL_CREASE == 30


def test_corners_with_normals_keep_them():
    own = np.array([[0, 0, 7.0]])
    mesh = smoothed(fold(normals=own, face_normals=np.array([[0, 0, 0], [-1, 0, -1]], np.int32)), 60)
    corners = mesh.normals[mesh.face_normals]
    np.testing.assert_array_equal(corners[0], [[0, 0, 7]] * 3)
    np.testing.assert_array_equal(corners[1, 1], [0, 0, 7])
    assert 0 < corners[1, 0, 0] < np.sqrt(0.5)  # between the normals of the two triangles, (0, 0, 1) and (1, 0, 1)/√2
    complete = fold(normals=own, face_normals=np.zeros((2, 3), np.int32))
    assert smoothed(complete, True).notes == ["fold.ply: smooth changes nothing: every corner has a normal in the file"]
    empty = Mesh(np.zeros((0, 3)), np.zeros((0, 3), np.int32))
    assert "it has no triangles" in smoothed(empty, True).notes[0]
