"""Cameras: from a pixel to a ray, in three coordinate systems (A1-3 … A1-9, RT-1 … RT-5).

All cameras map a pixel to a point of their image plane. The ray of the perspective camera goes from the eye through
this point. The ray of the orthographic camera (``cameras.orthographic``) starts at this point and goes along the gaze.
Your own camera derives from one of the two and replaces ``generate_ray`` or one of its steps.
"""

import reprlib
from typing import Any

import numpy as np
import taichi as ti
import taichi.math as tm
from numpy.typing import ArrayLike

from taichi_tracer.camera_settings import CameraSettings
from taichi_tracer.formulas.camera_frame import camera_frame
from taichi_tracer.formulas.random_numbers import given_or_drawn
from taichi_tracer.formulas.view import check_angle, distance_of, without_angle
from taichi_tracer.ray import Ray
from taichi_tracer.system import runtime
from taichi_tracer.system.compile_time import compile_time, compile_time_as, element
from taichi_tracer.system.errors import InputError
from taichi_tracer.system.parts import PARTS, call_with_known_args, overridable, register, takes, takes_whole_numbers
from taichi_tracer.system.types import Numbers


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

    @compile_time_as(lambda camera: element(camera.camera_to_world, None))
    def compute_matrix(self) -> Any:
        """The camera-to-world matrix [x_c y_c z_c eye; 0 0 0 1] (A1-8): (4, 4) float64; in a kernel, a mat4."""
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
        return Ray(origin=eye, direction=direction * (1 / direction.norm()))

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
    return _centre_or(jitter, given_or_drawn(xi))


@ti.func
def _centre_or(jitter, point):
    return ti.select(jitter != 0, point, tm.vec2(0.5))


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
    return call_with_known_args(method, moved_within(pixel_x, within, 0), moved_within(pixel_y, within, 1))


@ti.func
def moved_within(pixel, within, axis: ti.template()):
    """A coordinate of a point within a pixel, in pixels from the centre of the first pixel."""
    return pixel + within[axis] - 0.5
