"""The view of a camera: where it stands, what it looks at, and which window it shows; checked, in float64."""

import math
import warnings
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

from taichi_tracer.formulas.camera_frame import (
    HANDEDNESS,
    USUAL_HANDEDNESS,
    camera_frame,
    default_window,
    fovy_window,
    numbers,
    show,
)
from taichi_tracer.system.errors import InputError, one_of
from taichi_tracer.system.types import Numbers

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
                raise InputError(f"camera: screen_window is l r b t with l < r and b < t, not {show(window)}")
        for name in ("frame_aspect", "focal_distance"):
            if view[name] is not None and not 0 < as_number(name, view[name]) < math.inf:
                raise InputError(f"camera: {name} must be a finite number above 0, not {view[name]:g}")
        view["fov"] = check_fov(view["fov"], view["screen_window"])
        checked = cls(**view)
        checked.frame()
        return checked

    def frame(self) -> np.ndarray:
        """(4, 4) float64, the camera-to-world matrix (A1-8)."""
        return camera_frame(self.eye, self.at, self.up, self.handedness)

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
        """Half of the window at distance 1, for a picture of this size: tan(fov/2) · width/height and tan(fov/2)."""
        if self.has_window:
            l, r, b, t = self.window(width / height)
            return (r - l) / 2 / self.focal_distance, (t - b) / 2 / self.focal_distance
        tan_half_fov = math.tan(math.radians(self.angle(width / height)) / 2)
        if self.frame_aspect is not None:
            return tan_half_fov * self.frame_aspect, tan_half_fov
        return tan_half_fov * width / height, tan_half_fov

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
    fov = as_number("fov", fov)
    if not (0.0 < fov < largest or fov == largest > 180.0):
        ends = "both excluded" if largest <= 180.0 else "0 excluded"
        raise InputError(f"camera: fov must be between 0 and {largest:g} degrees ({ends}), not {fov:g}")
    if screen_window is not None:
        window = show(np.asarray(screen_window, float))
        warnings.warn(f"camera: fov {fov:g} does not count beside screen_window {window}", stacklevel=5)
        return None
    return fov


def as_number(name: str, value: Any) -> float:
    """A number among the values of a view; an InputError if it is none."""
    try:
        return float(value)
    except (TypeError, ValueError):
        raise InputError(f"camera: {name} must be a number, not {value!r}") from None


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
    order = [name for name in (*PLACE, "fov") if name in values]
    names = [name for name in dict.fromkeys([*order, *values]) if name not in usual or values[name] != usual[name]]
    return [f"{name}={word(values[name])}" for name in names]


def word(value: Any) -> str:
    """A value of a view as Python would write it."""
    if isinstance(value, str):
        return repr(value)
    return show(value) if np.ndim(value) == 1 else f"{value:g}"
