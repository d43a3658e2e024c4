"""Cameras: their rays, and their settings."""

import itertools

import numpy as np
import pytest
import taichi as ti
from oracles import cameras as window_oracle

import taichi_tracer as tt
from taichi_tracer.camera import make_camera
from taichi_tracer.formulas.view import default_window
from taichi_tracer.system import runtime

CAMERAS = ["perspective", "orthographic"]


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
    out = np.zeros((camera.height, camera.width, 3), runtime.dtype())
    _directions(camera, out)
    return out


def test_origin_is_the_eye_and_jitter_moves_within_the_pixel(f32):
    camera = tt.Camera(8, 8, eye=(1, 2, 3), at=(0, 0, 0))
    out = np.zeros((3, 3), np.float32)
    _origin_and_jittered(camera, 0.25, -0.5, out)
    np.testing.assert_array_equal(out[0], [1, 2, 3])
    np.testing.assert_allclose(out[1], out[2], atol=1e-7)  # pixel (0.25, −0.5) through its centre


@ti.kernel
def _rays(camera: ti.template(), dx: float, dy: float, origin: ti.types.ndarray(), direction: ti.types.ndarray()):
    for x, y in ti.ndrange(camera.width, camera.height):
        ray = camera.generate_ray(x + dx, y + dy)
        for k in ti.static(range(3)):
            origin[y, x, k] = ray.origin[k]
            direction[y, x, k] = ray.direction[k]


def rays_of(camera, dx=0.0, dy=0.0):
    origin, direction = (np.zeros((camera.height, camera.width, 3), runtime.dtype()) for _ in range(2))
    _rays(camera, dx, dy, origin, direction)
    return origin, direction


@pytest.mark.parametrize("projection", CAMERAS)
def test_windows_give_the_rays_of_the_document(precision, projection, rng):
    """Random frames, every way to say a window, both hands, whole and half pixels (RT-1 … RT-5)."""
    tolerance = 4e-6 if precision == "f32" else 1e-13
    for width, height in ((7, 3), (2, 5)):
        camera = make_camera(width, height, projection)
        windows = [default_window(width / height), (-3.0, 1.0, 0.5, 2.0), (-0.5, 0.5, -0.25, 0.25)]
        for k, (window, handedness) in enumerate(itertools.product(windows, ("left", "right"))):
            eye, at, up = rng.normal(size=(3, 3)) * [[5], [1], [1]]
            place = {"eye": eye, "at": at, "up": up, "handedness": handedness}
            camera.set_camera_parameters(**place, screen_window=window, focal_distance=1 + k / 2)
            dx, dy = (0.25, -0.5) if handedness == "left" else (0.0, 0.0)
            expected = window_oracle.rays(
                projection, width, height, eye, at, up, handedness, focal_distance=1 + k / 2, screen_window=window,
                i=np.arange(width) + dx, j=np.arange(height) + dy,
            )  # fmt: skip
            for found, true, scale in zip(rays_of(camera, dx, dy), expected, (4, 1), strict=True):
                np.testing.assert_allclose(found, true, atol=scale * tolerance)


# ── the steps that a ray is made of, and steps of one's own ──


@ti.kernel
def _steps(camera: ti.template(), out: ti.types.ndarray(ndim=2)):
    for _ in range(1):
        ndc = camera.generate_ndc_coords(2, 1)
        point = camera.generate_camera_coords(ndc)
        matrix = camera.compute_matrix()
        for k in ti.static(range(2)):
            out[0, k] = ndc[k]
        for k in ti.static(range(4)):
            out[1, k] = point[k]
            out[2, k] = (matrix @ point)[k]
        for k in ti.static(range(3)):
            out[3, k], out[4, k], out[5, k] = camera.eye[k], camera.at[k], camera.up[k]
        out[3, 3] = camera.fov


def test_the_steps_of_a_ray_are_those_of_the_handout(precision):
    """A1-4, A1-7, A1-8: pixel (2, 1) of 8 × 4; a kernel may ask for the camera's parameters as well."""
    view = {"eye": (1.0, 2.0, 3.0), "at": (-1.0, 0.5, 0.0), "up": (0.0, 1.0, 0.25), "fov": 70.0}
    camera = tt.Camera(8, 4, **view)
    out = np.zeros((6, 4), runtime.dtype())
    _steps(camera, out)
    tangent = np.tan(np.deg2rad(35))
    tolerance = {"atol": 8 * runtime.epsilon()}
    np.testing.assert_allclose(out[0, :2], [2 * 2.5 / 8 - 1, 2 * 1.5 / 4 - 1], **tolerance)
    np.testing.assert_allclose(out[1], [out[0, 0] * tangent * 2, out[0, 1] * tangent, 1, 0], **tolerance)
    np.testing.assert_allclose(out[2], camera.compute_matrix() @ out[1], **tolerance)
    np.testing.assert_allclose(out[3:, :3], [view["eye"], view["at"], view["up"]], **tolerance)
    assert out[3, 3] == runtime.dtype()(70)


