"""What a surface is made of, as Wavefront MTL files say it (A1-17)."""

from dataclasses import astuple, dataclass, fields

import numpy as np
import taichi as ti
import taichi.math as tm

from taichi_tracer.ray import real
from taichi_tracer.system import runtime


@dataclass(frozen=True)
class Material:
    """One material, on the host. Colours are linear RGB; unset values are those of the MTL format.

    Attributes:
        name: as in the file.
        Kd: reflectance of the diffuse or the Phong lobe (A2-4).
        Ka, Ks: ambient and specular colour; kept, not used by the two BRDFs of the course.
        Ke: emitted radiance.
        Ns: Phong exponent; 1 or less is diffuse (C-4).
        Ni: index of refraction.
        d: opacity, 1 is opaque.
        alpha_x, alpha_y, F0: microfacet roughness and normal-incidence reflectance (extensions of the course).
    """

    name: str = "default"
    Kd: tuple[float, float, float] = (0.8, 0.8, 0.8)
    Ka: tuple[float, float, float] = (0.0, 0.0, 0.0)
    Ks: tuple[float, float, float] = (0.0, 0.0, 0.0)
    Ke: tuple[float, float, float] = (0.0, 0.0, 0.0)
    Ns: float = 1.0
    Ni: float = 1.0
    d: float = 1.0
    alpha_x: float = 0.0
    alpha_y: float = 0.0
    F0: tuple[float, float, float] = (0.0, 0.0, 0.0)


# The same values inside kernels; a name has no place there.
MaterialValues = ti.types.struct(
    **{f.name: tm.vec3 if isinstance(f.default, tuple) else real for f in fields(Material) if f.name != "name"}
)


def as_table(materials: list[Material]) -> np.ndarray:
    """(M, 20) float64: the numbers of every material in the order of ``Material``'s fields, without the name."""
    rows = [np.hstack(astuple(m)[1:]) for m in materials]
    return np.array(rows, dtype=np.float64).reshape(len(rows), -1)


@ti.data_oriented
class MaterialLibrary:
    """The materials of one scene, found by material id.

    Args:
        kinds: for each material, which BRDF it has: whatever number the scene's maker finds it by.
    """

    def __init__(self, materials: list[Material], kinds: list[int], fields: ti.FieldsBuilder) -> None:
        self.materials, self._kinds = list(materials), list(kinds)
        self.table = ti.field(float)
        self.kinds = ti.field(ti.i32)
        fields.dense(ti.i, max(1, len(self.materials))).place(self.kinds)
        fields.dense(ti.ij, (max(1, len(self.materials)), as_table([Material()]).shape[1])).place(self.table)

    def load(self) -> None:
        """Copy the materials into the field; after the builder's ``finalize``."""
        if len(self.materials) > 0:
            self._load(as_table(self.materials).astype(runtime.dtype()), np.array(self._kinds, np.int32))

    @ti.kernel
    def _load(self, table: ti.types.ndarray(ndim=2), kinds: ti.types.ndarray(ndim=1)):
        for i in range(table.shape[0]):
            self.kinds[i] = kinds[i]
            for k in range(table.shape[1]):
                self.table[i, k] = table[i, k]

    @ti.func
    def get(self, material_id):
        """The numbers of one material. Only those that are used are read: the compiler drops the rest."""
        i = material_id
        return MaterialValues(
            Kd=tm.vec3(self.table[i, 0], self.table[i, 1], self.table[i, 2]),
            Ka=tm.vec3(self.table[i, 3], self.table[i, 4], self.table[i, 5]),
            Ks=tm.vec3(self.table[i, 6], self.table[i, 7], self.table[i, 8]),
            Ke=tm.vec3(self.table[i, 9], self.table[i, 10], self.table[i, 11]),
            Ns=self.table[i, 12],
            Ni=self.table[i, 13],
            d=self.table[i, 14],
            alpha_x=self.table[i, 15],
            alpha_y=self.table[i, 16],
            F0=tm.vec3(self.table[i, 17], self.table[i, 18], self.table[i, 19]),
        )
