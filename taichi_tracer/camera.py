"""Cameras: from a pixel to a ray, in three coordinate systems (A1-3 … A1-9, RT-1 … RT-5).

Two cameras share one interface. Both map a pixel to a point (u, v) of their screen window. The ray of the perspective
camera goes from the eye through this point. The ray of the orthographic camera starts at this point and goes along the
gaze. Your own camera derives from one of the two and replaces ``generate_ray`` or one of its steps.
"""

import math
import reprlib
import warnings
from abc import ABC, abstractmethod
from collections.abc import Callable
from typing import Any

import numpy as np
import taichi as ti
import taichi.math as tm
from numpy.typing import ArrayLike
from taichi.lang import impl

from taichi_tracer.formulas.camera_frame import camera_frame, fovy_window, numbers, show, stretch_of, window_of
from taichi_tracer.ray import Ray
from taichi_tracer.sampler import given_or_drawn
from taichi_tracer.system import memory, runtime
from taichi_tracer.system.errors import InputError, one_of
from taichi_tracer.system.registry import PARTS, register
from taichi_tracer.system.seams import called, in_kernels, runs_in_kernels, seams, takes, takes_whole_numbers
from taichi_tracer.system.tables import Tables
from taichi_tracer.system.types import Numbers

HANDEDNESS = ("left", "right")
PLACE = ("eye", "at", "up")
# Asks for the default window of RT-3. A perspective camera without any window would take its default angle instead.
DEFAULT_WINDOW = "default"


