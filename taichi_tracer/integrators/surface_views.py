"""The six views of what a ray hit (A1-15). Each view is a function of the hit, and one line that registers it."""

import taichi as ti
import taichi.math as tm

from taichi_tracer.integrators.base import View
from taichi_tracer.system.registry import register

MAX_DISTANCE = 10.0  # shown as white (A1-15)
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
def distance(data):
    """Black at the eye, white at MAX_DISTANCE and farther away."""
    return tm.vec3(tm.clamp(data.distance / MAX_DISTANCE, 0, 1))


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


register(View("hit", "Hit", hit))
register(View("triangle_id", "Triangle ID", triangle_id, aliases=("triangle_ID",)))
register(View("distance", "Distance", distance))
register(View("barycentric", "Barycentric", barycentric, aliases=("barycentrics",)))
register(View("normal", "Normal", normal, aliases=("normals",)))
register(View("material_id", "Material ID", material_id, aliases=("material_ID",)))
