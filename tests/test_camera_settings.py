"""What can be set of a camera, the views that cannot be (C-6), and windows (RT-3, RT-4)."""

import numpy as np
import pytest
from oracles import cameras as window_oracle

import taichi_tracer as tt
from taichi_tracer.camera import make_camera
from taichi_tracer.cameras.orthographic import OrthographicCamera

CAMERAS = ["perspective", "orthographic"]


class Mine(tt.Camera):
    """A camera of somebody else."""


def rays_of(camera):
    """Origins and directions of all pixels."""
    return camera.rays(*np.mgrid[: camera.width, : camera.height])


@pytest.mark.parametrize(
    ("parameters", "message"),
    [
        ({"fov": 0}, "fov must be between 0 and 180 degrees (both excluded), not 0"),
        ({"fov": 180}, "not 180"),
        ({"fov": float("nan")}, "not nan"),
        ({"eye": (1, 2, 3), "at": (1, 2, 3)}, "eye and at are the same point (1, 2, 3)"),
        ({"eye": (0, 5, 0)}, "up (0, 1, 0) is parallel to the gaze (0, -5, 0)"),
        ({"up": (0, 0, 0)}, "up (0, 0, 0)"),
        ({"eye": (0, float("inf"), 0)}, "eye must be 3 finite numbers"),
        ({"at": (0, 1)}, "at must be 3 finite numbers"),
        ({"at": "there"}, "at must be 3 numbers"),
        ({"width": 0}, "width must be a whole number of at least 1, not 0"),
        ({"height": 2.5}, "height must be a whole number"),
        ({"handedness": "rigth"}, "right"),
    ],
)
def test_a_camera_that_cannot_be_is_an_error_with_its_value(f32, parameters, message):
    with pytest.raises(tt.InputError) as error:
        tt.Camera(**parameters)
    assert message in str(error.value)


def test_an_error_leaves_the_camera_as_it_was(f32):
    camera = tt.Camera(4, 4)
    before, version = rays_of(camera), camera.version
    with pytest.raises(tt.InputError):
        camera.set_camera_parameters(eye=(9, 9, 9), fov=200)
    np.testing.assert_array_equal(rays_of(camera), before)
    assert camera.version == version
    camera.set_camera_parameters(fov=30)
    assert camera.version == version + 1
    assert camera.fov == 30
    np.testing.assert_array_equal(camera.eye, [0, 0, 5])


@pytest.mark.parametrize("projection", CAMERAS)
@pytest.mark.parametrize("shape", [{}, {"frame_aspect": 2.5}, {"fovy": 30.0}, {"fovy": 80.0, "frame_aspect": 0.5}])
def test_windows_follow_the_rules_of_the_document(f32, projection, shape):
    """RT-3 and RT-4, for wide, square and high images and with a focal distance, which an angle makes irrelevant."""
    if projection == "orthographic" and "fovy" in shape:
        pytest.skip("parallel rays have no angle")
    told = {"fov" if name == "fovy" else name: value for name, value in shape.items()}
    if "fovy" not in shape:
        told["screen_window"] = "default"
    camera = make_camera(6, 4, projection, **told, focal_distance=2.0)
    assert camera.screen_window == pytest.approx(window_oracle.window(6, 4, **shape, focal_distance=2.0))


def test_the_default_window_is_1_along_the_shorter_axis(f32):
    view = {"eye": (0, 0, 1), "at": (0, 0, 0), "up": (0, 1, 0)}
    assert OrthographicCamera(28, 18, **view).screen_window == pytest.approx((-28 / 18, 28 / 18, -1, 1))
    assert OrthographicCamera(18, 36, **view).screen_window == (-1, 1, -2, 2)
    assert OrthographicCamera(4, 4, **view, frame_aspect=2).screen_window == (-2, 2, -1, 1)
    assert OrthographicCamera(4, 4, **view, frame_aspect=2).stretch == 0.5


def test_the_window_of_the_document_belongs_to_fovy_90(f32):
    """C-10: "fovy 30 defaults to −1.555 1.555 −1 1" is wrong."""
    assert tt.Camera(2800, 1800, fov=90).screen_window == pytest.approx((-1.5556, 1.5556, -1, 1), abs=1e-4)
    assert tt.Camera(2800, 1800, fov=30).screen_window[3] == pytest.approx(0.26795, abs=1e-5)


