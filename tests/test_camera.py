"""Eye rays against the formulas in float64, and the cameras that cannot be (C-6)."""

import numpy as np
import pytest
import taichi as ti
from oracles import rays as oracle

import taichi_tracer as tt


@ti.kernel
def _directions(camera: ti.template(), out: ti.types.ndarray(ndim=3)):
    for x, y in ti.ndrange(camera.width, camera.height):
        ray = camera.generate_ray(x, y)
        for k in ti.static(range(3)):
            out[y, x, k] = ray.direction[k]


@ti.kernel
def _origin_and_jittered(camera: ti.template(), px: float, py: float, out: ti.types.ndarray(ndim=2)):
    ray = camera.generate_ray(px, py)
    jittered = camera.generate_ray(0, 0, True, ti.math.vec2(px + 0.5, py + 0.5))
    for k in ti.static(range(3)):
        out[0, k], out[1, k], out[2, k] = ray.origin[k], ray.direction[k], jittered.direction[k]


def directions_of(camera):
    from taichi_tracer import runtime

    out = np.zeros((camera.height, camera.width, 3), runtime.dtype())
    _directions(camera, out)
    return out


@pytest.mark.parametrize("handedness", ["left", "right"])
def test_rays_are_those_of_the_formulas(precision, handedness, rng):
    """Random frames, fields of view and aspect ratios, a one-pixel row and a one-pixel column included."""
    tolerance = 1e-6 if precision == "f32" else 1e-14
    for width, height, fov in ((7, 5, 60.0), (1, 9, 20.0), (12, 1, 100.0), (3, 3, 0.01), (4, 3, 179.9)):
        eye, at, up = rng.normal(size=(3, 3)) * [[5], [1], [1]]
        camera = tt.Camera(width, height, eye=eye, at=at, up=up, fov=fov, handedness=handedness)
        expected = oracle.eye_rays(eye, at, up, fov, width, height, handedness)
        np.testing.assert_allclose(directions_of(camera), expected, atol=tolerance)


def test_directions_have_unit_length(precision):
    lengths = np.linalg.norm(directions_of(tt.Camera(33, 21, fov=120.0)).astype(np.float64), axis=-1)
    np.testing.assert_allclose(lengths, 1, atol=2e-7 if precision == "f32" else 1e-15)


def test_origin_is_the_eye_and_jitter_moves_within_the_pixel(f32):
    camera = tt.Camera(8, 8, eye=(1, 2, 3), at=(0, 0, 0))
    out = np.zeros((3, 3), np.float32)
    _origin_and_jittered(camera, 0.25, -0.5, out)
    np.testing.assert_array_equal(out[0], [1, 2, 3])
    np.testing.assert_allclose(out[1], out[2], atol=1e-7)  # pixel (0.25, −0.5) through its centre


def test_the_courses_frame_shows_the_world_mirrored(f32):
    """Seen from +z, the right of the picture is −x; and +x with handedness="right" (C-5)."""
    view = {"eye": (0, 0, 5), "at": (0, 0, 0), "up": (0, 1, 0)}
    assert directions_of(tt.Camera(2, 1, **view))[0, 1, 0] < 0
    assert directions_of(tt.Camera(2, 1, **view, handedness="right"))[0, 1, 0] > 0


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
    before, version = directions_of(camera), camera.version
    with pytest.raises(tt.InputError):
        camera.set_camera_parameters(eye=(9, 9, 9), fov=200)
    np.testing.assert_array_equal(directions_of(camera), before)
    assert camera.version == version
    camera.set_camera_parameters(fov=30)
    assert camera.version == version + 1
    assert camera.fov == 30
    np.testing.assert_array_equal(camera.eye, [0, 0, 5])


@pytest.mark.parametrize("aspect", [0.25, 1.0, 4.0])
def test_view_of_box_shows_all_of_it(f32, aspect):
    from taichi_tracer.camera import camera_frame, view_of_box

    low, high = np.array([-3, 1, 2.0]), np.array([4, 2, 9.0])
    view = view_of_box(low, high, 50.0, aspect)
    corners = np.stack(np.meshgrid(*zip(low, high, strict=True)), -1).reshape(-1, 3)
    local = (corners - view["eye"]) @ camera_frame(view["eye"], view["at"], view["up"])[:3, :3]
    tangent = np.tan(np.deg2rad(25))
    assert (local[:, 2] > 0).all()
    assert (np.abs(local[:, 1]) <= tangent * local[:, 2]).all()
    assert (np.abs(local[:, 0]) <= aspect * tangent * local[:, 2]).all()
