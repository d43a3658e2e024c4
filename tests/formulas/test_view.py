"""The frame and the view of cameras."""

import numpy as np
import pytest
from oracles import cameras as oracle

from taichi_tracer.formulas import view as frames
from taichi_tracer.formulas import view as views
from taichi_tracer.system.errors import InputError

# ── frame and windows ──


ORIGIN = np.zeros(3)
UP = np.array([0.0, 1.0, 0.0])


@pytest.mark.parametrize("handedness", ["left", "right"])
def test_the_frame_is_that_of_the_document(rng, handedness):
    for eye, at, up in rng.normal(size=(20, 3, 3)):
        matrix = frames.camera_frame(eye, at, up, handedness)
        u, v, w = oracle.frame(eye, at, up, handedness)
        np.testing.assert_allclose(matrix, [*np.stack([u, v, w, eye], axis=1), [0, 0, 0, 1]], atol=1e-14)
        determinant = np.linalg.det(matrix[:3, :3])
        # Columns x, y, z with z along the gaze: x × y = z in the courses' frame, and −z in the mirrored one (C-5).
        assert determinant == pytest.approx(1 if handedness == "left" else -1)


def test_a_frame_that_cannot_be_is_told():
    """C-6."""
    with pytest.raises(InputError, match=r"eye and at are the same point \(1, 1, 1\)"):
        frames.camera_frame(np.ones(3), np.ones(3), UP)
    with pytest.raises(InputError, match=r"up \(0, 1, 0\) is parallel to the gaze \(0, -3, 0\)"):
        frames.camera_frame(3 * UP, ORIGIN, UP)
    frames.camera_frame(3 * UP, ORIGIN, np.array([1e-5, 1, 0]))  # far enough from parallel


@pytest.mark.parametrize("up_axis", ["y", "z"])
@pytest.mark.parametrize("aspect", [0.25, 1.0, 4.0])
def test_the_view_of_points_shows_all_of_them_and_fills_the_picture(aspect, up_axis, rng):
    points = rng.uniform([-3, 1, 2.0], [4, 2, 9.0], (200, 3))
    view = frames.view_of_points(points, up_axis, 50.0, aspect)
    local = (points - view["eye"]) @ frames.camera_frame(view["eye"], view["at"], view["up"])[:3, :3]
    tangent = np.tan(np.deg2rad(25))
    assert (local[:, 2] > 0).all()
    outermost = np.maximum(np.abs(local[:, 0]) / aspect, np.abs(local[:, 1])) / (tangent * local[:, 2])
    assert outermost.max() == pytest.approx(1 / (1 + frames.MARGIN))
    np.testing.assert_allclose(view["at"], (points.min(axis=0) + points.max(axis=0)) / 2)


@pytest.mark.parametrize(("up_axis", "front"), [("y", (0, 0, 1)), ("z", (0, -1, 0))])
def test_a_cube_shows_three_sides_from_above(up_axis, front):
    """Its front, its top and one of the others: the eye is outside of these three planes."""
    cube = np.array([[x, y, z] for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)])
    view = frames.view_of_points(cube, up_axis)
    np.testing.assert_array_equal(view["up"], frames.up_of(up_axis))
    for outwards in (view["up"], front, (1, 0, 0)):
        assert np.dot(view["eye"], outwards) > 1.5


def test_a_scene_with_z_up_is_seen_as_the_same_scene_with_y_up(rng):
    points = rng.normal(size=(50, 3))
    lying = points[:, [0, 2, 1]] * [1, -1, 1]  # y becomes z, and z becomes −y
    for name, value in frames.view_of_points(lying, "z").items():
        expected = frames.view_of_points(points)[name]
        np.testing.assert_allclose(value, expected if name == "fov" else expected[[0, 2, 1]] * [1, -1, 1], atol=1e-12)


def test_without_points_the_camera_looks_at_the_origin():
    view = frames.view_of_points(np.zeros((0, 3)))
    assert view["at"].tolist() == [0, 0, 0]
    assert np.linalg.norm(view["eye"]) > 0


# ── view ──


PLACE = {"eye": np.array([0.0, 0.0, 5.0]), "at": np.zeros(3), "up": np.array([0.0, 1.0, 0.0])}


@pytest.mark.parametrize(
    "shape", [{}, {"fovy": 30.0}, {"fovy": 120.0, "focal_distance": 2.5}, {"screen_window": (-3.0, 1.0, 0.5, 2.0)}]
)
def test_windows_are_those_of_the_document(shape):
    """RT-3, RT-4, for wide and high images."""
    told = {"fov" if name == "fovy" else name: value for name, value in shape.items()}
    for width, height in ((6, 4), (4, 6), (5, 5)):
        window = views.CameraView(**PLACE, **told).window(width / height)
        assert window == pytest.approx(oracle.window(width, height, **shape))


def test_a_square_is_stretched_where_window_and_image_differ_in_shape():
    """C-11."""
    assert views.CameraView(**PLACE, screen_window=(-5.3, 5.3, -4, 4)).stretch(2800, 1800) == pytest.approx(
        1.174, abs=1e-3
    )
    assert views.CameraView(**PLACE, screen_window=(-3, 1, 0, 2)).stretch(80, 40) == 1


def test_a_view_does_not_change_with_the_arrays_that_it_was_made_of():
    values = {**PLACE, "eye": np.array([0.0, 0.0, 5.0]), "fov": 60, "screen_window": None}
    usual = {"handedness": "left", "frame_aspect": None, "focal_distance": 1}
    view = views.CameraView.checked({**values, **usual}, views.check_angle)
    values["eye"][0] = 9
    np.testing.assert_array_equal(view.eye, [0, 0, 5])
