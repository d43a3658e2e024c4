"""The frame and the window of a camera, in float64."""

import numpy as np
import pytest
from oracles import cameras as oracle

from taichi_tracer.formulas import camera_frame as frames
from taichi_tracer.system.errors import InputError

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


@pytest.mark.parametrize("aspect", [0.25, 1.0, 4.0])
def test_view_of_box_shows_all_of_it(aspect):
    low, high = np.array([-3, 1, 2.0]), np.array([4, 2, 9.0])
    view = frames.view_of_box(low, high, 50.0, aspect)
    corners = np.stack(np.meshgrid(*zip(low, high, strict=True)), -1).reshape(-1, 3)
    local = (corners - view["eye"]) @ frames.camera_frame(view["eye"], view["at"], view["up"])[:3, :3]
    tangent = np.tan(np.deg2rad(25))
    assert (local[:, 2] > 0).all()
    assert (np.abs(local[:, 1]) <= tangent * local[:, 2]).all()
    assert (np.abs(local[:, 0]) <= aspect * tangent * local[:, 2]).all()


@pytest.mark.parametrize(
    "shape", [{}, {"fovy": 30.0}, {"fovy": 120.0, "focal_distance": 2.5}, {"screen_window": (-3.0, 1.0, 0.5, 2.0)}]
)
def test_windows_are_those_of_the_document(shape):
    """RT-3, RT-4, for wide and high images."""
    told = {"fov" if name == "fovy" else name: value for name, value in shape.items()}
    for width, height in ((6, 4), (4, 6), (5, 5)):
        assert frames.window_of(width / height, **told) == pytest.approx(oracle.window(width, height, **shape))


def test_a_square_is_stretched_where_window_and_image_differ_in_shape():
    """C-11."""
    assert frames.stretch_of((-5.3, 5.3, -4, 4), 2800, 1800) == pytest.approx(1.174, abs=1e-3)
    assert frames.stretch_of((-3, 1, 0, 2), 80, 40) == 1


@pytest.mark.parametrize("value", ["there", (0, 1), (0, 1, float("nan")), None])
def test_numbers_are_counted_and_finite(value):
    with pytest.raises(InputError, match="camera: at must be 3"):
        frames.numbers("at", value, 3)
    np.testing.assert_array_equal(frames.numbers("at", [1, 2, 3], 3), [1, 2, 3])
