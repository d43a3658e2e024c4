"""What every camera must do: finite rays of unit length, that follow the camera wherever it is put.

A camera that is registered is a class. Each check makes one of it, 33 × 24 pixels, and moves it.
"""

from functools import lru_cache

import numpy as np
import taichi as ti

from taichi_tracer.camera import make_camera, through_pixel
from taichi_tracer.contracts.lab import Rows
from taichi_tracer.contracts.statistics import CORNERS, check_near, check_unit
from taichi_tracer.system import runtime

WIDTH, HEIGHT = 33, 24
PIXELS = np.mgrid[0:HEIGHT, 0:WIDTH][::-1].reshape(2, -1).T.astype(float)  # (N, 2) of the picture, x fastest
POSES = {  # eye, at, up
    "along −z": ((0, 0, 5), (0, 0, 0), (0, 1, 0)),
    "askew": ((3, -2, 1), (-1, 0.5, 0.3), (0.3, 0.2, 1)),
    "straight down": ((0, 7, 0), (0, 0, 0), (1, 0, 0)),
    "far from the origin": ((1000, 2000, -500), (1003, 2001, -502), (0, 1, 0)),
    "close": ((0, 0, 1e-3), (0, 0, 0), (0, 1, 0)),
}
# f32 rounds a unit vector by 6e-8 in each of some ten operations; the origins are as exact as the eye's own numbers.
TOLERANCE = 2e-6


@lru_cache(maxsize=4)
def eye_rays(camera, jitter):
    """A function of pixels and the points within them → origins and directions."""

    @ti.func
    def eye_ray(pixel, xi):
        ray = through_pixel(camera.generate_ray, pixel.x, pixel.y, jitter, xi)
        return ray.origin, ray.direction

    return Rows(eye_ray, [2, 2], [3, 3])


def rays(camera, pixels, xi=None):
    """Origins and directions, (N, 3) float64, of the eye rays of (N, 2) pixels, which may be fractions.

    Args:
        xi: (N, 2) the point within each pixel; None is its centre.
    """
    return eye_rays(camera, xi is not None)(pixels, (0.5, 0.5) if xi is None else xi)


def poses(camera):
    """The camera in one pose after the other: (name, eye, at, up)."""
    for name, pose in POSES.items():
        eye, at, up = (np.asarray(v, np.float64) for v in pose)
        camera.set_camera_parameters(eye=eye, at=at, up=up)
        yield name, eye, at, up


# ── the checks ──


def check_rays_are_finite(camera):
    """Every ray is finite, and its direction has unit length: at pixel centres, at corners, wherever the camera is."""
    xi = np.random.default_rng(1).random(PIXELS.shape)
    xi[-4:] = CORNERS
    for name, *_ in poses(camera):
        for o, d in (rays(camera, PIXELS), rays(camera, PIXELS, xi)):
            wrong = ~np.isfinite(np.column_stack([o, d])).all(axis=1)
            assert not wrong.any(), f"{camera.name}, {name}: pixel {PIXELS[wrong][0]} has a ray that is not finite"
            check_unit(f"{camera.name}, {name}", d, TOLERANCE)


def check_central_ray_meets_at(camera):
    """The ray through the middle of the picture passes through the point that is looked at, in front of its origin."""
    left, right, _, _ = camera.screen_window
    for name, eye, at, _ in poses(camera):
        o, d = (v[0] for v in rays(camera, [(WIDTH - 1) / 2, (HEIGHT - 1) / 2]))
        distance = np.linalg.norm(at - eye)
        past = np.linalg.norm(np.cross(at - o, d))
        limit = TOLERANCE * (distance + np.abs(eye).max() + (right - left) * camera.is_parallel)  # in world units
        assert past < limit, f"{camera.name}, {name}: the central ray passes {past:.2g} from at"
        assert (at - o) @ d > 0, f"{camera.name}, {name}: the central ray leads away from at"


def check_rays_move_with_the_camera(camera):
    """A camera that is turned and moved has rays that are turned and moved with it."""
    turn, _ = np.linalg.qr(np.random.default_rng(4).normal(size=(3, 3)))
    turn *= np.linalg.det(turn)  # a rotation, without a mirror
    move = np.array([0.5, -2.0, 1.5])
    for name, eye, at, up in poses(camera):
        o, d = rays(camera, PIXELS)
        camera.set_camera_parameters(eye=turn @ eye + move, at=turn @ at + move, up=turn @ up)
        o_moved, d_moved = rays(camera, PIXELS)
        # eye and at are rounded to f32 on their way, if they are; far away that turns the gaze.
        gaze = 4 * np.abs(eye).max() / np.linalg.norm(at - eye) if runtime.dtype() == np.float32 else 0
        limit, what = TOLERANCE * (10 + 0.1 * gaze), f"{camera.name}, {name}"
        check_near(f"{what}: the directions do not turn with the camera", d_moved, d @ turn.T, limit)
        size = 1 + np.abs(eye).max() + np.abs(o - eye).max()
        check_near(f"{what}: the origins do not move with the camera", o_moved, o @ turn.T + move, limit * size)


def check_handedness_mirrors(camera):
    """The picture of the other handedness is the mirror image."""
    mirrored = np.column_stack([WIDTH - 1 - PIXELS[:, 0], PIXELS[:, 1]])
    for name, eye, *_ in poses(camera):
        camera.set_camera_parameters(handedness="right")
        right = rays(camera, mirrored)
        camera.set_camera_parameters(handedness="left")
        for one, other, size in zip(rays(camera, PIXELS), right, (1 + np.abs(eye).max(), 1), strict=True):
            check_near(f"{camera.name}, {name}: rays are not mirrored by handedness", one, other, TOLERANCE * size)


def check_fractions_of_a_pixel(camera):
    """Neighbours have different rays, and the point xi within a pixel is the pixel + xi − 1/2."""
    xi = np.random.default_rng(2).random(PIXELS.shape)
    for name, *_ in poses(camera):
        here = np.hstack(rays(camera, PIXELS))
        for step in (1, WIDTH):
            size = np.linalg.norm(here[step:] - here[:-step], axis=1)
            assert size.min() > 0, f"{camera.name}, {name}: pixel {PIXELS[size.argmin()]} has the ray of the next one"
        jittered, fraction = np.hstack(rays(camera, PIXELS, xi)), np.hstack(rays(camera, PIXELS + xi - 0.5))
        what = f"{camera.name}, {name}: the point xi of a pixel is not the pixel + xi − 1/2"
        check_near(what, jittered, fraction, TOLERANCE * (1 + np.abs(fraction).max()))


def check_it_can_be_made_again(camera):
    """``make_camera`` with its ``parameters`` makes a camera with the same rays: files and checkpoints rely on it."""
    other = make_camera(WIDTH, HEIGHT, **camera.parameters())
    same = all((a == b).all() for a, b in zip(rays(camera, PIXELS), rays(other, PIXELS), strict=True))
    assert same, f"{camera.name}: make_camera(**parameters()) makes a {type(other).__name__} with other rays"


STEPS = (
    check_rays_are_finite,
    check_central_ray_meets_at,
    check_rays_move_with_the_camera,
    check_handedness_mirrors,
    check_fractions_of_a_pixel,
    check_it_can_be_made_again,
)