@ti.data_oriented
@seams("generate_ray", "generate_ndc_coords", "generate_camera_coords", "compute_matrix")
class ProjectiveCamera(ABC):
    """A frame, a screen window and an image whose pixel (0, 0) is at the bottom left. A subclass defines the rays.

    Args:
        width, height: size of the image in pixels.
        eye, at, up: 3 numbers each, in world space.
        fov: vertical field of view in degrees, between 0 and 180; only a perspective camera has one.
        handedness: "left" as in the courses, or "right" (C-5).
        screen_window: (l, r, b, t) of the image plane at the focal distance. If it is given, ``fov`` is ignored (C-9).
            "default" is [−1, 1] along the shorter axis of the image (RT-3).
        frame_aspect: width / height of the window, if it differs from that of the image (RT-4).
        focal_distance: the distance from the eye to the window, along the gaze (RT-5).

    Raises:
        InputError: no camera exists for these parameters; the message has the name and the value (C-6).
    """

    kind, name = "camera", ""
    from_python = "in Python, camera.rays(x, y) gives the rays of pixels as arrays"
    is_parallel = False  # whether all rays are parallel; then there is no angle between them
    default_fov: float | None = None  # the angle if neither an angle nor a window is given

    def __init__(
        self,
        width: int = 128,
        height: int = 128,
        eye: Numbers = (0.0, 0.0, 5.0),
        at: Numbers = (0.0, 0.0, 0.0),
        up: Numbers = (0.0, 1.0, 0.0),
        fov: float | None = None,
        handedness: str = "left",
        screen_window: Numbers | str | None = None,
        frame_aspect: float | None = None,
        focal_distance: float = 1.0,
    ) -> None:
        self.width, self.height = width, height
        self.version = 0  # counts changes, so that a renderer knows when its samples belong to an older picture
        values: dict[str, Any] = {"eye": eye, "at": at, "up": up, "handedness": handedness, "fov": fov}
        values |= {"screen_window": screen_window, "frame_aspect": frame_aspect, "focal_distance": focal_distance}
        self._values = self.completed(values)
        self._memory = memory.Memory()
        self.camera_to_world = ti.Matrix.field(4, 4, float)
        self.half_size = ti.Vector.field(2, float)
        self.centre = ti.Vector.field(2, float)
        self._parameters = ti.field(float)  # eye, at, up (3 each) and fov, for methods that read them in a kernel
        self._memory.fields.place(self.camera_to_world, self.half_size, self.centre)
        self._memory.fields.dense(ti.i, 10).place(self._parameters)
        self._memory.allocate()
        self._tables = Tables()
        self._update()

    def set_camera_parameters(
        self,
        eye: Numbers | None = None,
        at: Numbers | None = None,
        up: Numbers | None = None,
        fov: float | None = None,
        handedness: str | None = None,
        *,
        screen_window: Numbers | None = None,
        frame_aspect: float | None = None,
        focal_distance: float | None = None,
    ) -> None:
        """Move the camera. Parameters that are not given stay as they are. After an InputError, nothing has changed.

        The parameters are those of the constructor. A new ``fov`` replaces a window, and a new window the ``fov``.
        """
        given: dict[str, Any] = {
            "eye": eye,
            "at": at,
            "up": up,
            "fov": fov,
            "handedness": handedness,
            "screen_window": screen_window,
        }
        given |= {"frame_aspect": frame_aspect, "focal_distance": focal_distance}
        given = {name: value for name, value in given.items() if value is not None}
        self._change(given)

    def _change(self, given: dict[str, Any]) -> None:
        """Replace some of the constructor's arguments by others; after an InputError, nothing has changed."""
        self._memory.check("camera")
        if {"fov", "screen_window"} & set(given):
            values = self.completed({**self._values, "fov": None, "screen_window": None, **given})
        else:
            values = self.check({**self._values, **given})
        self._values = values
        self._update()

    @classmethod
    def completed(cls, values: dict[str, Any]) -> dict[str, Any]:
        """``check`` of the constructor's arguments, with the default of the angle and of the window."""
        fov, window = values["fov"], values["screen_window"]
        if isinstance(window, str) and window != DEFAULT_WINDOW:
            raise one_of("screen_window", window, [DEFAULT_WINDOW, "or four numbers"])
        shown = {"fov": cls.default_fov if fov is None and window is None else fov}
        return cls.check({**values, **shown, "screen_window": None if isinstance(window, str) else window})

    @classmethod
    def check(cls, values: dict[str, Any]) -> dict[str, Any]:
        """``values`` as float64 arrays and floats; an InputError if no camera exists for them."""
        checked = dict(values)
        if values["handedness"] not in HANDEDNESS:
            raise one_of("handedness", values["handedness"], HANDEDNESS)
        for name in PLACE:
            checked[name] = numbers(name, values[name], 3)
        if values["screen_window"] is not None:
            checked["screen_window"] = l, r, b, t = numbers("screen_window", values["screen_window"], 4)
            if not (l < r and b < t):
                raise InputError(
                    f"camera: screen_window is l r b t with l < r and b < t, not {show(checked['screen_window'])}"
                )
        for name in ("frame_aspect", "focal_distance"):
            if values[name] is not None and not 0 < as_number(name, values[name]) < math.inf:
                raise InputError(f"camera: {name} must be a finite number above 0, not {values[name]:g}")
        checked["fov"] = cls.check_fov(values["fov"], values["screen_window"])
        camera_frame(checked["eye"], checked["at"], checked["up"])
        return checked

    @classmethod
    @abstractmethod
    def check_fov(cls, fov: float | None, screen_window: Numbers | None) -> float | None:
        """The angle that the camera uses, or None if the window determines it; an InputError if it is impossible."""

    @property
    def width(self) -> int:
        """The width of the image in pixels. It is compiled into kernels, and therefore it cannot be changed."""
        return self._width

    @width.setter
    def width(self, pixels: int) -> None:
        self._width = self._fixed("width", pixels)

    @property
    def height(self) -> int:
        """The height of the image in pixels. It is compiled into kernels, and therefore it cannot be changed."""
        return self._height

    @height.setter
    def height(self, pixels: int) -> None:
        self._height = self._fixed("height", pixels)

    def _fixed(self, name: str, size: int) -> int:
        """A size that is set for the first time, or to the value that it has; an InputError if it is something else."""
        if not isinstance(size, (int, float, np.number)) or not (size >= 1 and float(size).is_integer()):
            raise InputError(f"camera: {name} must be a whole number of at least 1, not {size!r}")
        former = getattr(self, f"_{name}", size)
        if size != former:
            advice = f"make a renderer, or a camera, with {name}={int(size)}"
            raise InputError(f"camera: {name} is {former} and cannot be changed to {size}: {advice}")
        return int(size)

    @property
    def eye(self) -> Any:
        """The position in world space: (3,) float64; in a kernel, a vec3. To move the camera, assign three numbers.

        The array is a copy: a change of one of its elements does not move the camera.
        """
        return self._vector("eye", 0)

    @eye.setter
    def eye(self, position) -> None:
        self._change({"eye": position})

    @property
    def at(self) -> Any:
        """The point that the camera looks at, in world space, as ``eye``."""
        return self._vector("at", 3)

    @at.setter
    def at(self, position) -> None:
        self._change({"at": position})

    @property
    def up(self) -> Any:
        """The upward direction, in world space, as ``eye``."""
        return self._vector("up", 6)

    @up.setter
    def up(self, direction) -> None:
        self._change({"up": direction})

    def _vector(self, name: str, first: int):
        if impl.inside_kernel():
            return tm.vec3([_read(self._parameters, first + k) for k in range(3)])
        return self._values[name].copy()

    @property
    def fov(self) -> float:
        """Vertical field of view in degrees; a new one replaces a window. Parallel rays have none."""
        if self.is_parallel:
            raise AttributeError(f"{type(self).__name__} has no fov, because its rays are parallel: see screen_window")
        if impl.inside_kernel():
            return _read(self._parameters, 9)
        return self._angle()

    @fov.setter
    def fov(self, degrees: float | None) -> None:
        self._change({"fov": degrees})

    @property
    def handedness(self) -> str:
        """ "left" or "right" (C-5)."""
        return self._values["handedness"]

    @handedness.setter
    def handedness(self, side: str) -> None:
        self._change({"handedness": side})

    @property
    def focal_distance(self) -> float:
        """The distance from the eye to the window (RT-5)."""
        return self._values["focal_distance"]

    @focal_distance.setter
    def focal_distance(self, distance: float) -> None:
        self._change({"focal_distance": distance})

    @property
    def frame_aspect(self) -> float:
        """Width / height of a window that is not given itself: that of the image, unless it was set (RT-4)."""
        given = self._values["frame_aspect"]
        return self.width / self.height if given is None else given

    @frame_aspect.setter
    def frame_aspect(self, ratio: float | None) -> None:
        self._change({"frame_aspect": ratio})

    @property
    def screen_window(self) -> tuple[float, ...]:
        """(l, r, b, t) at the focal distance: the given window, or that of the angle, or the default (RT-3, RT-4).

        A new window replaces an angle.
        """
        values = self._values
        return window_of(self.frame_aspect, values["fov"], values["screen_window"], self.focal_distance)

    @screen_window.setter
    def screen_window(self, edges: tuple[float, float, float, float] | str | None) -> None:
        self._change({"screen_window": edges})

    @property
    def has_window(self) -> bool:
        """Whether the window was given, or is the default; False if an angle determines it."""
        return self._values["fov"] is None or self._values["screen_window"] is not None

    @property
    def stretch(self) -> float:
        """The ratio width / height with which the picture shows a square; 1 without distortion."""
        return stretch_of(self.screen_window, self.width, self.height)

    def parameters(self) -> dict[str, Any]:
        """The arguments with which ``make_camera`` makes this camera again, except for its size."""
        values = {"projection": self.name, **{k: v for k, v in self._values.items() if v is not None}}
        return values if "fov" in values else {"screen_window": DEFAULT_WINDOW, **values}

    def __repr__(self) -> str:
        values, usual = self.parameters(), {"handedness": HANDEDNESS[0], "focal_distance": 1}
        order = [name for name in (*PLACE, "fov", *values) if name in values and name != "projection"]
        told = [name for name in dict.fromkeys(order) if name not in usual or values[name] != usual[name]]
        words = [f"{name}={word(values[name])}" for name in told]
        return f"{type(self).__name__}({', '.join([str(self.width), str(self.height), *words])})"

    @in_kernels
    def compute_matrix(self) -> Any:
        """The camera-to-world matrix (A1-8): (4, 4) float64; in a kernel, a mat4."""
        if impl.inside_kernel():
            return _read(self.camera_to_world, None)
        return camera_frame(self.eye, self.at, self.up, self.handedness)

    def compute_half_size(self) -> tuple[float, float]:
        """Half the width and half the height of the image plane; a perspective camera measures them at distance 1."""
        l, r, b, t = self.screen_window
        return (r - l) / 2, (t - b) / 2

    def compute_centre(self) -> tuple[float, float]:
        """The middle of the image plane, in the units of ``compute_half_size``."""
        l, r, b, t = self.screen_window
        return (l + r) / 2, (b + t) / 2

    def _update(self) -> None:
        tables, dtype = self._tables, runtime.dtype()
        tables.put(self.camera_to_world, self.to_array(self.compute_matrix))
        tables.put(self.half_size, np.array(self.compute_half_size(), dtype))
        tables.put(self.centre, np.array(self.compute_centre(), dtype))
        tables.put(self._parameters, np.array([*self.eye, *self.at, *self.up, self._angle()], dtype))
        tables.load(self._memory)
        if runs_in_kernels(self.compute_matrix):
            self._load_own_matrix()
        self.version += 1

    def _angle(self) -> float:
        return 0.0

    @ti.func
    def ray_through(self, ndc):
        """The ray through a point of the image plane. A subclass defines it."""
        ti.static_assert(False, "a camera must say what ray_through(self, ndc) is")
        return Ray()

    def to_array(self, compute_matrix: Callable) -> np.ndarray:
        """(4, 4) in the running precision: ``compute_matrix`` if Python can call it, otherwise ``camera_frame``."""
        matrix = None if runs_in_kernels(compute_matrix) else compute_matrix()
        if matrix is None:
            matrix = camera_frame(self.eye, self.at, self.up, self.handedness)
        matrix = np.asarray(matrix.to_numpy() if hasattr(matrix, "to_numpy") else matrix, np.float64)
        if matrix.shape != (4, 4):
            raise InputError(f"camera: compute_matrix must return a 4 x 4 matrix, not one of shape {matrix.shape}")
        return np.ascontiguousarray(matrix.astype(runtime.dtype()))

    @ti.kernel
    def _load_own_matrix(self):
        self.camera_to_world[None] = self.compute_matrix()

    def rays(self, x: ArrayLike, y: ArrayLike) -> tuple[np.ndarray, np.ndarray]:
        """Origins and directions of the rays that ``generate_ray`` makes, without jitter; for ``scene.intersect``.

        Args:
            x, y: the pixels, as numbers or as arrays that fit together, such as (n,); (0, 0) is at the bottom left.
                Fractions of a pixel are allowed: (0.5, 0) lies between the first two pixels of the bottom row.

        Returns:
            Two (n, 3) arrays in the running precision, with one row per pixel in the order of ``x`` and ``y``.
        """
        self._memory.check("camera")
        x, y = self._pixels(x, y)
        origins, directions = (np.empty((len(x), 3), runtime.dtype()) for _ in range(2))
        if len(x) > 0:
            self._rays(x, y, origins, directions)
        return origins, directions

    @staticmethod
    def _pixels(x, y) -> tuple[np.ndarray, np.ndarray]:
        """Two (n,) arrays of one type: whole numbers if both are, because a student's method may count on them."""
        try:
            pixels = np.broadcast_arrays(x, y)
            is_whole = all(one.dtype.kind in "iu" for one in pixels)
            dtype = np.int32 if is_whole else runtime.dtype()
            x, y = (np.ascontiguousarray(one.reshape(-1).astype(dtype, casting="same_kind")) for one in pixels)
        except (TypeError, ValueError):
            given = f"{reprlib.repr(x)} and {reprlib.repr(y)}"
            raise InputError(f"camera: rays takes two numbers, or two arrays that fit together, not {given}") from None
        return x, y

    @ti.kernel
    def _rays(
        self,
        x: ti.types.ndarray(ndim=1),
        y: ti.types.ndarray(ndim=1),
        origins: ti.types.ndarray(ndim=2),
        directions: ti.types.ndarray(ndim=2),
    ):
        for i in range(x.shape[0]):
            ray = through_pixel(self.generate_ray, x[i], y[i], False, None)
            for k in ti.static(range(3)):
                origins[i, k], directions[i, k] = ray.origin[k], ray.direction[k]

    @ti.func
    def generate_ray(self, pixel_x, pixel_y, jitter: ti.template() = False, xi: ti.template() = None):
        """The eye ray through the centre of a pixel; with ``jitter``, through a random point of the pixel (A1-9, A2-1).

        ``pixel_x`` and ``pixel_y`` may be fractions of a pixel (RT-1). The direction has unit length.

        Args:
            jitter: True or False.
            xi: the random point within the pixel, in [0, 1)²; if it is None, the method draws it.
        """
        return self.ray_through(through_pixel(self.generate_ndc_coords, pixel_x, pixel_y, jitter, xi))

    @ti.func
    def generate_ndc_coords(self, pixel_x, pixel_y, jitter: ti.template() = False, xi: ti.template() = None):
        """The point of the image plane in NDC: corners (±1, ±1), x right, y up (A1-4). Arguments as above."""
        within = point_within(jitter, xi)
        return tm.vec2(2 * (pixel_x + within.x) / self.width - 1, 2 * (pixel_y + within.y) / self.height - 1)

    @ti.func
    def generate_camera_coords(self, ndc_coords):
        """The point of the image plane in camera coordinates, as a direction: w = 0 (A1-7, RT-5)."""
        half, centre = self.half_size[None], self.centre[None]
        return tm.vec4(ndc_coords.x * half.x + centre.x, ndc_coords.y * half.y + centre.y, 1, 0)


