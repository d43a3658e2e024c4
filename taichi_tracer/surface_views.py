"""The six views of what a ray hit (A1-15). A view is one function of the hit; one added here is known everywhere.

The command line, the window's buttons, ``A1Renderer``'s setters and the tests all read ``ALL``.
"""

from collections.abc import Callable
from dataclasses import dataclass

import taichi as ti
import taichi.math as tm

from taichi_tracer import runtime

MAX_DISTANCE = 10.0  # shown as white (A1-15)
# Ids become colours by multiplying with π, the digits of Planck's constant and e, and keeping the fraction (A1-15).
ID_COLOR = (3.14159265, 6.62607015, 2.71828182)


@dataclass(frozen=True)
class View:
    """A named function HitData → RGB in [0, 1]; misses are black and never reach it."""

    name: str
    label: str
    color: Callable
    aliases: tuple[str, ...] = ()


@ti.func
def hit(data):
    """White in front, dark red behind."""
    return ti.select(data.is_backfacing, tm.vec3(0.5, 0, 0), tm.vec3(1))


@ti.func
def triangle_id(data):
    """A colour per triangle."""
    return id_color(data.triangle_id)


@ti.func
def distance(data):
    """Black at the eye, white at MAX_DISTANCE and beyond."""
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
    """(i + 1)·ID_COLOR mod 1. In f64 where there is one: an f32 product with a large id keeps no fraction."""
    color = tm.vec3(0)
    for k in ti.static(range(3)):
        if ti.static(runtime.has_f64()):
            color[k] = ti.cast(tm.fract(ti.cast(i + 1, ti.f64) * ti.cast(ID_COLOR[k], ti.f64)), float)
        else:
            color[k] = tm.fract((i + 1) * ID_COLOR[k])
    return color


ALL = (
    View("hit", "Hit", hit),
    View("triangle_id", "Triangle ID", triangle_id, aliases=("triangle_ID",)),
    View("distance", "Distance", distance),
    View("barycentric", "Barycentric", barycentric, aliases=("barycentrics",)),
    View("normal", "Normal", normal, aliases=("normals",)),
    View("material_id", "Material ID", material_id, aliases=("material_ID",)),
)
