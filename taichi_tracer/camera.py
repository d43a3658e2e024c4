"""Where rays come from: a pixel of the image plane, in three coordinate systems (A1-3 … A1-9, RT-1 … RT-5).

Two cameras have one interface. Both map a pixel to a point (u, v) of their screen window; the perspective camera takes
it for the goal of a ray from the eye, the orthographic one for the start of a ray along the gaze. One added to
``CAMERAS`` is known to the command line, the window, the scene files and the tests.
"""

import math
import warnings
from abc import ABC, abstractmethod

import numpy as np
import taichi as ti
import taichi.math as tm

from taichi_tracer.formulas.camera_frame import camera_frame, fovy_window, numbers, show, stretch_of, window_of
from taichi_tracer.ray import Ray
from taichi_tracer.system import runtime
from taichi_tracer.system.errors import InputError, one_of

HANDEDNESS = ("left", "right")
CENTRE = tm.vec2(0.5, 0.5)  # of a pixel
DEFAULT_WINDOW = "default"  # asks for RT-3's where nothing would mean an angle


@ti.data_oriented
class ProjectiveCamera(ABC):
    """A frame, a screen window and an image of pixels, (0, 0) at the bottom left; a subclass says what its rays are.

    Args:
        width, height: pixels.
        eye, at, up: 3 numbers each, world space.
        fov: vertical field of view in degrees, between 0 and 180; of a perspective camera only.
        handedness: "left" as in the courses, or "right" (C-5).
        screen_window: (l, r, b, t) of the image plane at the focal distance; it wins over ``fov`` (C-9).
            "default" is [−1, 1] along the shorter axis of the image (RT-3).
        frame_aspect: width / height of the window, where that is not to be the image's (RT-4).
        focal_distance: where the window stands, along the gaze (RT-5).

    Raises:
        InputError: parameters for which no camera exists, with the name and value (C-6).
    """

    projection = ""  # the name of the kind of camera
    share_origin = False  # whether all rays start at one point
    default_fov: float | None = None  # where neither an angle nor a window is given

    def __init_subclass__(cls) -> None:
        """Whoever gives other rays must say again whether they share their origin."""
        if {"rays_through", "generate_rays"} & set(vars(cls)):
            cls.share_origin = vars(cls).get("share_origin", False)

    def __init__(
        self,
        width: int = 128,
        height: int = 128,
        eye: tuple[float, float, float] = (0.0, 0.0, 5.0),
        at: tuple[float, float, float] = (0.0, 0.0, 0.0),
        up: tuple[float, float, float] = (0.0, 1.0, 0.0),
        fov: float | None = None,
        handedness: str = "left",
        screen_window: tuple[float, float, float, float] | str | None = None,
        frame_aspect: float | None = None,
        focal_distance: float = 1.0,
    ) -> None:
        for name, size in (("width", width), ("height", height)):
            if int(size) != size or size < 1:
                raise InputError(f"camera: {name} must be a whole number of at least 1, not {size!r}")
        self.width, self.height = int(width), int(height)
        self.version = 0  # counts changes, so that a renderer knows when its samples are of another picture
        if isinstance(screen_window, str) and screen_window != DEFAULT_WINDOW:
            raise one_of("screen_window", screen_window, [DEFAULT_WINDOW, "or four numbers"])
        values = {"eye": eye, "at": at, "up": up, "handedness": handedness}
        values["screen_window"] = None if isinstance(screen_window, str) else screen_window
        values["fov"] = self.default_fov if fov is None and screen_window is None else fov
        self._values = self.check({**values, "frame_aspect": frame_aspect, "focal_distance": focal_distance})
        self._memory = runtime.Memory()
        self.camera_to_world = ti.Matrix.field(4, 4, float)
        self.half_size = ti.Vector.field(2, float)
        self.centre = ti.Vector.field(2, float)
        self._memory.fields.place(self.camera_to_world, self.half_size, self.centre)
        self._memory.allocate()
        self._update()

    def set_camera_parameters(self, eye=None, at=None, up=None, fov=None, handedness=None, **window) -> None:
        """Move the camera; what is not given stays. On an InputError nothing has changed.

        Args:
            window: ``screen_window``, ``frame_aspect``, ``focal_distance``. A new ``fov`` replaces a window.
        """
        self._memory.check("camera")
        given = {"eye": eye, "at": at, "up": up, "fov": fov, "handedness": handedness, **window}
        given = {name: value for name, value in given.items() if value is not None}
        unknown = sorted(set(given) - set(self._values))
        if unknown:
            raise one_of("camera parameter", unknown[0], self._values)
        either = {"fov": None, "screen_window": None} if {"fov", "screen_window"} & set(given) else {}
        self._values = self.check({**self._values, **either, **given})
        self._update()

    @classmethod
    def check(cls, values: dict) -> dict:
        """``values`` as float64 arrays and floats; InputError where they are no camera."""
        checked = dict(values)
        if values["handedness"] not in HANDEDNESS:
            raise one_of("handedness", values["handedness"], HANDEDNESS)
        for name in ("eye", "at", "up"):
            checked[name] = numbers(name, values[name], 3)
        if values["screen_window"] is not None:
            checked["screen_window"] = l, r, b, t = numbers("screen_window", values["screen_window"], 4)
            if not (l < r and b < t):
                raise InputError(
                    f"camera: screen_window is l r b t with l < r and b < t, not {show(checked['screen_window'])}"
                )
        for name in ("frame_aspect", "focal_distance"):
            if values[name] is not None and not 0 < float(values[name]) < math.inf:
                raise InputError(f"camera: {name} must be a finite number above 0, not {values[name]:g}")
        checked["fov"] = cls.check_fov(values["fov"], values["screen_window"])
        camera_frame(checked["eye"], checked["at"], checked["up"])
        return checked

    @classmethod
    @abstractmethod
    def check_fov(cls, fov, screen_window) -> float | None:
        """The angle that counts, or None for that of the window; InputError where it cannot be."""

    eye = property(lambda self: self._values["eye"].copy(), doc="Position, (3,) float64, world space.")
    at = property(lambda self: self._values["at"].copy(), doc="The point looked at, (3,) float64, world space.")
    up = property(lambda self: self._values["up"].copy(), doc="Which way is up, (3,) float64, world space.")
    handedness = property(lambda self: self._values["handedness"], doc='"left" or "right" (C-5).')
    focal_distance = property(lambda self: self._values["focal_distance"], doc="Of the screen window (RT-5).")

    @property
    def frame_aspect(self) -> float:
        """Width / height that the window has where it is not given: the image's, unless set (RT-4)."""
        given = self._values["frame_aspect"]
        return self.width / self.height if given is None else given

    @property
    def screen_window(self) -> tuple[float, float, float, float]:
        """(l, r, b, t) at the focal distance: as given, that of the angle, or the default (RT-3, RT-4)."""
        values = self._values
        return window_of(self.frame_aspect, values["fov"], values["screen_window"], self.focal_distance)

    @property
    def has_window(self) -> bool:
        """Whether the window was given, or is the default: not that of an angle."""
        return self._values["fov"] is None or self._values["screen_window"] is not None

    @property
    def stretch(self) -> float:
        """How many times as wide as high a square is in the picture; 1 where nothing is distorted."""
        return stretch_of(self.screen_window, self.width, self.height)

    def parameters(self) -> dict:
        """What ``make_camera`` needs, beside the size, to make this camera again."""
        values = {"projection": self.projection, **{k: v for k, v in self._values.items() if v is not None}}
        return values if "fov" in values else {"screen_window": DEFAULT_WINDOW, **values}

    def compute_matrix(self) -> np.ndarray:
        """(4, 4) float64 camera-to-world matrix (A1-8)."""
        return camera_frame(self.eye, self.at, self.up, self.handedness)

    def compute_half_size(self) -> tuple[float, float]:
        """Half the width and height of the image plane, at distance 1 where the projection is perspective."""
        l, r, b, t = self.screen_window
        return (r - l) / 2, (t - b) / 2

    def compute_centre(self) -> tuple[float, float]:
        """The middle of the image plane, in the same units."""
        l, r, b, t = self.screen_window
        return (l + r) / 2, (b + t) / 2

    def _update(self) -> None:
        window = np.array([self.compute_half_size(), self.compute_centre()])
        self._load(self.compute_matrix().astype(runtime.dtype()), window.astype(runtime.dtype()))
        self.version += 1

    @ti.kernel
    def _load(self, matrix: ti.types.ndarray(ndim=2), window: ti.types.ndarray(ndim=2)):
        for i, j in ti.static(ti.ndrange(4, 4)):
            self.camera_to_world[None][i, j] = matrix[i, j]
        for i in ti.static(range(2)):
            self.half_size[None][i], self.centre[None][i] = window[0, i], window[1, i]

    @ti.func
    def generate_ndc_coords(self, pixel_x, pixel_y, xi):
        """Corners of the image at (±1, ±1), x right, y up (A1-4); ``xi`` in [0, 1)² is the point within the pixel."""
        return tm.vec2(2 * (pixel_x + xi.x) / self.width - 1, 2 * (pixel_y + xi.y) / self.height - 1)

    @ti.func
    def generate_ray(self, pixel_x, pixel_y, jitter: ti.template() = False, xi=CENTRE):
        """The eye ray through the centre of a pixel, or with ``jitter`` through its point ``xi`` in [0, 1)² (A2-1).

        ``pixel_x`` and ``pixel_y`` may be fractions of a pixel (RT-1). The direction has unit length.
        """
        within_pixel = tm.vec2(0.5)
        if ti.static(jitter):
            within_pixel = xi
        return self.ray_through(self.generate_ndc_coords(pixel_x, pixel_y, within_pixel))

    @ti.func
    def generate_rays(self, pixel_x, pixel_y, xi_x, xi_y):
        """``generate_ray`` through points ξ of several pixels at once, for packets: the same bits.

        Takes vectors of pixel coordinates and of points within the pixels, and returns the components of the origins
        and of the directions, each a vector, or a number that all have in common.
        """
        half, centre = self.half_size[None], self.centre[None]
        x = (2 * (pixel_x + xi_x) / self.width - 1) * half.x + centre.x
        y = (2 * (pixel_y + xi_y) / self.height - 1) * half.y + centre.y
        return self.rays_through(x, y)


