"""Cameras: from a pixel to a ray, in three coordinate systems (A1-3 … A1-9, RT-1 … RT-5).

All cameras map a pixel to a point of their image plane. The ray of the perspective camera goes from the eye through
this point. The ray of the orthographic camera (``cameras.orthographic``) starts at this point and goes along the gaze.
Your own camera derives from one of the two and replaces ``generate_ray`` or one of its steps.

A camera also has a size, and a view that Python sets and that kernels read.
"""

import reprlib
from abc import abstractmethod
from functools import partial
from typing import Any

import numpy as np
import taichi as ti
from numpy.typing import ArrayLike

from taichi_tracer.formulas import vector_math as tm
from taichi_tracer.formulas.random_numbers import given_or_drawn
from taichi_tracer.formulas.view import (
    DEFAULT_WINDOW,
    DEFAULTS,
    CameraView,
    camera_frame,
    check_angle,
    distance_of,
    without_angle,
    words_of,
)
from taichi_tracer.ray import Ray
from taichi_tracer.system import memory, runtime
from taichi_tracer.system.compile_time import compile_time, element, inside_kernel, runs_in_kernels, variable
from taichi_tracer.system.course_fields import held
from taichi_tracer.system.errors import InputError, one_of
from taichi_tracer.system.own_code.checks import fault
from taichi_tracer.system.parts import (
    PARTS,
    AbstractAnnotation,
    KnownAttributes,
    call_with_known_args,
    overridable,
    register,
    replaced,
    takes,
    takes_whole_numbers,
)
from taichi_tracer.system.types import Numbers

# ── what a camera is besides its rays ──


class Setting(property):
    """A property that is a part of the camera's view: an assignment gives the camera another view.

    ``camera.eye[None]`` is the same as ``camera.eye``, also in an assignment, as for the fields of the course.
    """

    def __get__(self, camera: Any, owner: type | None = None) -> Any:
        return held(super().__get__(camera, owner), partial(self.__set__, camera))

    def __set__(self, camera: Any, value: Any) -> None:
        camera._change({self.fget.__name__: value})  # type: ignore[union-attr]


class Size:
    """The width or the height of a picture, in pixels: set only once, because films and samplers have the same."""

    def __set_name__(self, owner: type, name: str) -> None:
        self.name = name

    def __get__(self, camera: Any, owner: type | None = None) -> Any:
        return self if camera is None else vars(camera)[self.name]

    def __set__(self, camera: Any, size: int) -> None:
        if not isinstance(size, (int, float, np.number)) or not (size >= 1 and float(size).is_integer()):
            raise InputError(f"camera: {self.name} must be a whole number of at least 1, not {size!r}")
        former = vars(camera).setdefault(self.name, memory.varying(int(size)))
        if size != former:
            advice = f"make a renderer, or a camera, with {self.name}={int(size)}"
            raise InputError(f"camera: {self.name} is {former} and cannot be changed to {size}: {advice}")


