"""The orthographic camera, beside what all cameras do: it has no angle."""

import pytest

import taichi_tracer as tt
from taichi_tracer.camera import make_camera
from taichi_tracer.cameras.orthographic import OrthographicCamera


def test_an_orthographic_camera_of_an_angle_shows_the_same_where_it_looks(f32):
    view = {"eye": (0, 0, 5), "at": (0, 0, 1), "up": (0, 1, 0), "fov": 90.0}
    camera = make_camera(20, 10, "orthographic", **view)
    assert camera.screen_window == pytest.approx((-8, 8, -4, 4))


def test_parallel_rays_have_no_angle(f32):
    with pytest.raises(tt.InputError, match="an orthographic camera has no fov"):
        OrthographicCamera(4, 4, fov=30)
    with pytest.raises(TypeError, match="unexpected keyword argument 'fog'"):
        tt.Camera(4, 4).set_camera_parameters(fog=1)


def test_an_orthographic_camera_has_no_angle(f32):
    camera = tt.OrthographicCamera(4, 4)
    with pytest.raises(tt.InputError, match="an orthographic camera has no fov"):
        camera.fov = 30
    assert not hasattr(camera, "fov")
