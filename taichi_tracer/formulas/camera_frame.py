"""The frame and the window of a camera, computed in float64 by numpy (A1-6, RT-1, RT-3, RT-4)."""

import math

import numpy as np

from taichi_tracer.system.digits import digits_of
from taichi_tracer.system.errors import InputError

# The smallest sine of the angle between up and the gaze. Below it, f32 positions no longer determine where x_c points.
SMALLEST_SINE = 1e-6
# Replaces the radius of a scene that is a single point, so that the eye does not coincide with the point.
SMALLEST_RADIUS = 1e-30


def camera_frame(eye: np.ndarray, at: np.ndarray, up: np.ndarray, handedness: str = "left") -> np.ndarray:
    """(4, 4) float64 camera-to-world matrix [x_c y_c z_c eye; 0 0 0 1] (A1-6, A1-8); the camera looks along +z_c.

    x_c = up × z_c is the frame of the courses. It shows right-handed data mirrored; ``handedness="right"`` negates x_c
    (C-5).

    Raises:
        InputError: no frame exists, because eye = at, because up = 0, or because up is parallel to the gaze (C-6).
    """
    gaze = at - eye
    if not np.linalg.norm(gaze) > 0:
        raise InputError(f"camera: eye and at are the same point {show(eye)}: move one of them")
    z_c = gaze / np.linalg.norm(gaze)
    if not np.linalg.norm(up) > 0:
        raise InputError(f"camera: up {show(up)} has no direction: choose another up, such as (0, 1, 0)")
    side = np.cross(up, z_c)
    if not np.linalg.norm(side) > SMALLEST_SINE * np.linalg.norm(up):
        raise InputError(f"camera: up {show(up)} is parallel to the gaze {show(gaze)}: choose another up")
    x_c = side / np.linalg.norm(side)
    y_c = np.cross(z_c, x_c)
    if handedness == "right":
        x_c = -x_c
    matrix = np.eye(4)
    matrix[:3, :] = np.stack([x_c, y_c, z_c, eye], axis=1)
    return matrix


def view_of_box(low: np.ndarray, high: np.ndarray, fov: float = 60.0, aspect: float = 1.0) -> dict:
    """Camera parameters (eye, at, up, fov) that show a whole box from +z; its bounding sphere just fits in."""
    at = (np.asarray(low, np.float64) + high) / 2
    radius = max(float(np.linalg.norm(np.asarray(high, np.float64) - low)) / 2, SMALLEST_RADIUS)
    half_angle = math.atan(math.tan(math.radians(fov) / 2) * min(1.0, aspect))
    eye = at + np.array([0.0, 0.0, radius / math.sin(half_angle)])
    return {"eye": eye, "at": at, "up": np.array([0.0, 1.0, 0.0]), "fov": fov}


def show(vector: np.ndarray) -> str:
    """The text of a vector in messages: "(x, y, z)"."""
    return digits_of(vector)


def numbers(name: str, value, count: int) -> np.ndarray:
    """``value`` as an array of ``count`` finite float64 numbers; an InputError if it is something else."""
    try:
        vector = np.asarray(value, dtype=np.float64).reshape(-1)
    except (TypeError, ValueError):
        raise InputError(f"camera: {name} must be {count} numbers, not {value!r}") from None
    if vector.shape != (count,) or not np.isfinite(vector).all():
        raise InputError(f"camera: {name} must be {count} finite numbers, not {value!r}")
    return vector


def default_window(aspect: float) -> tuple[float, float, float, float]:
    """(l, r, b, t): [−1, 1] along the shorter axis of the image, and in proportion along the longer axis (RT-3)."""
    return (-aspect, aspect, -1.0, 1.0) if aspect >= 1 else (-1.0, 1.0, -1 / aspect, 1 / aspect)


def fovy_window(fovy: float, aspect: float, focal_distance: float = 1.0) -> tuple[float, float, float, float]:
    """(l, r, b, t) of the window that a vertical angle of ``fovy`` degrees shows (RT-4)."""
    top = math.tan(math.radians(fovy) / 2) * focal_distance
    return -top * aspect, top * aspect, -top, top


def window_of(aspect: float, fov=None, screen_window=None, focal_distance: float = 1.0) -> tuple[float, ...]:
    """(l, r, b, t) at the focal distance: the given window, that of the angle, or the default (RT-3, RT-4)."""
    if screen_window is not None:
        return tuple(float(edge) for edge in screen_window)
    return default_window(aspect) if fov is None else fovy_window(fov, aspect, focal_distance)


def stretch_of(window, width: int, height: int) -> float:
    """The ratio width / height with which an image of a window shows a square; 1 without distortion (C-11)."""
    l, r, b, t = window
    return width * (t - b) / (height * (r - l))