@ti.data_oriented
class CameraSettings(KnownAttributes, metaclass=AbstractAnnotation):
    """The size of the picture, and the view, whose numbers are in fields.

    Args:
        width, height: size of the image in pixels.
        eye, at, up: 3 numbers each, in world space.
        fov: vertical field of view in degrees, between 0 and 180; only a perspective camera has one.
        handedness: "left" as in the courses, or "right" (C-5).
        screen_window: (l, r, b, t) of the image plane at the focal distance. If it is given, ``fov`` is ignored (C-9).
            "default" is [−1, 1] along the shorter axis of the image (RT-3).
        frame_aspect: width / height of the window, if it differs from that of the image (RT-4).
        focal_distance: the distance from the eye to the window, along the gaze (RT-5).

    Attributes:
        view: the checked ``CameraView``.
        version: counts changes, so that a renderer knows when its samples belong to an older picture.
        camera_to_world, half_size, centre: fields of ``compute_matrix``, ``compute_half_size``, ``compute_centre``.
        x, y, z: fields of the camera's axes in world space, the first three columns of ``compute_matrix``.

    Raises:
        InputError: no camera exists for these parameters; the message has the name and the value (C-6).
    """

    kind, name = "camera", ""
    is_parallel = False  # whether all rays are parallel; then there is no angle between them
    default_fov: float | None = None  # the angle if neither an angle nor a window is given
    width, height = Size(), Size()

    def __init__(
        self,
        width: int = 128,
        height: int = 128,
        eye: Numbers = (0.0, 0.0, 5.0),
        at: Numbers = (0.0, 0.0, 0.0),
        up: Numbers = (0.0, 1.0, 0.0),
        fov: float | None = None,
        handedness: str = DEFAULTS["handedness"],
        screen_window: Numbers | str | None = None,
        frame_aspect: float | None = None,
        focal_distance: float = 1.0,
    ) -> None:
        self.width, self.height = width, height
        given = {"eye": eye, "at": at, "up": up, "fov": fov, "handedness": handedness, "screen_window": screen_window}
        self.view = self.view_of({**given, "frame_aspect": frame_aspect, "focal_distance": focal_distance})
        self.version = 0
        self._memory = memory.Memory()
        self.camera_to_world = ti.Matrix.field(4, 4, float)
        self.half_size, self.centre = ti.Vector.field(2, float), ti.Vector.field(2, float)
        self.x, self.y, self.z = (ti.Vector.field(3, float) for _ in range(3))
        self._numbers = ti.field(float)  # eye, at, up (3 each) and fov, for methods that read them in a kernel
        self._memory.fields.place(self.camera_to_world, self.half_size, self.centre, self.x, self.y, self.z)
        self._memory.fields.dense(ti.i, 10).place(self._numbers)
        self._memory.allocate()
        self._load()

    def set_camera_parameters(
        self,
        eye: Numbers | None = None,
        at: Numbers | None = None,
        up: Numbers | None = None,
        fov: float | None = None,
        handedness: str | None = None,
        screen_window: Numbers | str | None = None,
        frame_aspect: float | None = None,
        focal_distance: float | None = None,
    ) -> None:
        """Move the camera. Parameters that are not given stay as they are. After an InputError, nothing has changed.

        The parameters are those of the constructor. A new ``fov`` replaces a window, and a new window the ``fov``.
        """
        given = {"eye": eye, "at": at, "up": up, "fov": fov, "handedness": handedness, "screen_window": screen_window}
        given |= {"frame_aspect": frame_aspect, "focal_distance": focal_distance}
        self._change({name: value for name, value in given.items() if value is not None})

    def _change(self, given: dict[str, Any]) -> None:
        """Replace some of the constructor's arguments by others; after an InputError, nothing has changed."""
        self._memory.check("camera")
        if {"fov", "screen_window"} & set(given):
            self.view = self.view_of({**vars(self.view), "fov": None, "screen_window": None, **given})
        else:
            self.view = CameraView.checked({**vars(self.view), **given}, self.check_fov)
        self._load()

    @classmethod
    def view_of(cls, values: dict[str, Any]) -> CameraView:
        """The view of the constructor's arguments, with the default of the angle and of the window."""
        values = {**DEFAULTS, **values}
        fov, window = values.get("fov"), values.get("screen_window")
        if isinstance(window, str) and window != DEFAULT_WINDOW:
            raise one_of("screen_window", window, [DEFAULT_WINDOW, "or four numbers"])
        shown = {
            "fov": cls.default_fov if fov is None and window is None else fov,
            "screen_window": None if isinstance(window, str) else window,
        }
        return CameraView.checked({**values, **shown}, cls.check_fov)

    @classmethod
    @abstractmethod
    def check_fov(cls, fov: float | None, screen_window: Numbers | None) -> float | None:
        """The angle that the camera uses, or None if the window determines it; an InputError if it is impossible."""

    @abstractmethod
    def compute_matrix(self) -> Any:
        """The camera-to-world matrix, which a subclass defines."""

    @Setting
    def eye(self) -> Any:
        """The position in world space: (3,) float64; in a kernel, a vec3. To move the camera, assign three numbers.

        The array is a copy: a change of one of its elements does not move the camera.
        """
        return self._vector("eye", 0)

    @Setting
    def at(self) -> Any:
        """The point that the camera looks at, in world space, as ``eye``."""
        return self._vector("at", 3)

    @Setting
    def up(self) -> Any:
        """The upward direction, in world space, as ``eye``."""
        return self._vector("up", 6)

    def _vector(self, name: str, first: int) -> Any:
        if inside_kernel():
            return tm.vec3([element(self._numbers, first + k) for k in range(3)])
        return getattr(self.view, name).copy()

    @Setting
    def fov(self) -> Any:
        """Vertical field of view in degrees; a new one replaces a window. Parallel rays have none."""
        if self.is_parallel:
            raise AttributeError(f"{type(self).__name__} has no fov, because its rays are parallel: see screen_window")
        return element(self._numbers, 9) if inside_kernel() else self.view.angle(self.width / self.height)

    @Setting
    def handedness(self) -> Any:
        """ "left" or "right" (C-5)."""
        return self.view.handedness

    @Setting
    def focal_distance(self) -> Any:
        """The distance from the eye to the window (RT-5)."""
        return self.view.focal_distance

    @Setting
    def frame_aspect(self) -> Any:
        """Width / height of a window that is not given itself: that of the image, unless it was set (RT-4)."""
        return self.width / self.height if self.view.frame_aspect is None else self.view.frame_aspect

    @Setting
    def screen_window(self) -> Any:
        """(l, r, b, t) at the focal distance: see ``CameraView.window``. A new window replaces an angle."""
        return self.view.window(self.width / self.height)

    @property
    def has_window(self) -> bool:
        """Whether the window was given, or is the default; False if an angle determines it."""
        return self.view.has_window

    def compute_half_size(self) -> tuple[float, float]:
        """Half the width and half the height of the image plane; a perspective camera measures them at distance 1."""
        if not self.is_parallel:
            return self.view.half_size(self.width, self.height)
        l, r, b, t = self.screen_window
        return (r - l) / 2, (t - b) / 2

    def compute_centre(self) -> tuple[float, float]:
        """The middle of the image plane, in the units of ``compute_half_size``."""
        l, r, b, t = self.screen_window
        distance = 1.0 if self.is_parallel else self.focal_distance
        return (l + r) / 2 / distance, (b + t) / 2 / distance

    def parameters(self) -> dict[str, Any]:
        """The arguments with which ``make_camera`` makes this camera again, except for its size."""
        values = {"projection": self.name, **{k: v for k, v in vars(self.view).items() if v is not None}}
        return values if "fov" in values else values | {"screen_window": values.get("screen_window", DEFAULT_WINDOW)}

    def __repr__(self) -> str:
        values = {name: value for name, value in self.parameters().items() if name != "projection"}
        words = words_of(values, usual=DEFAULTS)
        return f"{type(self).__name__}({', '.join([str(self.width), str(self.height), *words])})"

    def _load(self) -> None:
        """Copy the view into the fields that kernels read, and then the matrix, which may be made of them."""
        angle = 0.0 if self.is_parallel else self.view.angle(self.width / self.height)
        self._memory.write(self.half_size, self.compute_half_size())
        self._memory.write(self.centre, self.compute_centre())
        self._memory.write(self._numbers, [*self.view.eye, *self.view.at, *self.view.up, angle])
        if runs_in_kernels(self.compute_matrix):
            self._load_own_matrix()
        else:
            self._load_matrix()
        self.version += 1

    def _load_matrix(self) -> None:
        """Load what ``compute_matrix`` returns; a student's may set the field instead, as it does in the course."""
        self._memory.clear(self.camera_to_world)
        matrix = self.compute_matrix()
        if matrix is not None:
            matrix = np.asarray(matrix.to_numpy() if hasattr(matrix, "to_numpy") else matrix, np.float64)
            if matrix.shape != (4, 4):
                raise InputError(f"camera: compute_matrix must return a 4 x 4 matrix, not one of shape {matrix.shape}")
            self._memory.write(self.camera_to_world, matrix)
            for axis, column in zip((self.x, self.y, self.z), matrix[:3].T, strict=False):
                self._memory.write(axis, column)
        elif not self._memory.read(self.camera_to_world).any():
            name, advice = f"{type(self).__name__}.compute_matrix", "return a 4 x 4 matrix"
            text = f"{name} has no return with a value, and sets no camera_to_world[None]: {advice}"
            raise fault(self.compute_matrix, text)

    def matrix(self) -> np.ndarray:
        """The camera-to-world matrix, (4, 4) float64; where ``compute_matrix`` is replaced, what it has set."""
        is_replaced = "compute_matrix" in replaced(self)
        return np.asarray(self._memory.read(self.camera_to_world) if is_replaced else self.compute_matrix(), np.float64)

    @ti.kernel
    def _load_own_matrix(self):
        self.camera_to_world[None] = self.compute_matrix()