@in_kernels
def point_within(jitter, xi):
    """The point of a pixel through which its ray passes, in [0, 1]²: the centre, or with jitter a random point.

    ``jitter`` is True or False. If a student's method passes its own argument on, ``jitter`` is a number in the kernel.
    """
    if isinstance(jitter, (bool, int)):
        return given_or_drawn(xi) if jitter else tm.vec2(0.5)
    return _centre_or(jitter, given_or_drawn(xi))


@ti.func
def _centre_or(jitter, point):
    return ti.select(jitter != 0, point, tm.vec2(0.5))


@in_kernels
def through_pixel(method, pixel_x, pixel_y, jitter, xi):
    """Call ``generate_ray`` or ``generate_ndc_coords`` for one pixel, with the jitter that its signature allows.

    The methods of this package take the random point ξ. Those of the handout's second assignment draw the point
    themselves if ``jitter`` is True. Those of the first assignment take only a pixel: they are called with a fraction
    of a pixel, unless their arguments are annotated as whole numbers. Then there is no jitter.
    """
    if jitter is False:
        return called(method, pixel_x, pixel_y)
    if takes(method, "jitter"):
        return called(method, pixel_x, pixel_y, jitter=jitter, xi=xi)
    if takes_whole_numbers(method):
        return called(method, pixel_x, pixel_y)
    within = point_within(jitter, xi)
    return called(method, moved_within(pixel_x, within, 0), moved_within(pixel_y, within, 1))


