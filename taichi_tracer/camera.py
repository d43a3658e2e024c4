"""Where rays come from: a pixel of the image plane, in three coordinate systems (A1-3 … A1-9)."""

import math

import numpy as np
import taichi as ti
import taichi.math as tm

from taichi_tracer import runtime
from taichi_tracer.errors import InputError, one_of
from taichi_tracer.ray import Ray

HANDEDNESS = ("left", "right")
CENTRE = tm.vec2(0.5, 0.5)  # of a pixel


def camera_frame(eye: np.ndarray, at: np.ndarray, up: np.ndarray, handedness: str = "left") -> np.ndarray:
    """(4, 4) float64 camera-to-world matrix [x_c y_c z_c eye; 0 0 0 1] (A1-6, A1-8); the camera looks along +z_c.

    x_c = up × z_c is the courses' frame and shows right-handed data mirrored; ``handedness="right"`` negates x_c (C-5).

    Raises:
        InputError: eye = at, or up parallel to the gaze: no frame exists (C-6).
    """
    gaze = at - eye
    if not np.linalg.norm(gaze) > 0:
        raise InputError(f"camera: eye and at are the same point {_show(eye)}: move one of them")
    z_c = gaze / np.linalg.norm(gaze)
    side = np.cross(up, z_c)
    smallest_sine = 1e-6  # below it, f32 positions no longer tell which way x_c points
    if not np.linalg.norm(side) > smallest_sine * np.linalg.norm(up):
        raise InputError(f"camera: up {_show(up)} is parallel to the gaze {_show(gaze)}: choose another up")
    x_c = side / np.linalg.norm(side)
    y_c = np.cross(z_c, x_c)
    if handedness == "right":
        x_c = -x_c
    matrix = np.eye(4)
    matrix[:3, :] = np.stack([x_c, y_c, z_c, eye], axis=1)
    return matrix


def view_of_box(low: np.ndarray, high: np.ndarray, fov: float = 60.0, aspect: float = 1.0) -> dict:
    """Camera parameters (eye, at, up, fov) that show a whole box from +z, with its bounding sphere just inside."""
    at = (np.asarray(low, np.float64) + high) / 2
    radius = max(float(np.linalg.norm(np.asarray(high, np.float64) - low)) / 2, 1e-30)
    half_angle = math.atan(math.tan(math.radians(fov) / 2) * min(1.0, aspect))
    eye = at + np.array([0.0, 0.0, radius / math.sin(half_angle)])
    return {"eye": eye, "at": at, "up": np.array([0.0, 1.0, 0.0]), "fov": fov}


def _show(vector: np.ndarray) -> str:
    return "(" + ", ".join(f"{component:g}" for component in vector) + ")"