# ── from a pixel to a ray ──


@ti.data_oriented
@overridable("generate_ndc_coords", "generate_camera_coords", "compute_matrix", generate_ray="Ray")
class ProjectiveCamera(CameraSettings):
    """The steps from a pixel to a ray. Pixel (0, 0) is at the bottom left. A subclass defines ``ray_through``.

    Arguments as for ``CameraSettings``.
    """

    @ti.func
    def generate_ndc_coords(self, pixel_x, pixel_y, jitter: ti.template() = False, xi: ti.template() = None):
        """The point of the image plane in NDC: corners (±1, ±1), x right, y up (A1-4). Arguments as below."""
        within = point_within(jitter, xi)
        return tm.vec2(2 * (pixel_x + within.x) / self.width - 1, 2 * (pixel_y + within.y) / self.height - 1)

    @ti.func
    def generate_camera_coords(self, ndc_coords):
        """The point of the image plane in camera coordinates, as a direction: w = 0 (A1-7, RT-5).

        Without a window of its own, the plane reaches from −tan(fov/2) to tan(fov/2) in y: see ``View.half_size``.
        """
        half, centre = self.half_size[None], self.centre[None]
        return tm.vec4(ndc_coords.x * half.x + centre.x, ndc_coords.y * half.y + centre.y, 1, 0)

    @compile_time
    def compute_matrix(self) -> Any:
        """The camera-to-world matrix [x_c y_c z_c eye; 0 0 0 1] (A1-8): (4, 4) float64; in a kernel, a mat4."""
        if inside_kernel():
            return element(self.camera_to_world, None)
        return camera_frame(self.eye, self.at, self.up, self.handedness)

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
    def ray_through(self, ndc):
        """The ray through a point of the image plane. A subclass defines it."""
        ti.static_assert(False, "a camera must say what ray_through(self, ndc) is")

    def rays(self, x: "ArrayLike", y: "ArrayLike") -> tuple[np.ndarray, np.ndarray]:
        """Origins and directions of the rays that ``generate_ray`` makes, without jitter; for ``scene.intersect``.

        Args:
            x, y: the pixels, as numbers or as arrays that fit together, such as (n,); (0, 0) is at the bottom left.
                Fractions of a pixel are allowed: (0.5, 0) lies between the first two pixels of the bottom row.

        Returns:
            Two (n, 3) arrays in the running precision, with one row per pixel in the order of ``x`` and ``y``.
        """
        self._memory.check("camera")
        x, y = pixel_arrays(x, y)
        origins, directions = (np.empty((len(x), 3), runtime.dtype()) for _ in range(2))
        if len(x) > 0:
            self._rays(x, y, origins, directions)
        return origins, directions

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