@ti.data_oriented
class Camera(ProjectiveCamera):
    """The pinhole camera of the courses: perspective, image plane at the focal distance, one unit where not given.

    Arguments as for ``ProjectiveCamera``. Without an angle and a window the angle is 60°.
    """

    projection = "perspective"
    share_origin = True
    default_fov = 60.0

    @classmethod
    def check_fov(cls, fov, screen_window) -> float | None:
        """Between 0 and 180 degrees; beside a window it does not count, and a warning says so (C-9)."""
        if fov is None:
            return None
        fov = float(fov)
        if not 0.0 < fov < 180.0:
            raise InputError(f"camera: fov must be between 0 and 180 degrees (both excluded), not {fov:g}")
        if screen_window is not None:
            told = show(np.asarray(screen_window, float))
            warnings.warn(f"camera: fov {fov:g} does not count beside screen_window {told}", stacklevel=4)
            return None
        return fov

    @property
    def fov(self) -> float:
        """Vertical field of view in degrees."""
        if self._values["fov"] is not None:
            return self._values["fov"]
        _, _, b, t = self.screen_window
        return math.degrees(math.atan(t / self.focal_distance) - math.atan(b / self.focal_distance))

    def compute_half_size(self) -> tuple[float, float]:
        """Half the width and height of the image plane at distance 1: tan(fov/2) · width/height, and tan(fov/2)."""
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
    def generate_camera_coords(self, ndc):
        """The direction through an NDC point, before it is turned into the world: w = 0 (A1-7, RT-5)."""
        half, centre = self.half_size[None], self.centre[None]
        return tm.vec4(ndc.x * half.x + centre.x, ndc.y * half.y + centre.y, 1, 0)

    @ti.func
    def ray_through(self, ndc):
        """From the eye through a point of the image plane (RT-5)."""
        camera_to_world = self.camera_to_world[None]
        eye = tm.vec3(camera_to_world[0, 3], camera_to_world[1, 3], camera_to_world[2, 3])
        direction = (camera_to_world @ self.generate_camera_coords(ndc)).xyz
        return Ray(origin=eye, direction=direction * (1 / direction.norm()))

    @ti.func
    def rays_through(self, x, y):
        """``ray_through`` several points, given in units of the image plane."""
        m = self.camera_to_world[None]
        dx = m[0, 0] * x + m[0, 1] * y + m[0, 2]
        dy = m[1, 0] * x + m[1, 1] * y + m[1, 2]
        dz = m[2, 0] * x + m[2, 1] * y + m[2, 2]
        scale = 1 / ti.sqrt(dx * dx + dy * dy + dz * dz)
        return m[0, 3], m[1, 3], m[2, 3], dx * scale, dy * scale, dz * scale


