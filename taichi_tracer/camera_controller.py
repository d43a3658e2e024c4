"""How keys and the mouse move a camera: plain functions from one pose to the next, and the controller of the course."""

import math
import time
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from taichi_tracer.camera import ProjectiveCamera
from taichi_tracer.formulas.view import USUAL_HANDEDNESS, camera_frame, world_axes
from taichi_tracer.system.errors import InputError

SPEED = 1.5  # units per second, along every axis (A1-16), in a scene whose longest side is within this range:
USUAL_SIZES = 0.5, 5.0
SPEED_SHARE = 0.75  # of the longest side of any other scene, per second; in the Cornell box, 1.5 units are as much
ZOOM_RATE = 1.0  # the distance to ``at`` changes by a factor of e in one second
ORBIT_ANGLE = math.pi  # a drag across the whole picture turns the camera by half a circle
ZOOM_DRAG = 2.0  # a drag over the whole height changes the distance by a factor of e²
POLE_ANGLE = math.radians(1.0)  # an orbit stops this close to ``up``, where no frame exists
LARGEST_EXPONENT = 88.0  # e to the power of more is beyond f32

# key → (the axis of the screen, or of the scene as in ``world_axes``, and the sign)
WORLD_KEYS = {"d": (0, 1), "a": (0, -1), "w": (1, 1), "s": (1, -1), "e": (2, 1), "q": (2, -1)}
ARROWS = {"Right": (0, 1), "Left": (0, -1), "Up": (1, 1), "Down": (1, -1)}
ZOOM_KEYS = {"i": -1, "o": 1}
WINDOW_KEYS = {"e": -1, "q": 1}  # of an orthographic camera, whose picture no step along its gaze would change
KEYS = (*WORLD_KEYS, *ARROWS, *ZOOM_KEYS)


class CameraController:
    """Moves a camera by the keys that are held down in a window of ``ti.ui`` (A1-16).

    Args:
        camera: it is moved by ``set_camera_parameters``. window: has ``is_pressed(key)``.
        sensitivity: units per second.
    """

    def __init__(self, camera: ProjectiveCamera, window: Any, sensitivity: float = SPEED) -> None:
        self.camera, self.window, self.sensitivity = camera, window, sensitivity
        self.last_time = time.perf_counter()

    def update(self) -> bool:
        """Move the camera by the time since the last call. Returns whether it moved; the picture then starts again."""
        now = time.perf_counter()
        seconds, self.last_time = now - self.last_time, now
        keys = {key for key in KEYS if self.window.is_pressed(key)}
        pose = Pose.of(self.camera)
        moved = step(pose, keys, seconds, speed=self.sensitivity)
        if not keys or moved is pose:
            return False
        self.camera.set_camera_parameters(**moved.parameters())
        return True


@dataclass(frozen=True)
class Pose:
    """Where a camera is: eye, at, up are (3,) float64 in world space.

    ``window`` is an orthographic camera's (l, r, b, t), which zooms where a perspective eye comes nearer; else None.
    """

    eye: np.ndarray
    at: np.ndarray
    up: np.ndarray
    handedness: str = USUAL_HANDEDNESS
    window: tuple[float, float, float, float] | None = None

    @classmethod
    def of(cls, camera: ProjectiveCamera) -> "Pose":
        """The pose of a camera."""
        window = camera.screen_window if camera.is_parallel else None
        return cls(camera.eye, camera.at, camera.up, camera.handedness, window)

    def parameters(self) -> dict:
        """What moves a camera here, for ``set_camera_parameters``."""
        moved = {"eye": self.eye, "at": self.at}
        return moved if self.window is None else {**moved, "screen_window": self.window}

    def frame(self) -> np.ndarray:
        """(4, 4) camera-to-world matrix; its first column points right in the picture, the second up."""
        return camera_frame(self.eye, self.at, self.up, self.handedness)


def is_legal(pose: Pose) -> bool:
    """Whether a camera exists there, in f32 as kernels have it: numbers finite, eye ≠ at, up not along the gaze."""
    with np.errstate(over="ignore"):
        eye, at = pose.eye.astype(np.float32), pose.at.astype(np.float32)
        window = np.array([-1, 1, -1, 1] if pose.window is None else pose.window, np.float32)
    is_finite = np.isfinite(eye).all() and np.isfinite(at).all() and np.isfinite(window).all()
    if not (is_finite and window[0] < window[1] and window[2] < window[3]):
        return False
    try:
        camera_frame(eye.astype(np.float64), at.astype(np.float64), pose.up, pose.handedness)
    except InputError:
        return False
    return True


