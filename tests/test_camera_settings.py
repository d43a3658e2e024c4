"""What can be set of a camera, the views that cannot be (C-6), and windows (RT-3, RT-4)."""

import pytest
from oracles import cameras as window_oracle

import taichi_tracer as tt
from taichi_tracer.camera import make_camera

CAMERAS = ["perspective", "orthographic"]


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


SHAPES = [{}, {"frame_aspect": 2.5}, {"fovy": 30.0}, {"fovy": 80.0, "frame_aspect": 0.5}]
PARALLEL = "orthographic"  # its rays have no angle


@pytest.mark.parametrize(
    ("projection", "shape"), [(p, s) for p in CAMERAS for s in SHAPES if p != PARALLEL or "fovy" not in s]
)
def test_windows_follow_the_rules_of_the_document(f32, projection, shape):
    """RT-3 and RT-4, for wide, square and high images and with a focal distance, which an angle makes irrelevant."""
    told = {"fov" if name == "fovy" else name: value for name, value in shape.items()}
    if "fovy" not in shape:
        told["screen_window"] = "default"
    camera = make_camera(6, 4, projection, **told, focal_distance=2.0)
    assert camera.screen_window == pytest.approx(window_oracle.window(6, 4, **shape, focal_distance=2.0))


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


def test_an_angle_beside_a_window_is_told(f32):
    with pytest.warns(UserWarning, match=r"fov 45 does not count beside screen_window \(-1, 1, -2, 2\)"):
        make_camera(4, 4, "perspective", fov=45.0, screen_window=(-1, 1, -2, 2))