def test_an_angle_beside_a_window_is_told_and_does_not_count(f32):
    """C-9."""
    with pytest.warns(UserWarning, match=r"fov 30 does not count beside screen_window \(-1, 1, -1, 1\)"):
        camera = tt.Camera(4, 4, fov=30, screen_window=(-1, 1, -1, 1))
    assert camera.fov == pytest.approx(90)
    camera.set_camera_parameters(fov=60)
    assert camera.fov == 60
    assert not camera.has_window
    camera.set_camera_parameters(screen_window=(0, 1, 0, 1))
    assert camera.fov == pytest.approx(45)


@pytest.mark.parametrize(
    ("projection", "parameters", "message"),
    [
        ("perspective", {"screen_window": (1, -1, -1, 1)}, "l < r and b < t, not (1, -1, -1, 1)"),
        ("orthographic", {"screen_window": (0, 1, 2, 2)}, "l < r and b < t"),
        ("orthographic", {"screen_window": (0, 1, 2)}, "screen_window must be 4 finite numbers"),
        ("orthographic", {"screen_window": (0, 1, 2, float("nan"))}, "screen_window must be 4 finite numbers"),
        ("perspective", {"focal_distance": 0.0}, "focal_distance must be a finite number above 0, not 0"),
        ("orthographic", {"frame_aspect": -1.0}, "frame_aspect must be a finite number above 0, not -1"),
        ("fisheye", {}, "unknown camera 'fisheye'"),
    ],
)
def test_a_window_that_cannot_be_is_an_error_with_its_value(f32, projection, parameters, message):
    with pytest.raises(tt.InputError) as error:
        make_camera(4, 4, projection, **parameters)
    assert message in str(error.value)


@pytest.mark.parametrize("projection", CAMERAS)
def test_a_camera_is_made_again_from_its_parameters(f32, projection):
    camera = make_camera(5, 4, projection, eye=(1, 2, 3), screen_window=(-1, 2, -1, 1), handedness="right")
    again = make_camera(5, 4, **camera.parameters())
    for a, b in zip(rays_of(camera), rays_of(again), strict=True):
        np.testing.assert_array_equal(a, b)


SETTINGS = {
    "eye": (3, 2, 1),
    "at": [0, 1, 0],
    "up": np.array([1.0, 1.0, 0.0]),
    "fov": 30,
    "handedness": "right",
    "screen_window": (-2, 1, -1, 3),
    "frame_aspect": 2.0,
    "focal_distance": 0.5,
}


@pytest.mark.parametrize(
    ("name", "value", "message"),
    [
        ("eye", "here", "eye must be 3 numbers, not 'here'"),
        ("eye", None, "eye must be 3 finite numbers, not None"),
        ("fov", 180, "fov must be between 0 and 180 degrees"),
        ("fov", "wide", "fov must be a number, not 'wide'"),
        ("handedness", "both", "unknown handedness 'both'"),
        ("screen_window", "whole", "unknown screen_window 'whole': known are default, or four numbers"),
        ("focal_distance", 0, "focal_distance must be a finite number above 0, not 0"),
        ("frame_aspect", [1, 2], "frame_aspect must be a number, not [1, 2]"),
        ("width", 8, "width is 4 and cannot be changed to 8: make a renderer, or a camera, with width=8"),
    ],
)
def test_an_assignment_is_checked_as_the_constructor_checks(f32, name, value, message):
    camera = tt.Camera(4, 4)
    before, version = camera.parameters(), camera.version
    with pytest.raises(tt.InputError) as error:
        setattr(camera, name, value)
    assert message in str(error.value)
    assert camera.version == version
    assert repr(camera.parameters()) == repr(before)


def test_a_camera_is_shown_as_the_call_that_makes_it(f32):
    camera = tt.Camera(640, 480, eye=(0, 1, 3.5), at=(0, 1, 0))
    assert repr(camera) == "Camera(640, 480, eye=(0, 1, 3.5), at=(0, 1, 0), up=(0, 1, 0), fov=60)"
    other = tt.OrthographicCamera(4, 3, handedness="right")
    assert repr(other).endswith("up=(0, 1, 0), screen_window='default', handedness='right')")
    for one in (camera, other, Mine(2, 2)):
        assert repr(eval(repr(one), {type(one).__name__: type(one)})) == repr(one)