@ti.data_oriented
class ByHandout(tt.Camera):
    """A student's methods with the handout's signatures: the picture is turned upside down in NDC."""

    @ti.func
    def generate_ndc_coords(self, pixel_x, pixel_y):
        return ti.math.vec2(2 * (pixel_x + 0.5) / self.width - 1, 1 - 2 * (pixel_y + 0.5) / self.height)


@ti.data_oriented
class OwnMatrix(tt.Camera):
    """A student's matrix, written for kernels, from the camera's parameters: the frame of A1-8 with x negated."""

    @ti.func
    def compute_matrix(self):
        z = ti.math.normalize(self.at - self.eye)
        x = -ti.math.normalize(ti.math.cross(self.up, z))
        y = ti.math.cross(z, -x)
        e = self.eye
        return ti.math.mat4(
            x.x, y.x, z.x, e.x, x.y, y.y, z.y, e.y, x.z, y.z, z.z, e.z, 0.0, 0.0, 0.0, 1.0
        )  # fmt: skip


@ti.data_oriented
class OwnMatrixInPython(tt.Camera):
    """The same in Python."""

    def compute_matrix(self):
        matrix = super().compute_matrix()
        matrix[:, 0] *= -1
        return matrix


def test_a_step_of_ones_own_decides_the_rays(precision):
    view = {"eye": (1.0, 2.0, 3.0), "at": (-1.0, 0.5, 0.0), "fov": 70.0}
    plain, upside_down = (directions_of(make(6, 4, **view)) for make in (tt.Camera, ByHandout))
    np.testing.assert_allclose(upside_down, plain[::-1], atol=4 * runtime.epsilon())
    right = directions_of(tt.Camera(6, 4, **view, handedness="right"))
    assert np.abs(plain - right).max() > 0.1
    for own in (OwnMatrix, OwnMatrixInPython):
        np.testing.assert_allclose(directions_of(own(6, 4, **view)), right, atol=8 * runtime.epsilon())


@ti.kernel
def _jittered(camera: ti.template(), count: int, out: ti.types.ndarray(ndim=2)):
    for i in range(count):
        ndc = camera.generate_ndc_coords(2, 1, True)
        out[i, 0], out[i, 1] = ndc.x, ndc.y


def test_jitter_without_numbers_draws_them(f32):
    """A point of the pixel, different each time: pixel (2, 1) of 8 × 4 is [−1/2, −1/4) × [−1/2, 0) of the plane."""
    out = np.zeros((2_000, 2), np.float32)
    _jittered(tt.Camera(8, 4), len(out), out)
    assert (out >= [-0.5, -0.5]).all()
    assert (out <= [-0.25, 0.0]).all()
    z = (out.mean(axis=0) - [-0.375, -0.25]) / (np.array([0.25, 0.5]) / np.sqrt(12 * len(out)))
    assert np.abs(z).max() < 4.5  # p = 7e-6 each
    assert len(np.unique(out[:, 0])) > 1_900


# ── from Python ──


def test_python_gets_the_rays_of_pixels(precision):
    """In one call as in many, for whole pixels and fractions, in the shape of intersect; y counts from the bottom."""
    camera = tt.Camera(7, 5, eye=(1, 2, 3), at=(0, 0, 0), fov=40)
    origins, directions = camera.rays(*np.mgrid[:7, :5])
    assert origins.shape == directions.shape == (35, 3)
    assert origins.dtype == directions.dtype == runtime.dtype()
    expected = directions_of(camera).transpose(1, 0, 2).reshape(35, 3)
    np.testing.assert_array_equal(directions, expected)
    np.testing.assert_array_equal(origins, np.tile(camera.eye, (35, 1)))
    np.testing.assert_array_equal(camera.rays(6, [0, 4])[1], expected[[30, 34]])
    origin, direction = camera.rays(0.25, -0.5)
    out = np.zeros((3, 3), runtime.dtype())
    _origin_and_jittered(camera, 0.25, -0.5, out)
    np.testing.assert_array_equal(direction[0], out[1])
    assert origin.shape == (1, 3)
    assert len(camera.rays([], [])[0]) == 0


# ── settings ──


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
        ({"at": "there"}, "at must be 3 finite numbers"),
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
        ("eye", "here", "eye must be 3 finite numbers, not 'here'"),
        ("eye", None, "eye must be 3 finite numbers, not None"),
        ("fov", 180, "fov must be between 0 and 180 degrees"),
        ("fov", "wide", "fov must be a finite number, not 'wide'"),
        ("handedness", "both", "unknown handedness 'both'"),
        ("screen_window", "whole", "unknown screen_window 'whole': known are default, or four numbers"),
        ("focal_distance", 0, "focal_distance must be a finite number above 0, not 0"),
        ("frame_aspect", [1, 2], "frame_aspect must be a finite number, not [1, 2]"),
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