@ti.data_oriented
class Camera:
    """The pinhole camera of the course: perspective, image plane one unit away, pixel (0, 0) at the bottom left.

    Args:
        width, height: pixels.
        eye, at, up: 3 numbers each, world space.
        fov: vertical field of view in degrees, between 0 and 180.
        handedness: "left" as in the courses, or "right" (C-5).

    Raises:
        InputError: parameters for which no camera exists, with the name and value (C-6).
    """

    projection = "perspective"

    def __init__(
        self,
        width: int = 128,
        height: int = 128,
        eye: tuple[float, float, float] = (0.0, 0.0, 5.0),
        at: tuple[float, float, float] = (0.0, 0.0, 0.0),
        up: tuple[float, float, float] = (0.0, 1.0, 0.0),
        fov: float = 60.0,
        handedness: str = "left",
    ) -> None:
        for name, size in (("width", width), ("height", height)):
            if int(size) != size or size < 1:
                raise InputError(f"camera: {name} must be a whole number of at least 1, not {size!r}")
        if handedness not in HANDEDNESS:
            raise one_of("handedness", handedness, HANDEDNESS)
        self.width, self.height, self.handedness = int(width), int(height), handedness
        self.version = 0  # counts changes, so that a renderer knows when its samples are of another picture
        self._values = {"eye": eye, "at": at, "up": up, "fov": fov}
        self._check(self._values)
        self._memory = runtime.Memory()
        self.camera_to_world = ti.Matrix.field(4, 4, float)
        self.half_size = ti.Vector.field(2, float)
        self._memory.fields.place(self.camera_to_world, self.half_size)
        self._memory.allocate()
        self.set_camera_parameters()

    def set_camera_parameters(self, eye=None, at=None, up=None, fov=None, handedness=None) -> None:
        """Move the camera; what is not given stays. On an InputError nothing has changed."""
        self._memory.check("camera")
        if handedness is not None and handedness not in HANDEDNESS:
            raise one_of("handedness", handedness, HANDEDNESS)
        given = {"eye": eye, "at": at, "up": up, "fov": fov}
        values = {**self._values, **{name: value for name, value in given.items() if value is not None}}
        self._values = self._check(values)
        self.handedness = self.handedness if handedness is None else handedness
        matrix, half_size = self.compute_matrix(), np.array(self.compute_half_size())
        self._load(matrix.astype(runtime.dtype()), half_size.astype(runtime.dtype()))
        self.version += 1

    @staticmethod
    def _check(values: dict) -> dict:
        """``values`` as float64 arrays and a float; InputError where they are no camera."""
        checked = {}
        for name in ("eye", "at", "up"):
            try:
                vector = np.asarray(values[name], dtype=np.float64).reshape(-1)
            except (TypeError, ValueError):
                raise InputError(f"camera: {name} must be 3 numbers, not {values[name]!r}") from None
            if vector.shape != (3,) or not np.isfinite(vector).all():
                raise InputError(f"camera: {name} must be 3 finite numbers, not {values[name]!r}")
            checked[name] = vector
        checked["fov"] = fov = float(values["fov"])
        if not 0.0 < fov < 180.0:
            raise InputError(f"camera: fov must be between 0 and 180 degrees (both excluded), not {fov:g}")
        camera_frame(checked["eye"], checked["at"], checked["up"])
        return checked

    eye = property(lambda self: self._values["eye"].copy(), doc="Position, (3,) float64, world space.")
    at = property(lambda self: self._values["at"].copy(), doc="The point looked at, (3,) float64, world space.")
    up = property(lambda self: self._values["up"].copy(), doc="Which way is up, (3,) float64, world space.")
    fov = property(lambda self: self._values["fov"], doc="Vertical field of view in degrees.")

    def compute_matrix(self) -> np.ndarray:
        """(4, 4) float64 camera-to-world matrix (A1-8)."""
        return camera_frame(self.eye, self.at, self.up, self.handedness)

    def compute_half_size(self) -> tuple[float, float]:
        """Half the width and height of the image plane at distance 1: tan(fov/2) · width/height, and tan(fov/2)."""
        tan_half_fov = math.tan(math.radians(self.fov) / 2)
        return tan_half_fov * self.width / self.height, tan_half_fov

    @ti.kernel
    def _load(self, matrix: ti.types.ndarray(ndim=2), half_size: ti.types.ndarray(ndim=1)):
        for i, j in ti.static(ti.ndrange(4, 4)):
            self.camera_to_world[None][i, j] = matrix[i, j]
        for i in ti.static(range(2)):
            self.half_size[None][i] = half_size[i]

    @ti.func
    def generate_ndc_coords(self, pixel_x, pixel_y, xi):
        """Corners of the image at (±1, ±1), x right, y up (A1-4); ``xi`` in [0, 1)² is the point within the pixel."""
        return tm.vec2(2 * (pixel_x + xi.x) / self.width - 1, 2 * (pixel_y + xi.y) / self.height - 1)

    @ti.func
    def generate_camera_coords(self, ndc):
        """The direction through an NDC point, before it is turned into the world: w = 0 (A1-7)."""
        half = self.half_size[None]
        return tm.vec4(ndc.x * half.x, ndc.y * half.y, 1, 0)

    @ti.func
    def generate_ray(self, pixel_x, pixel_y, jitter: ti.template() = False, xi=CENTRE):
        """The eye ray through the centre of a pixel, or with ``jitter`` through its point ``xi`` in [0, 1)² (A2-1).

        ``pixel_x`` and ``pixel_y`` may be fractions of a pixel. The direction has unit length.
        """
        within_pixel = tm.vec2(0.5)
        if ti.static(jitter):
            within_pixel = xi
        ndc = self.generate_ndc_coords(pixel_x, pixel_y, within_pixel)
        camera_to_world = self.camera_to_world[None]
        eye = tm.vec3(camera_to_world[0, 3], camera_to_world[1, 3], camera_to_world[2, 3])
        direction = (camera_to_world @ self.generate_camera_coords(ndc)).xyz
        return Ray(origin=eye, direction=direction * (1 / direction.norm()))

    @ti.func
    def generate_rays(self, pixel_x, pixel_y, xi_x, xi_y):
        """``generate_ray`` through points ξ of several pixels at once, for packets: the same bits.

        Takes vectors of pixel coordinates and of points within the pixels, and returns the origin and three vectors
        with the components of the directions.
        """
        half, m = self.half_size[None], self.camera_to_world[None]
        x = (2 * (pixel_x + xi_x) / self.width - 1) * half.x
        y = (2 * (pixel_y + xi_y) / self.height - 1) * half.y
        dx = m[0, 0] * x + m[0, 1] * y + m[0, 2]
        dy = m[1, 0] * x + m[1, 1] * y + m[1, 2]
        dz = m[2, 0] * x + m[2, 1] * y + m[2, 2]
        scale = 1 / ti.sqrt(dx * dx + dy * dy + dz * dz)
        return tm.vec3(m[0, 3], m[1, 3], m[2, 3]), dx * scale, dy * scale, dz * scale
