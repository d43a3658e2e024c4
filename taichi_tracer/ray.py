"""Rays and what they hit, inside kernels; and as arrays: what Python asks a scene, and its answers."""

from dataclasses import dataclass, fields
from typing import TYPE_CHECKING, Any

import numpy as np
import taichi as ti
from numpy.typing import ArrayLike
from taichi.lang.struct import StructType

from taichi_tracer.formulas import vector_math as tm
from taichi_tracer.system import runtime
from taichi_tracer.system.compile_time import Function, compile_time
from taichi_tracer.system.errors import InputError, check_names, digits, digits_of

# tm.vec3 follows the precision that Taichi runs with. ``float`` in a ti.dataclass does not: it keeps the type that it
# had when this file was imported. Therefore the members take their scalar type from tm.vec3.
real = tm.vec3.dtype


class Struct(StructType):
    """A ``ti.dataclass`` for which a wrong name of a member is an error; Taichi would leave this member out."""

    def __call__(self, *members: Any, **named: Any) -> Any:
        check_names(f"member of {self.__name__}", named, self.members)
        return super().__call__(*members, **named)


def struct(members: Function) -> Function:
    """The ``Struct`` of a class that names its members."""
    made = compile_time(ti.dataclass(members))
    made.__class__, made.__name__, made.__doc__ = Struct, members.__name__, members.__doc__
    return made


@struct
class Ray:
    """r(t) = origin + t direction (A1-10). The direction may have any length except 0; t is in units of that length."""

    origin: tm.vec3
    direction: tm.vec3

    if TYPE_CHECKING:  # what ti.dataclass adds, for editors

        def __init__(self, origin: Any = 0, direction: Any = 0) -> None: ...

    @ti.func
    def at(self, t):
        """The point r(t)."""
        return self.origin + t * self.direction


@struct
class HitData:
    """What a ray hit (A1-12). If ``is_hit`` is 0, the distance is infinite, the ids are −1 and the vectors are 0.

    ``distance`` is t, in units of the direction's length. ``barycentric_coords`` = (u, v) are the weights of v1 and v2;
    the weight of v0 is 1 − u − v. ``normal`` is interpolated from the vertex normals, and ``geometric_normal`` is the
    normal of the triangle's plane (C-17). Both have unit length and face the ray's origin. ``position`` is the point on
    the surface. ``position_error`` bounds the rounding error of each of its components; ``offset_origin`` needs it.

    The first seven members are those of the handout. Your own method may begin with ``hit = HitData()`` and then set
    the handout's members one by one; the package adds the members that are missing. ``triangle_id`` is the number of
    the primitive in the order of the file. Spheres are counted together with the triangles.
    """

    is_hit: ti.i32
    is_backfacing: ti.i32
    triangle_id: ti.i32
    distance: real
    barycentric_coords: tm.vec2
    normal: tm.vec3
    material_id: ti.i32
    geometric_normal: tm.vec3
    position: tm.vec3
    position_error: tm.vec3

    if TYPE_CHECKING:  # what ti.dataclass adds, for editors

        def __init__(self, *members: Any, **named: Any) -> None: ...


@compile_time
def no_hit():
    """The HitData of a ray that hits nothing."""
    return HitData(
        is_hit=0,
        is_backfacing=0,
        triangle_id=-1,
        distance=tm.inf,
        barycentric_coords=tm.vec2(0),
        normal=tm.vec3(0),
        geometric_normal=tm.vec3(0),
        material_id=-1,
        position=tm.vec3(0),
        position_error=tm.vec3(0),
    )


@ti.func
def offset_origin(p, error, n):
    """``p``, moved along the unit vector n until it certainly lies off its surface (PBR, 4th edition, section 6.8.6).

    The step is the extent of the error bound along n. It is as small as the rounding error of the point, at any scale.
    Then each component is rounded outwards.
    """
    step = tm.dot(abs(n), error)
    moved = p + step * n
    for k in ti.static(range(3)):
        ulp = abs(moved[k]) * ti.static(2 * runtime.epsilon())
        moved[k] += ti.select(n[k] > 0, ulp, ti.select(n[k] < 0, -ulp, 0.0))
    return moved


ROWS_SHOWN = 20  # of a table of hits in a notebook
# The real numbers of one hit, and how many each member has; and the whole numbers. ``write_hit`` has the same order.
REALS = {"distance": 1, "barycentric_coords": 2, "normal": 3, "geometric_normal": 3, "position": 3}
WHOLE = ("is_hit", "triangle_id", "material_id", "is_backfacing")