@ti.data_oriented
class OrthographicCamera(ProjectiveCamera):
    """Parallel rays along the gaze, from every point of a window about the eye: nothing is smaller far away (RT-5).

    Arguments as for ``ProjectiveCamera``, lengths in world units. There is no ``fov``, and the focal distance is of no
    consequence.
    """

    projection = "orthographic"

    @classmethod
    def check_fov(cls, fov, screen_window) -> float | None:
        """None: parallel rays have no angle between them."""
        if fov is not None:
            raise InputError(f"camera: an orthographic camera has no fov ({fov:g}): give it a screen_window")

    @ti.func
    def ray_through(self, ndc):
        """From e + u û + v v̂ along ŵ."""
        half, centre = self.half_size[None], self.centre[None]
        x, y = ndc.x * half.x + centre.x, ndc.y * half.y + centre.y
        ox, oy, oz, dx, dy, dz = self.rays_through(x, y)
        return Ray(origin=tm.vec3(ox, oy, oz), direction=tm.vec3(dx, dy, dz))

    @ti.func
    def rays_through(self, x, y):
        """``ray_through`` several points, given in units of the image plane."""
        m = self.camera_to_world[None]
        ox = m[0, 0] * x + m[0, 1] * y + m[0, 3]
        oy = m[1, 0] * x + m[1, 1] * y + m[1, 3]
        oz = m[2, 0] * x + m[2, 1] * y + m[2, 3]
        return ox, oy, oz, m[0, 2], m[1, 2], m[2, 2]