@register
@ti.data_oriented
@overridable(ray_through="Ray")
class Camera(ProjectiveCamera):
    """The pinhole camera of the courses: a perspective projection, with the image plane at the focal distance.

    Arguments as for ``CameraSettings``. If neither an angle nor a window is given, the angle is 60°.
    """

    name = "perspective"
    default_fov, largest_fov = 60.0, 180.0  # degrees; a camera of your own, such as a fisheye, may take larger ones

    @ti.func
    def ray_through(self, ndc):
        """The ray from the eye through a point of the image plane (RT-5)."""
        camera_to_world = self.camera_to_world[None]
        eye = tm.vec3(camera_to_world[0, 3], camera_to_world[1, 3], camera_to_world[2, 3])
        direction = (camera_to_world @ self.generate_camera_coords(ndc)).xyz
        return Ray(origin=eye, direction=direction * (1 / tm.length(direction)))

    @classmethod
    def check_fov(cls, fov: float | None, screen_window: Numbers | None) -> float | None:
        """Between 0 and ``largest_fov``. Beside a window, the angle is ignored, and a warning says so (C-9)."""
        return check_angle(fov, screen_window, cls.largest_fov)


PerspectiveCamera = Camera  # the name that RT3 uses (RT-1)


def pixel_arrays(x: Any, y: Any) -> tuple[np.ndarray, np.ndarray]:
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