@dataclass
class RayHits:
    """The result of ``SceneData.intersect``: arrays with one row per ray. The members are those of ``HitData``.

    ``hits[i]`` and iteration give the members of one ray: ``hits[i].distance`` is a number. ``hits[hits.is_hit]``, or
    another mask, list of numbers or slice, gives the ``RayHits`` of some of the rays.
    """

    is_hit: np.ndarray
    distance: np.ndarray
    triangle_id: np.ndarray
    barycentric_coords: np.ndarray
    normal: np.ndarray
    geometric_normal: np.ndarray
    material_id: np.ndarray
    is_backfacing: np.ndarray
    position: np.ndarray

    @classmethod
    def of_memory(cls, n: int, dtype: type[np.floating]) -> "tuple[RayHits, np.ndarray, np.ndarray]":
        """Arrays without values for n rays, whose flags are int32; and all their numbers, real and whole, in a row."""
        reals, whole = np.empty(n * sum(REALS.values()), dtype), np.empty(n * len(WHOLE), np.int32)
        arrays = dict(zip(WHOLE, whole.reshape(len(WHOLE), n), strict=True))
        parts = np.split(reals, n * np.cumsum([*REALS.values()])[:-1])
        for (name, width), part in zip(REALS.items(), parts, strict=True):
            arrays[name] = part if width == 1 else part.reshape(n, width)
        return cls(**arrays), reals, whole

    def reshaped(self, shape: tuple[int, ...]) -> "RayHits":
        """The same hits, whose members have this shape, and the components of vectors after it."""
        members = {f.name: getattr(self, f.name) for f in fields(self)}
        return RayHits(**{name: one.reshape(*shape, *one.shape[self.is_hit.ndim :]) for name, one in members.items()})

    def __len__(self) -> int:
        return len(self.is_hit)

    def __getitem__(self, which) -> "RayHits":
        return RayHits(**{f.name: getattr(self, f.name)[which] for f in fields(self)})

    @property
    def points(self) -> np.ndarray:
        """(n, 3) ``position``, with NaN instead of 0 for the rays that hit nothing."""
        return np.where(self.is_hit[..., None], self.position, np.nan).astype(self.position.dtype)

    def to_dict(self) -> dict[str, np.ndarray]:
        """Name → (n,) array, one for each component: is_hit, …, normal_x, normal_y, normal_z, …

        ``pandas.DataFrame(hits.to_dict())`` is a table with one row per ray. The two components of
        ``barycentric_coords`` have the names u and v.
        """
        columns, flat = {}, self.reshaped((self.is_hit.size,))
        for f in fields(self):
            values = getattr(flat, f.name)
            if values.ndim == 1:
                columns[f.name] = values
            else:
                letters = "uv" if values.shape[1] == 2 else "xyz"
                columns |= {f"{f.name}_{letter}": values[:, k] for k, letter in enumerate(letters)}
        return columns

    def __repr__(self) -> str:
        if np.ndim(self.is_hit) == 0:
            return f"RayHits({', '.join(f'{f.name}={getattr(self, f.name)}' for f in fields(self))})"
        return f"RayHits({self.is_hit.size:,} rays, {int(self.is_hit.sum()):,} hits)"

    def _repr_html_(self, most: int = ROWS_SHOWN) -> str:
        """The first rows as an HTML table, for notebooks."""
        names, flat = [f.name for f in fields(self)], self.reshaped((self.is_hit.size,))
        head = "".join(f"<th>{name}</th>" for name in ["ray", *names])
        rows = "".join(
            f"<tr><td>{i}</td>" + "".join(f"<td>{_cell(getattr(flat, name)[i])}</td>" for name in names) + "</tr>"
            for i in range(min(most, len(flat)))
        )
        rest = f"<p>… and {len(flat) - most:,} more rays</p>" if len(flat) > most else ""
        summary = f"<p>{self.is_hit.size:,} rays, {int(self.is_hit.sum()):,} hits</p>"
        return f"{summary}<table><thead><tr>{head}</tr></thead><tbody>{rows}</tbody></table>{rest}"


def _cell(value: Any) -> str:
    if np.ndim(value) > 0:
        return digits_of(value, ".4g")
    if isinstance(value, np.bool_):
        return "yes" if value else "no"
    return digits(float(value), ".6g")


def as_rays(
    origins: ArrayLike, directions: ArrayLike, t_min: ArrayLike, t_max: ArrayLike
) -> tuple[tuple[np.ndarray, ...], tuple[int, ...]]:
    """Contiguous (N, 3), (N, 3), (N,), (N,) arrays in the running precision, and the shape of the N rays.

    Single values are repeated N times.
    """
    dtype = runtime.dtype()
    arrays = []
    for name, value in (("origins", origins), ("directions", directions)):
        array = np.asarray(value, dtype=dtype)
        if array.ndim == 1 and array.size == 0:
            array = array.reshape(0, 3)
        if array.ndim == 0 or array.shape[-1] != 3:
            raise InputError(f"intersect: {name} must have the shape (n, 3), not {array.shape}")
        arrays.append(array)
    try:
        shape = np.broadcast_shapes(*(a.shape[:-1] for a in arrays), np.shape(t_min), np.shape(t_max)) or (1,)
        o, d = (np.ascontiguousarray(np.broadcast_to(a, (*shape, 3)).reshape(-1, 3)) for a in arrays)
        lo, hi = (np.broadcast_to(np.asarray(t, dtype), shape).ravel() for t in (t_min, t_max))
    except ValueError:
        shapes = ", ".join(str(np.shape(a)) for a in (origins, directions, t_min, t_max))
        raise InputError(f"intersect: origins, directions, t_min, t_max do not fit together: {shapes}") from None
    return (o, d, lo, hi), shape


@ti.func
def ray_from(origins: ti.template(), directions: ti.template(), i):
    """Row i of two (N, 3) arrays as a ray."""
    return Ray(
        origin=tm.vec3(origins[i, 0], origins[i, 1], origins[i, 2]),
        direction=tm.vec3(directions[i, 0], directions[i, 1], directions[i, 2]),
    )


@ti.func
def write_hit(hit, i, n, reals: ti.template(), whole: ti.template()):
    """Write the HitData of ray i, one of n, into the two rows of numbers of ``RayHits.of_memory``."""
    reals[i] = hit.distance
    for k in ti.static(range(2)):
        reals[n + 2 * i + k] = hit.barycentric_coords[k]
    for k in ti.static(range(3)):
        reals[3 * n + 3 * i + k] = hit.normal[k]
        reals[6 * n + 3 * i + k] = hit.geometric_normal[k]
        reals[9 * n + 3 * i + k] = hit.position[k]
    whole[i] = hit.is_hit
    whole[n + i] = hit.triangle_id
    whole[2 * n + i] = hit.material_id
    whole[3 * n + i] = hit.is_backfacing