@ti.func
def moved_within(pixel, within, axis: ti.template()):
    """A coordinate of a point within a pixel, in pixels from the centre of the first pixel."""
    return pixel + within[axis] - 0.5


def word(value) -> str:
    """A parameter of a camera as Python would write it, with at most six digits."""
    if isinstance(value, str):
        return repr(value)
    return show(value) if np.ndim(value) == 1 else f"{value:g}"


def as_number(name: str, value) -> float:
    """A parameter of a camera as a number; an InputError if it is none."""
    try:
        return float(value)
    except (TypeError, ValueError):
        raise InputError(f"camera: {name} must be a number, not {value!r}") from None


def _read(field, index):
    """An element of a field, inside a kernel; for properties that Python and kernels can read."""
    return impl.subscript(impl.get_runtime().compiling_callable.ast_builder(), field, index)


@register
@ti.data_oriented
@seams("ray_through")
class Camera(ProjectiveCamera):
    """The pinhole camera of the courses: a perspective projection, with the image plane at the focal distance.

    Arguments as for ``ProjectiveCamera``. If neither an angle nor a window is given, the angle is 60°.
    """

    name = "perspective"
    default_fov = 60.0

    @classmethod
    def check_fov(cls, fov: float | None, screen_window: Numbers | None) -> float | None:
        """Between 0 and 180 degrees. If there is a window too, the angle is ignored, and a warning says so (C-9)."""
        if fov is None:
            return None
        fov = as_number("fov", fov)
        if not 0.0 < fov < 180.0:
            raise InputError(f"camera: fov must be between 0 and 180 degrees (both excluded), not {fov:g}")
        if screen_window is not None:
            told = show(np.asarray(screen_window, float))
            warnings.warn(f"camera: fov {fov:g} does not count beside screen_window {told}", stacklevel=4)
            return None
        return fov

    def _angle(self) -> float:
        if self._values["fov"] is not None:
            return self._values["fov"]
        _, _, b, t = self.screen_window
        return math.degrees(math.atan(t / self.focal_distance) - math.atan(b / self.focal_distance))

    def compute_half_size(self) -> tuple[float, float]:
        """Half of the image plane's width and height, at distance 1: tan(fov/2) · width/height and tan(fov/2)."""
        if not self.has_window:
            tan_half_fov = math.tan(math.radians(self.fov) / 2)
            if self._values["frame_aspect"] is not None:
                return tan_half_fov * self.frame_aspect, tan_half_fov
            return tan_half_fov * self.width / self.height, tan_half_fov
        half_width, half_height = super().compute_half_size()
        return half_width / self.focal_distance, half_height / self.focal_distance

    def compute_centre(self) -> tuple[float, float]:
        """The middle of the image plane at distance 1."""
        x, y = super().compute_centre()
        return x / self.focal_distance, y / self.focal_distance

    @ti.func
    def ray_through(self, ndc):
        """The ray from the eye through a point of the image plane (RT-5)."""
        camera_to_world = self.camera_to_world[None]
        eye = tm.vec3(camera_to_world[0, 3], camera_to_world[1, 3], camera_to_world[2, 3])
        direction = (camera_to_world @ self.generate_camera_coords(ndc)).xyz
        return Ray(origin=eye, direction=direction * (1 / direction.norm()))


