"""Rays of the package's cameras for sixteen pixels at once, with the same bits as ``generate_ray``."""

import taichi as ti

from taichi_tracer.camera import Camera
from taichi_tracer.cameras.orthographic import OrthographicCamera
from taichi_tracer.system.seams import replaced


class PerspectiveLanes:
    """Rays of ``Camera``; all of them start at the eye."""

    share_origin = True

    @staticmethod
    @ti.func
    def rays_through(camera: ti.template(), x, y):
        """Components of the common origin and of the directions, for several points of the image plane."""
        m = camera.camera_to_world[None]
        dx = m[0, 0] * x + m[0, 1] * y + m[0, 2]
        dy = m[1, 0] * x + m[1, 1] * y + m[1, 2]
        dz = m[2, 0] * x + m[2, 1] * y + m[2, 2]
        scale = 1 / ti.sqrt(dx * dx + dy * dy + dz * dz)
        return m[0, 3], m[1, 3], m[2, 3], dx * scale, dy * scale, dz * scale


class OrthographicLanes:
    """Rays of ``OrthographicCamera``; all of them have the same direction."""

    share_origin = False

    @staticmethod
    @ti.func
    def rays_through(camera: ti.template(), x, y):
        """Components of the origins and of the common direction, for several points of the image plane."""
        m = camera.camera_to_world[None]
        ox = m[0, 0] * x + m[0, 1] * y + m[0, 3]
        oy = m[1, 0] * x + m[1, 1] * y + m[1, 3]
        oz = m[2, 0] * x + m[2, 1] * y + m[2, 3]
        return ox, oy, oz, m[0, 2], m[1, 2], m[2, 2]


STAND_INS = {Camera: PerspectiveLanes, OrthographicCamera: OrthographicLanes}


def lanes_of(camera):
    """The class with the rays of a camera; None if one of the camera's methods was replaced."""
    if replaced(camera):
        return None
    return next((STAND_INS[cls] for cls in type(camera).__mro__ if cls in STAND_INS), None)


@ti.func
def generate_rays(form: ti.template(), camera: ti.template(), pixel_x, pixel_y, xi_x, xi_y):
    """``generate_ray`` through the points ξ of several pixels: six components, each a vector or one common number."""
    half, centre = camera.half_size[None], camera.centre[None]
    x = (2 * (pixel_x + xi_x) / camera.width - 1) * half.x + centre.x
    y = (2 * (pixel_y + xi_y) / camera.height - 1) * half.y + centre.y
    return form.rays_through(camera, x, y)
