"""Sixteen eye rays at once have the bits of ``generate_ray``, and lanes step aside where a camera is its own."""

import numpy as np
import taichi as ti
import taichi.math as tm

import taichi_tracer as tt
from taichi_tracer.camera import Camera, ProjectiveCamera
from taichi_tracer.fast.lanes import LANES, lanes
from taichi_tracer.fast.pixel_lanes import PerspectiveLanes, generate_rays, lanes_of


@ti.kernel
def _both(form: ti.template(), camera: ti.template(), xi: ti.types.ndarray(ndim=2), out: ti.types.ndarray(ndim=3)):
    for i in range(xi.shape[0]):
        x = ti.Vector([lane % 7 for lane in range(LANES)])
        y = ti.Vector([lane // 7 + i for lane in range(LANES)])
        xi_x, xi_y = lanes(0.0), lanes(0.0)
        for lane in ti.static(range(LANES)):
            xi_x[lane], xi_y[lane] = xi[i, 2 * lane], xi[i, 2 * lane + 1]
        ox, oy, oz, dx, dy, dz = generate_rays(form, camera, x, y, xi_x, xi_y)
        all_ox, all_oy, all_oz = lanes(0.0) + ox, lanes(0.0) + oy, lanes(0.0) + oz
        all_dx, all_dy, all_dz = lanes(0.0) + dx, lanes(0.0) + dy, lanes(0.0) + dz
        for lane in ti.static(range(LANES)):
            ray = camera.generate_ray(x[lane], y[lane], True, tm.vec2(xi_x[lane], xi_y[lane]))
            for k in ti.static(range(3)):
                out[i, lane, k], out[i, lane, 3 + k] = ray.origin[k], ray.direction[k]
            out[i, lane, 6], out[i, lane, 7], out[i, lane, 8] = all_ox[lane], all_oy[lane], all_oz[lane]
            out[i, lane, 9], out[i, lane, 10], out[i, lane, 11] = all_dx[lane], all_dy[lane], all_dz[lane]


def test_a_camera_with_a_method_of_its_own_has_no_lanes(f32, monkeypatch):
    @ti.data_oriented
    class Mine(Camera):
        @ti.func
        def generate_ndc_coords(self, pixel_x, pixel_y):
            return tm.vec2(0)

    class Renamed(Camera):
        name = "renamed"

    assert lanes_of(Mine(4, 4)) is None
    assert lanes_of(Renamed(4, 4)) is PerspectiveLanes
    camera = Camera(4, 4)
    monkeypatch.setattr(Camera, "generate_ray", Mine.generate_ndc_coords)
    assert lanes_of(camera) is None
    monkeypatch.undo()
    camera.compute_matrix = lambda: np.eye(4)
    assert lanes_of(camera) is None


def test_a_camera_that_is_neither_has_no_lanes(f32):
    @ti.data_oriented
    class Fisheye(ProjectiveCamera):
        @classmethod
        def check_fov(cls, fov, screen_window):
            return fov

        @ti.func
        def ray_through(self, ndc):
            return tt.Ray(origin=tm.vec3(0), direction=tm.vec3(ndc.x, ndc.y, 1))

    assert lanes_of(Fisheye(4, 4, fov=100.0)) is None