@register
@ti.data_oriented
@seams("ray_through")
class OrthographicCamera(ProjectiveCamera):
    """Parallel rays along the gaze, from every point of a window around the eye (RT-5).

    Objects that are far away do not look smaller. Arguments as for ``ProjectiveCamera``, with lengths in world units.
    There is no ``fov``, and the focal distance has no effect.
    """

    name, is_parallel = "orthographic", True

    @classmethod
    def check_fov(cls, fov: float | None, screen_window: Numbers | None) -> float | None:
        """None, because there is no angle between parallel rays."""
        if fov is not None:
            raise InputError(f"camera: an orthographic camera has no fov ({fov}): give it a screen_window")
        return None

    @ti.func
    def ray_through(self, ndc):
        """The ray from e + u û + v v̂ along ŵ."""
        p, m = self.generate_camera_coords(ndc), self.camera_to_world[None]
        x, y = p.x, p.y
        origin = tm.vec3(0)
        for k in ti.static(range(3)):
            origin[k] = m[k, 0] * x + m[k, 1] * y + m[k, 3]
        return Ray(origin=origin, direction=tm.vec3(m[0, 2], m[1, 2], m[2, 2]))


PerspectiveCamera = Camera  # the name that RT3 uses (RT-1)


def make_camera(
    width: int, height: int, projection: str | type[ProjectiveCamera] = "perspective", **parameters: Any
) -> ProjectiveCamera:
    """A camera of a registered kind. For an orthographic camera, an angle means the window that it shows at ``at``.

    Args:
        parameters: as for ``ProjectiveCamera``.
    """
    camera = PARTS.find("camera", projection)
    if camera.is_parallel:
        parameters = without_angle(parameters, width / height)
    return camera(width, height, **parameters)


