"""The frame, the windows and the view of cameras, computed and checked in float64 by numpy (A1-6, RT-1, RT-3, RT-4)."""

import math
import warnings
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

from taichi_tracer.system.errors import InputError, digits_of, one_of
from taichi_tracer.system.types import Numbers

# ── frame and windows ──


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
        raise InputError(f"camera: eye and at are the same point {digits_of(eye)}: move one of them")
    z_c = gaze / np.linalg.norm(gaze)
    if not np.linalg.norm(up) > 0:
        raise InputError(f"camera: up {digits_of(up)} has no direction: choose another up, such as (0, 1, 0)")
    side = np.cross(up, z_c)
    if not np.linalg.norm(side) > SMALLEST_SINE * np.linalg.norm(up):
        raise InputError(f"camera: up {digits_of(up)} is parallel to the gaze {digits_of(gaze)}: choose another up")
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


def box_of(points: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """(3,) low and high corner of the box of (n, 3) points. By columns, because numpy is 20 times as fast so."""
    return np.array([column.min() for column in points.T]), np.array([column.max() for column in points.T])


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


def numbers(name: str, value, count: int) -> np.ndarray:
    """``value`` as a new array of ``count`` finite float64 numbers; an InputError if it is something else."""
    try:
        vector = np.array(value, dtype=np.float64).reshape(-1)
    except (TypeError, ValueError):
        vector = np.zeros(0)
    if vector.shape != (count,) or not np.isfinite(vector).all():
        what = "a finite number" if count == 1 else f"{count} finite numbers"
        raise InputError(f"camera: {name} must be {what}, not {value!r}")
    return vector


def default_window(aspect: float) -> tuple[float, float, float, float]:
    """(l, r, b, t): [−1, 1] along the shorter axis of the image, and in proportion along the longer axis (RT-3)."""
    return (-aspect, aspect, -1.0, 1.0) if aspect >= 1 else (-1.0, 1.0, -1 / aspect, 1 / aspect)


def fovy_window(fovy: float, aspect: float, focal_distance: float = 1.0) -> tuple[float, float, float, float]:
    """(l, r, b, t) of the window that a vertical angle of ``fovy`` degrees shows (RT-4)."""
    top = math.tan(math.radians(fovy) / 2) * focal_distance
    return -top * aspect, top * aspect, -top, top


# ── view ──


PLACE = ("eye", "at", "up")
DEFAULTS: dict[str, Any] = {"handedness": USUAL_HANDEDNESS, "frame_aspect": None, "focal_distance": 1.0}
# Asks for the default window of RT-3. A perspective camera without any window would take its default angle instead.
DEFAULT_WINDOW = "default"


@dataclass(frozen=True, eq=False)
class CameraView:
    """What a camera shows, for pictures of any size. The window of a view without ``fov`` and window is that of RT-3.

    Attributes:
        eye, at, up: (3,) float64 in world space; ``up`` is not parallel to the gaze.
        fov: vertical field of view in degrees; None if there is a window, or if rays are parallel.
        handedness: "left" as in the courses, or "right" (C-5).
        screen_window: (4,) float64, l r b t of the image plane at the focal distance; None if it was not given.
        frame_aspect: width / height of a window that was not given; None is that of the picture (RT-4).
        focal_distance: the distance from the eye to the window, along the gaze (RT-5).
    """

    eye: np.ndarray
    at: np.ndarray
    up: np.ndarray
    fov: float | None = None
    handedness: str = DEFAULTS["handedness"]
    screen_window: np.ndarray | None = None
    frame_aspect: float | None = DEFAULTS["frame_aspect"]
    focal_distance: float = DEFAULTS["focal_distance"]

    @classmethod
    def checked(cls, values: dict[str, Any], check_fov: Callable) -> "CameraView":
        """The view with these attributes, which may be any sequences of numbers.

        Args:
            check_fov: given ``fov`` and the window, returns the angle that a kind of camera takes.

        Raises:
            InputError: no camera exists for these values; the message has the name and the value (C-6).
        """
        view = dict(values)
        if view["handedness"] not in HANDEDNESS:
            raise one_of("handedness", view["handedness"], HANDEDNESS)
        view |= {name: numbers(name, view[name], 3) for name in PLACE}
        if view["screen_window"] is not None:
            window = view["screen_window"] = numbers("screen_window", view["screen_window"], 4)
            if not (window[0] < window[1] and window[2] < window[3]):
                raise InputError(f"camera: screen_window is l r b t with l < r and b < t, not {digits_of(window)}")
        for name in ("frame_aspect", "focal_distance"):
            if view[name] is not None and not numbers(name, view[name], 1)[0] > 0:
                raise InputError(f"camera: {name} must be a finite number above 0, not {view[name]:g}")
        view["fov"] = check_fov(view["fov"], view["screen_window"])
        camera_frame(view["eye"], view["at"], view["up"])
        return cls(**view)

    @property
    def has_window(self) -> bool:
        """Whether the window was given, or is the default; False if an angle determines it."""
        return self.fov is None or self.screen_window is not None

    def window(self, aspect: float) -> tuple[float, ...]:
        """(l, r, b, t) at the focal distance: the given window, that of the angle, or the default (RT-3, RT-4).

        Args:
            aspect: width / height of the picture.
        """
        aspect = aspect if self.frame_aspect is None else self.frame_aspect
        if self.screen_window is not None:
            return tuple(float(edge) for edge in self.screen_window)
        return default_window(aspect) if self.fov is None else fovy_window(self.fov, aspect, self.focal_distance)

    def angle(self, aspect: float) -> float:
        """The vertical angle in degrees, between the lower and the upper edge of the window."""
        if self.fov is not None:
            return self.fov
        _, _, b, t = self.window(aspect)
        return math.degrees(math.atan(t / self.focal_distance) - math.atan(b / self.focal_distance))

    def half_size(self, width: int, height: int) -> tuple[float, float]:
        """Half of the window at distance 1, for a picture of this size: tan(fov/2) · aspect and tan(fov/2)."""
        l, r, b, t = self.window(width / height)
        return (r - l) / 2 / self.focal_distance, (t - b) / 2 / self.focal_distance

    def stretch(self, width: int, height: int) -> float:
        """The ratio width / height with which a picture of this size shows a square; 1 without distortion (C-11)."""
        l, r, b, t = self.window(width / height)
        return width * (t - b) / (height * (r - l))


def check_angle(fov: float | None, screen_window: Numbers | None = None, largest: float = 180.0) -> float | None:
    """An angle above 0 and below 180 degrees, or up to ``largest`` if that is more.

    Beside a window it is ignored, and a warning says so (C-9).
    """
    if fov is None:
        return None
    fov = float(numbers("fov", fov, 1)[0])
    if not (0.0 < fov < largest or fov == largest > 180.0):
        ends = "both excluded" if largest <= 180.0 else "0 excluded"
        raise InputError(f"camera: fov must be between 0 and {largest:g} degrees ({ends}), not {fov:g}")
    if screen_window is not None:
        warnings.warn(
            f"camera: fov {fov:g} does not count beside screen_window {digits_of(screen_window)}", stacklevel=5
        )
        return None
    return fov


def without_angle(values: dict[str, Any], aspect: float) -> dict[str, Any]:
    """Values of a view for parallel rays: their angle is replaced by the window that the angle shows at ``at``.

    Args:
        aspect: width / height of the window, unless the values have a ``frame_aspect``.
    """
    changed = dict(values)
    fov = changed.pop("fov", None)
    if fov is not None and changed.get("screen_window") is None:
        check_angle(fov)
        changed["screen_window"] = fovy_window(fov, values.get("frame_aspect") or aspect, distance_of(values))
    return changed


def distance_of(values: dict[str, Any]) -> float:
    """The distance between ``eye`` and ``at``."""
    return float(np.linalg.norm(np.asarray(values["at"], np.float64) - np.asarray(values["eye"], np.float64)))


def words_of(values: dict[str, Any], usual: dict[str, Any]) -> list[str]:
    """Values of a view as Python would write them as arguments, with at most six digits; without what is usual."""
    return [f"{name}={word(value)}" for name, value in values.items() if name not in usual or value != usual[name]]


def word(value: Any) -> str:
    """A value of a view as Python would write it."""
    if isinstance(value, str):
        return repr(value)
    return digits_of(value) if np.ndim(value) == 1 else f"{value:g}"
