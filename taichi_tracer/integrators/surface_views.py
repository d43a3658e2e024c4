"""The six views of what a ray hit (A1-15). Each view is a function of the hit, and one line that registers it.

The view of the distance also has a value that can be changed, and is therefore a class.
"""

import math

import numpy as np
import taichi as ti

from taichi_tracer.formulas import vector_math as tm
from taichi_tracer.integrators.base import LiveNumbers, View
from taichi_tracer.system.compile_time import inside_kernel
from taichi_tracer.system.errors import InputError
from taichi_tracer.system.parts import register
from taichi_tracer.tones.heat import round_up

MAX_DISTANCE = 10.0  # shown as white (A1-15), if the farthest point of the scene is within the following range
NEAREST_FAR, FARTHEST_FAR = 1.0, 10.0
# The red, green and blue of an id are the fractional parts of its products with π, with the digits of Planck's
# constant, and with e (A1-15).
ID_COLOR_UNIT = 100_000_000
ID_COLOR = (314159265, 662607015, 271828182)  # in ID_COLOR_UNITs


@ti.func
def hit(data):
    """White for front faces, dark red for back faces."""
    return ti.select(data.is_backfacing, tm.vec3(0.5, 0, 0), tm.vec3(1))


@ti.func
def triangle_id(data):
    """A colour per triangle."""
    return id_color(data.triangle_id)


@ti.func
def distance(data, max_distance):
    """Black at the eye, white at max_distance and farther away."""
    return tm.vec3(tm.clamp(data.distance / max_distance, 0, 1))


@ti.func
def barycentric(data):
    """(u, v, w) as RGB."""
    u, v = data.barycentric_coords.x, data.barycentric_coords.y
    return tm.vec3(u, v, 1 - u - v)


@ti.func
def normal(data):
    """[−1, 1] mapped to [0, 1], per axis."""
    return (data.normal + 1) / 2


@ti.func
def material_id(data):
    """A colour per material."""
    return id_color(data.material_id)


@ti.func
def id_color(i):
    """(i + 1)·ID_COLOR mod 1, computed in integers: in floats, the fractional part would be lost for large ids."""
    color = tm.vec3(0)
    for k in ti.static(range(3)):
        product = ti.cast(i + 1, ti.i64) * ID_COLOR[k]
        color[k] = ti.cast(product % ID_COLOR_UNIT, float) / ID_COLOR_UNIT
    return color


@ti.data_oriented
class Distance(View):
    """The distance of the hit: black at the eye, white at ``max_distance`` and farther away (A1-15).

    Attributes:
        max_distance: the distance that is white, in units of the scene. It is 10, as in the handouts, if the farthest
            corner of the scene's box is 1 to 10 units from the eye; for other scenes, it is the smallest of 1, 2 and 5
            times a power of ten that is not less than the distance of this corner. It is computed whenever a picture
            begins, unless a number was assigned: ``view.max_distance = 4``. Assigning None computes it again. Kernels
            can read it too.
        version: counts the assignments, so that a renderer knows when its samples belong to an older picture.
    """

    name, label = "distance", "Distance"

    def __init__(self) -> None:
        super().__init__()
        self._chosen: float | None = None
        self._fitting, self._farthest = MAX_DISTANCE, math.nan
        self.numbers = LiveNumbers()

    @property
    def max_distance(self):
        """The distance that is white; see the class."""
        if inside_kernel():
            return self.numbers.get(0)
        return self._fitting if self._chosen is None else self._chosen

    @max_distance.setter
    def max_distance(self, distance: float | None) -> None:
        if distance is not None and not 0 < float(distance) < math.inf:
            raise InputError(f"distance: max_distance must be a finite number above 0, not {distance!r}")
        if distance != self._chosen:
            self._chosen = None if distance is None else float(distance)
            self.version += 1

    def prepare(self, scene_data, camera) -> None:
        """Compute the ``max_distance`` that fits a scene, as seen by a camera, and let kernels know it."""
        self._farthest = farthest_corner(scene_data.geometry, camera.eye)
        self._fitting = fitting_distance(self._farthest)
        self.numbers.set(self.max_distance)

    def facts(self) -> dict:
        """What the bits of a picture depend on, for checkpoints; nothing if it is as in the handouts."""
        return {} if self.max_distance == MAX_DISTANCE else {"max_distance": self.max_distance}

    def notes(self) -> list[str]:
        """A line about ``max_distance``, if it was computed and differs from that of the handouts."""
        if self._chosen is not None or self.max_distance == MAX_DISTANCE:
            return []
        return [
            f"distance: white is {self.max_distance:g} units, because the farthest corner of the scene is "
            f"{self._farthest:.3g} units from the eye (--max-distance sets another)"
        ]

    @ti.func
    def color(self, hit):
        """d / max_distance in all three channels, at most 1."""
        return distance(hit, self.numbers.get(0))


def farthest_corner(geometry, eye: np.ndarray) -> float:
    """The distance from the eye to the farthest corner of the scene's box."""
    return float(np.linalg.norm(np.maximum(abs(geometry.low - eye), abs(geometry.high - eye))))


def fitting_distance(farthest: float) -> float:
    """The ``max_distance`` of a scene whose farthest point has this distance from the eye."""
    if NEAREST_FAR <= farthest <= FARTHEST_FAR or not 0 < farthest < math.inf:
        return MAX_DISTANCE
    return round_up(farthest)


register(View("hit", "Hit", hit))
register(View("triangle_id", "Triangle ID", triangle_id, aliases=("triangle_ID",)))
register(Distance)
register(View("barycentric", "Barycentric", barycentric, aliases=("barycentrics",)))
register(View("normal", "Normal", normal, aliases=("normals",)))
register(View("material_id", "Material ID", material_id, aliases=("material_ID",)))