def without_angle(view: dict[str, Any], aspect: float) -> dict[str, Any]:
    """``view`` for parallel rays: its angle is replaced by the window that the angle shows at ``at``.

    Args:
        aspect: width / height of the window, unless ``view`` has a ``frame_aspect``.
    """
    changed = dict(view)
    fov = changed.pop("fov", None)
    if fov is not None and changed.get("screen_window") is None:
        Camera.check_fov(fov, None)
        distance = np.linalg.norm(np.asarray(view["at"], np.float64) - np.asarray(view["eye"], np.float64))
        changed["screen_window"] = fovy_window(fov, view.get("frame_aspect") or aspect, float(distance))
    return changed


def change_projection(view: dict[str, Any], projection: str | type[ProjectiveCamera]) -> dict[str, Any]:
    """``view`` for another kind of camera, which shows the same at the point that the camera looks at."""
    former, camera = (PARTS.find("camera", one) for one in (view.get("projection", "perspective"), projection))
    changed = {**view, "projection": projection}
    window = view.get("screen_window")
    if camera.is_parallel != former.is_parallel and window is not None and not isinstance(window, str):
        distance = np.linalg.norm(np.asarray(view["at"], np.float64) - np.asarray(view["eye"], np.float64))
        scale = distance / view.get("focal_distance", 1.0)
        changed["screen_window"] = np.asarray(window) * (scale if camera.is_parallel else 1 / scale)
    return changed


def check_view(
    width: int, height: int, projection: str | type[ProjectiveCamera] = "perspective", **parameters: Any
) -> float:
    """The ``stretch`` of the camera that ``make_camera`` would make; an InputError if it would raise one."""
    values: dict[str, Any] = dict.fromkeys(("fov", "screen_window", "frame_aspect"))
    values |= {"handedness": "left", "focal_distance": 1.0, **parameters}
    if isinstance(values["screen_window"], str):
        values["screen_window"] = None
    checked = PARTS.find("camera", projection).check(values)
    aspect = checked["frame_aspect"] or width / height
    window = window_of(aspect, checked["fov"], checked["screen_window"], checked["focal_distance"])
    return stretch_of(window, width, height)
