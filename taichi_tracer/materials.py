"""What a surface is made of, as Wavefront MTL files say it (A1-17)."""

from dataclasses import dataclass, field, fields

import numpy as np
import taichi as ti
import taichi.math as tm
from taichi.lang.expr import Expr

from taichi_tracer.ray import real
from taichi_tracer.system import runtime
from taichi_tracer.system.errors import InputError
from taichi_tracer.system.seams import in_kernels


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
        extra: key in lower case → numbers, of every other key of the file: what a BRDF's ``parameters`` are found in.
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
    extra: dict[str, tuple[float, ...]] = field(default_factory=dict, hash=False)

    def value(self, name: str, default):
        """A parameter of a BRDF: a number or three as the default is, from the file or the default itself.

        Raises:
            InputError: the file has another count of numbers.
        """
        numbers = self.extra.get(name.lower())
        if numbers is None:
            return default
        count = np.size(default)
        if len(numbers) == 1 and count == 3:
            numbers = numbers * 3
        if len(numbers) != count:
            raise InputError(f"material {self.name!r}: {name} needs {count} numbers, not {len(numbers)}")
        return numbers[0] if count == 1 else tuple(numbers)


# The members of a material that kernels know: all but the name and the keys that only some BRDFs read.
BUILT_IN = {f.name: f.default for f in fields(Material) if f.name not in ("name", "extra")}


class Materials(list):
    """The ``Material`` of every id; a kernel that asks ``materials[material_id]`` gets its numbers."""

    library: "MaterialLibrary"

    def __getitem__(self, index):
        if isinstance(index, Expr):
            return self.library.get(index)
        return super().__getitem__(index)


@ti.data_oriented
class MaterialLibrary:
    """The materials of one scene, found by material id.

    Args:
        materials: in the order of their ids.
        brdfs: the BRDFs that the scene knows; the last one that describes a material is its own.
        fields: where the library's fields are placed.

    Attributes:
        brdf_ids: (M,) for each material, which of ``brdfs`` it has.
        members: name → default of what a material has in kernels: the usual MTL keys, and the parameters of ``brdfs``.
    """

    def __init__(self, materials: list[Material], brdfs: list, fields: ti.FieldsBuilder) -> None:
        self.materials, self.brdfs = Materials(materials), list(brdfs)
        self.materials.library = self
        self.members = dict(BUILT_IN)
        for brdf in self.brdfs:
            self.members |= brdf.parameters
        self._struct = ti.types.struct(**{n: tm.vec3 if np.size(d) == 3 else real for n, d in self.members.items()})
        self.brdf_of = [self._brdf_of(m) for m in self.materials]
        self.table, self.brdf_ids = ti.field(float), ti.field(ti.i32)
        rows = max(1, len(self.materials))
        fields.dense(ti.i, rows).place(self.brdf_ids)
        fields.dense(ti.ij, (rows, self.as_table([Material()]).shape[1])).place(self.table)

    def _brdf_of(self, material: Material) -> int:
        dtype = runtime.dtype()
        for i, brdf in reversed(list(enumerate(self.brdfs))):
            if brdf.describes(material, dtype):
                return i
        raise InputError(f"material {material.name!r}: none of {', '.join(b.name for b in self.brdfs)} describes it")

    def as_table(self, materials: list[Material]) -> np.ndarray:
        """(M, n) float64: the numbers of every material, in the order of ``members``."""
        rows = [
            np.hstack([getattr(m, n) if n in BUILT_IN else m.value(n, default) for n, default in self.members.items()])
            for m in materials
        ]
        return np.array(rows, dtype=np.float64).reshape(len(rows), -1)

    def load(self) -> None:
        """Copy the materials into the fields, once the fields are allocated."""
        if len(self.materials) > 0:
            table = self.as_table(self.materials).astype(runtime.dtype())
            self._load(table, np.array(self.brdf_of, np.int32))

    @ti.kernel
    def _load(self, table: ti.types.ndarray(ndim=2), brdf_ids: ti.types.ndarray(ndim=1)):
        for i in range(table.shape[0]):
            self.brdf_ids[i] = brdf_ids[i]
            for k in range(table.shape[1]):
                self.table[i, k] = table[i, k]

    @in_kernels
    def get(self, material_id):
        """The numbers of one material, as a struct. Only those that are used are read: the compiler drops the rest."""
        values, column = {}, 0
        for name, default in self.members.items():
            if np.size(default) == 3:
                values[name] = self._vec3(material_id, column)
            else:
                values[name] = self._number(material_id, column)
            column += np.size(default)
        return self._struct(**values)

    @ti.func
    def _number(self, i, column: ti.template()):
        return self.table[i, column]

    @ti.func
    def _vec3(self, i, column: ti.template()):
        return tm.vec3(self.table[i, column], self.table[i, column + 1], self.table[i, column + 2])
