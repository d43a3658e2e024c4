"""The frame and the windows of cameras, computed in float64 by numpy (A1-6, RT-1, RT-3, RT-4)."""

import math

import numpy as np

from taichi_tracer.formulas.points import box_of
from taichi_tracer.system.errors import InputError, one_of
from taichi_tracer.system.formatting import digits_of

# The smallest sine of the angle between up and the gaze. Below it, f32 positions no longer determine where x_c points.
SMALLEST_SINE = 1e-6
# The smallest distance from the eye to a scene, so that the two differ in f32: as a length, and as a share of the
# largest coordinate, of which f32 has steps of up to 1.2e-7. What is smaller than these steps is a single point.
SMALLEST_DISTANCE, SMALLEST_SHARE = 1e-30, 5e-7
HANDEDNESS = ("left", "right")
USUAL_HANDEDNESS = HANDEDNESS[0]  # as in the courses (C-5)
UP_AXES = {"y": (0.0, 1.0, 0.0), "z": (0.0, 0.0, 1.0)}  # the direction that is up in a scene, by the name of its axis
# The view of a scene without a camera of its own: from the front, turned by the first angle to the side and raised by
# the second, in degrees. No side of a box is then seen edge-on, and its front is larger than its side and its top.
FROM = 35.0, 25.0
DEFAULT_FOV = 40.0  # degrees; more would show near parts much larger than far ones
MARGIN = 0.06  # of the picture's half, between the outermost point and the edge


def camera_frame(eye: np.ndarray, at: np.ndarray, up: np.ndarray, handedness: str = USUAL_HANDEDNESS) -> np.ndarray:
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
    if handedness != USUAL_HANDEDNESS:
        x_c = -x_c
    matrix = np.eye(4)
    matrix[:3, :] = np.stack([x_c, y_c, z_c, eye], axis=1)
    return matrix


def up_of(up_axis: str) -> np.ndarray:
    """(3,) the upward direction of a scene; an InputError if ``up_axis`` is neither "y" nor "z"."""
    if up_axis not in UP_AXES:
        raise one_of("up axis", up_axis, UP_AXES)
    return np.array(UP_AXES[up_axis])


def world_axes(up_axis: str) -> np.ndarray:
    """(3, 3) whose columns are the axes of a scene: to the side (+x), upwards, and to the front.

    They are x, y and z if y is up, and x, z and −y if z is up: the second scene is the first, turned about x.
    """
    side, up = np.array([1.0, 0.0, 0.0]), up_of(up_axis)
    return np.stack([side, up, np.cross(side, up)], axis=1)


def view_of_points(
    points: np.ndarray,
    up_axis: str = "y",
    fov: float = DEFAULT_FOV,
    aspect: float = 1.0,
    seen_from: tuple[float, float] = FROM,
) -> dict:
    """Camera parameters (eye, at, up, fov) of a view that shows all points, by default three quarters from above.

    The camera looks at the middle of the points' box. In its frame, with this middle as origin, a point (x, y, z) is
    visible from the distance d if |x| ≤ (d + z) tan(fov/2) · aspect and |y| ≤ (d + z) tan(fov/2). The distance is the
    smallest one at which this holds for all points, with a margin of ``MARGIN``.

    Args:
        points: (n, 3) positions; without any, the camera looks at the origin.
        aspect: width / height of the picture. seen_from: azimuth and elevation in degrees.
    """
    points = np.asarray(points, np.float64) if len(points) > 0 else np.zeros((1, 3))
    low, high = box_of(points)
    at = low + (high - low) / 2
    azimuth, elevation = (math.radians(angle) for angle in seen_from)
    towards_eye = math.sin(azimuth) * math.cos(elevation), math.sin(elevation), math.cos(azimuth) * math.cos(elevation)
    offset, up = world_axes(up_axis) @ towards_eye, up_of(up_axis)
    x, y, z = ((points - at) @ camera_frame(offset, np.zeros(3), up)[:3, :3]).T
    tangent = math.tan(math.radians(fov) / 2) / (1 + MARGIN)
    distance = max(float((abs(x) / (tangent * aspect) - z).max()), float((abs(y) / tangent - z).max()))
    distance = max(distance, SMALLEST_DISTANCE, SMALLEST_SHARE * float(abs(at).max()))
    return {"eye": at + distance * offset, "at": at, "up": up, "fov": fov}


def show(vector: np.ndarray) -> str:
    """The text of a vector in messages: "(x, y, z)"."""
    return digits_of(vector)


def numbers(name: str, value, count: int) -> np.ndarray:
    """``value`` as a new array of ``count`` finite float64 numbers; an InputError if it is something else."""
    try:
        vector = np.array(value, dtype=np.float64).reshape(-1)
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