def make_camera(
    width: int, height: int, projection: str | type[ProjectiveCamera] = "perspective", **parameters: Any
) -> ProjectiveCamera:
    """A camera of a registered kind. For an orthographic camera, an angle means the window that it shows at ``at``.

    Args:
        parameters: as for ``CameraSettings``.
    """
    camera = PARTS.find("camera", projection)
    if camera.is_parallel:
        parameters = without_angle(parameters, width / height)
    return camera(width, height, **parameters)


def change_projection(view: dict[str, Any], projection: str | type[ProjectiveCamera]) -> dict[str, Any]:
    """Arguments of ``make_camera`` for another kind of camera, which shows the same at the point that it looks at."""
    former, camera = (PARTS.find("camera", one) for one in (view.get("projection", "perspective"), projection))
    changed = {**view, "projection": projection}
    window = view.get("screen_window")
    if camera.is_parallel != former.is_parallel and window is not None and not isinstance(window, str):
        scale = distance_of(view) / view.get("focal_distance", 1.0)
        changed["screen_window"] = np.asarray(window) * (scale if camera.is_parallel else 1 / scale)
    return changed


def check_view(
    width: int, height: int, projection: str | type[ProjectiveCamera] = "perspective", **parameters: Any
) -> float:
    """The ``stretch`` of the camera that ``make_camera`` would make; an InputError if it would raise one."""
    return PARTS.find("camera", projection).view_of(parameters).stretch(width, height)


@compile_time
def point_within(jitter, xi):
    """The point of a pixel through which its ray passes, in [0, 1]²: the centre, or with jitter a random point.

    ``jitter`` is True or False. If a student's method passes its own argument on, ``jitter`` is a number in the kernel.
    """
    if isinstance(jitter, (bool, int)):
        return given_or_drawn(xi) if jitter else tm.vec2(0.5)
    return variable(ti.select(jitter != 0, given_or_drawn(xi), tm.vec2(0.5)))


@compile_time
def through_pixel(method, pixel_x, pixel_y, jitter, xi):
    """Call ``generate_ray`` or ``generate_ndc_coords`` for one pixel, with the jitter that its signature allows.

    The methods of this package take the random point ξ. Those of the handout's second assignment draw the point
    themselves if ``jitter`` is True. Those of the first assignment take only a pixel: they are called with a fraction
    of a pixel, unless their arguments are annotated as whole numbers. Then there is no jitter.
    """
    if jitter is False:
        return call_with_known_args(method, pixel_x, pixel_y)
    if takes(method, "jitter"):
        return call_with_known_args(method, pixel_x, pixel_y, jitter=jitter, xi=xi)
    if takes_whole_numbers(method):
        return call_with_known_args(method, pixel_x, pixel_y)
    within = point_within(jitter, xi)
    return call_with_known_args(method, pixel_x + element(within, 0) - 0.5, pixel_y + element(within, 1) - 0.5)
