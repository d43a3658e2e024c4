"""AOVs: raw arrays beside a picture. What does the ray through the centre of each pixel hit, in numbers?

Other renderers call them by the same name, "arbitrary output variables". A channel of an EXR file is a float32, and its
name follows the conventions of OpenEXR: Z is the distance from the viewer ("Interpreting OpenEXR Deep Pixels"). The
components of a vector are the channels X, Y and Z of a layer, whose name stands before a dot.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import taichi as ti

from taichi_tracer.formulas import vector_math as tm
from taichi_tracer.ray import RayHits, no_hit
from taichi_tracer.system.errors import InputError, one_of

LARGEST_ID = 1 << 24  # float32 has every whole number up to this one


@dataclass(frozen=True)
class Aov:
    """One kind of raw array.

    Attributes:
        name: the name that ``renderer.aov`` and ``--aov`` take.
        member: the member of ``RayHits``, or the key of ``albedo_uv_of``, that it shows.
        miss: its value where the ray hits nothing.
        channels: the names of its components in an EXR file.
        is_look: whether it comes from ``albedo_uv_of``.
    """

    name: str
    member: str
    miss: float
    channels: tuple[str, ...]
    is_look: bool = False

    def of(self, hits, looks=None) -> np.ndarray:
        """(n,) or (n, number of channels) array: int32 for ids, otherwise in the running precision.

        Args:
            hits: the ``RayHits``.
            looks: what ``albedo_uv_of`` says of them, which is needed if ``is_look``.
        """
        values = (looks[self.member] if self.is_look else getattr(hits, self.member)).copy()
        values[~hits.is_hit] = self.miss
        return values


AOVS = {
    aov.name: aov
    for aov in (
        Aov("distance", "distance", np.inf, ("Z",)),
        Aov("position", "position", np.nan, ("P.X", "P.Y", "P.Z")),
        Aov("normal", "normal", np.nan, ("N.X", "N.Y", "N.Z")),
        Aov("barycentric", "barycentric_coords", np.nan, ("barycentric.u", "barycentric.v")),
        Aov("triangle_id", "triangle_id", -1, ("triangle_id",)),
        Aov("material_id", "material_id", -1, ("material_id",)),
        Aov("uv", "uv", np.nan, ("uv.u", "uv.v"), is_look=True),
        Aov("albedo", "albedo", np.nan, ("albedo.R", "albedo.G", "albedo.B"), is_look=True),
    )
}


def find_aovs(names: Sequence[str] | str) -> tuple[Aov, ...]:
    """The AOVs with these names, each of them once; an InputError if one is unknown."""
    names = (names,) if isinstance(names, str) else names
    for name in names:
        if name not in AOVS:
            raise one_of("AOV", name, AOVS)
    return tuple(AOVS[name] for name in dict.fromkeys(names))


def channel_names(aovs: Sequence[Aov]) -> list[str]:
    """The names of all channels of some AOVs."""
    return [name for aov in aovs for name in aov.channels]


def as_channels(aov: Aov, values: np.ndarray) -> dict[str, np.ndarray]:
    """Name → (height, width) array of each channel; an InputError if an id is too large for an EXR file.

    Args:
        values: (height, width) or (height, width, number of channels), as ``renderer.aov`` returns it.
    """
    if values.dtype.kind == "i" and values.max(initial=0) > LARGEST_ID:
        advice = f'save it by numpy.save("{aov.name}.npy", renderer.aov("{aov.name}"))'
        raise InputError(f"{aov.name}: {values.max()} is more than {LARGEST_ID}, the largest id in an EXR: {advice}")
    planes = np.moveaxis(np.atleast_3d(values), 2, 0)
    return dict(zip(aov.channels, planes, strict=True))


def albedo_uv_of(scene: Any, hits: RayHits) -> dict[str, np.ndarray]:
    """The surfaces that rays hit, in the precision of ``hits``; ``scene`` is a ``SceneInKernels``.

    Returns:
        Arrays with one row per ray, 0 for a ray that hits nothing: "uv", (n, 2) where the texture is looked up, not
        only its fractional part, 0 in a scene without textures; "albedo", (n, 3) linear Kd with its texture and the
        colours of vertices.
    """
    n, dtype = len(hits), hits.distance.dtype
    looks = {"uv": np.zeros((n, 2), dtype), "albedo": np.zeros((n, 3), dtype)}
    inputs = (hits.triangle_id, hits.material_id, hits.barycentric_coords)
    _look_up(scene, *map(np.ascontiguousarray, inputs), **looks)
    return looks


@ti.kernel
def _look_up(
    scene: ti.template(),
    triangle_ids: ti.types.ndarray(ndim=1),
    material_ids: ti.types.ndarray(ndim=1),
    barycentric: ti.types.ndarray(ndim=2),
    uv: ti.types.ndarray(ndim=2),
    albedo: ti.types.ndarray(ndim=2),
):
    for i in range(triangle_ids.shape[0]):
        hit = no_hit()
        hit.triangle_id, hit.material_id = triangle_ids[i], material_ids[i]
        hit.barycentric_coords = tm.vec2(barycentric[i, 0], barycentric[i, 1])
        if hit.triangle_id >= 0:
            color = scene.material_at(hit).Kd
            for k in ti.static(range(3)):
                albedo[i, k] = color[k]
            if ti.static(scene.effects.textures):
                place = scene.textures.coordinates_at(hit)
                for k in ti.static(range(2)):
                    uv[i, k] = place[k]