def step(
    pose: Pose,
    keys: set[str],
    seconds: float,
    orbit: tuple[float, float] = (0.0, 0.0),
    zoom: float = 0.0,
    speed: float = SPEED,
    up_axis: str = "y",
) -> Pose:
    """The pose after one frame; the same pose where no camera exists after the move.

    Args:
        keys: those of ``KEYS`` that are held down; others mean nothing.
        seconds: the time since the last frame.
        orbit: how far the mouse was dragged (to the right, upwards), in fractions of the picture.
        zoom: how far the mouse was dragged upwards to come nearer, as a fraction of the picture's height.
        speed: of the keys, in units per second; see ``speed_for``.
        up_axis: the axis of the scene that points upwards, "y" or "z".
    """
    moved = pan(pose, keys, speed * seconds, up_axis)
    moved = turn(moved, *orbit)
    zooming = ZOOM_KEYS if pose.window is None else {**ZOOM_KEYS, **WINDOW_KEYS}
    farther = sum(sign for key, sign in zooming.items() if key in keys) * ZOOM_RATE * seconds - ZOOM_DRAG * zoom
    factor = math.exp(min(farther, LARGEST_EXPONENT))
    nearer = replace(moved, eye=moved.at + factor * (moved.eye - moved.at))
    moved = nearer if pose.window is None else zoom_window(moved, factor)
    return moved if is_legal(moved) else pose


def speed_for(low: np.ndarray, high: np.ndarray) -> float:
    """The speed of the keys in a scene with this bounding box, in units per second (A1-16)."""
    size = float(np.max(np.asarray(high, np.float64) - low))
    is_usual = USUAL_SIZES[0] <= size <= USUAL_SIZES[1] or not 0 < size < math.inf
    return SPEED if is_usual else SPEED_SHARE * size


def pan(pose: Pose, keys: set[str], distance: float, up_axis: str = "y") -> Pose:
    """Move ``eye`` and ``at`` by ``distance`` for every key that is held (A1-16).

    w/s move the eye along the world's +y/−y, e/q along +z/−z, a/d along the world's x, to the left/right of the
    picture. If z is up in the scene, w/s move it along +z/−z, and e/q along −y/+y. Arrows move ``at`` along the
    picture's own axes. With an orthographic camera, e/q zoom instead.
    """
    right, top = pose.frame()[:3, 0], pose.frame()[:3, 1]
    world = world_axes(up_axis) * (1.0 if right[0] >= 0 else -1.0, 1.0, 1.0)
    eye, at = pose.eye.copy(), pose.at.copy()
    for key, (axis, sign) in WORLD_KEYS.items():
        if key in keys and not (pose.window is not None and key in WINDOW_KEYS):
            eye += sign * distance * world[:, axis]
    for key, (axis, sign) in ARROWS.items():
        if key in keys:
            at += sign * distance * (right, top)[axis]
    return replace(pose, eye=eye, at=at)


def turn(pose: Pose, drag_right: float, drag_up: float) -> Pose:
    """Orbit the eye about ``at``, so that the scene follows the mouse; never over the pole."""
    if (drag_right == 0 and drag_up == 0) or not is_legal(pose):
        return pose
    up = pose.up / np.linalg.norm(pose.up)
    offset = pose.eye - pose.at
    # Turning about up by a positive angle moves the eye along −(up × z_c): to the left of a left-handed picture.
    side = 1.0 if pose.handedness == USUAL_HANDEDNESS else -1.0
    offset = rotate(offset, up, side * drag_right * ORBIT_ANGLE)
    from_pole = math.acos(np.clip(np.dot(offset, up) / np.linalg.norm(offset), -1.0, 1.0))
    lower = min(max(from_pole + drag_up * ORBIT_ANGLE, POLE_ANGLE), math.pi - POLE_ANGLE) - from_pole
    axis = np.cross(up, offset)
    offset = rotate(offset, axis / np.linalg.norm(axis), lower)
    return replace(pose, eye=pose.at + offset)


def rotate(v: np.ndarray, axis: np.ndarray, angle: float) -> np.ndarray:
    """``v`` turned about the unit vector ``axis``, counter-clockwise seen from its tip (Rodrigues)."""
    return v * math.cos(angle) + np.cross(axis, v) * math.sin(angle) + axis * np.dot(axis, v) * (1.0 - math.cos(angle))


def shift(pose: Pose, drag_right: float, drag_up: float, camera: ProjectiveCamera) -> Pose:
    """Move ``eye`` and ``at`` parallel to the picture, so that the point looked at follows the pointer.

    Args:
        drag_right, drag_up: in fractions of the picture.
        camera: whose window says how much of the scene the picture shows there.
    """
    half_width, half_height = camera.compute_half_size()
    far = 1.0 if pose.window is not None else float(np.linalg.norm(pose.at - pose.eye))
    frame = pose.frame()[:3]
    by = -2 * far * (drag_right * half_width * frame[:, 0] + drag_up * half_height * frame[:, 1])
    moved = replace(pose, eye=pose.eye + by, at=pose.at + by)
    return moved if is_legal(moved) else pose


def zoom_window(pose: Pose, factor: float) -> Pose:
    """Multiply the window of an orthographic camera about its middle."""
    l, r, b, t = pose.window or (-1.0, 1.0, -1.0, 1.0)
    x, y, half_width, half_height = (l + r) / 2, (b + t) / 2, factor * (r - l) / 2, factor * (t - b) / 2
    return replace(pose, window=(x - half_width, x + half_width, y - half_height, y + half_height))