PerspectiveCamera = Camera  # as RT3 calls it (RT-1)
CAMERAS = {c.projection: c for c in (Camera, OrthographicCamera)}


def make_camera(width: int, height: int, projection: str = "perspective", **parameters) -> ProjectiveCamera:
    """A camera of a kind in ``CAMERAS``; an orthographic one with an angle shows what that angle shows at ``at``.

    Args:
        parameters: as for ``ProjectiveCamera``.
    """
    if projection not in CAMERAS:
        raise one_of("camera", projection, CAMERAS)
    if projection == "orthographic":
        parameters = without_angle(parameters, width / height)
    return CAMERAS[projection](width, height, **parameters)


def without_angle(view: dict, aspect: float) -> dict:
    """``view`` with the window that its angle shows where the camera looks, for parallel rays; width / height of it."""
    changed = dict(view)
    fov = changed.pop("fov", None)
    if fov is not None and changed.get("screen_window") is None:
        Camera.check_fov(fov, None)
        distance = np.linalg.norm(np.asarray(view["at"], np.float64) - np.asarray(view["eye"], np.float64))
        changed["screen_window"] = fovy_window(fov, view.get("frame_aspect") or aspect, float(distance))
    return changed


def change_projection(view: dict, projection: str) -> dict:
    """The parameters of the other kind of camera, which shows the same where it looks."""
    if projection not in CAMERAS:
        raise one_of("camera", projection, CAMERAS)
    changed = {**view, "projection": projection}
    window = view.get("screen_window")
    if projection != view.get("projection", "perspective") and window is not None and not isinstance(window, str):
        distance = np.linalg.norm(np.asarray(view["at"], np.float64) - np.asarray(view["eye"], np.float64))
        scale = distance / view.get("focal_distance", 1.0)
        changed["screen_window"] = np.asarray(window) * (scale if projection == "orthographic" else 1 / scale)
    return changed


def check_view(width: int, height: int, projection: str = "perspective", **parameters) -> float:
    """The ``stretch`` of the camera that ``make_camera`` would make; InputError where it would make none."""
    named = dict.fromkeys(("fov", "screen_window", "frame_aspect")) | {"handedness": "left", "focal_distance": 1.0}
    values = {**named, **parameters}
    if isinstance(values["screen_window"], str):
        values["screen_window"] = None
    checked = CAMERAS[projection].check(values)
    aspect = checked["frame_aspect"] or width / height
    window = window_of(aspect, checked["fov"], checked["screen_window"], checked["focal_distance"])
    return stretch_of(window, width, height)
