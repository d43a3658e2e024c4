"""What a surface is made of: the values of Wavefront MTL files (A1-17)."""

from dataclasses import InitVar, dataclass, field, fields, replace
from typing import Any

import numpy as np
import taichi as ti
import taichi.math as tm
from taichi.lang.expr import Expr

from taichi_tracer.ray import real
from taichi_tracer.system import runtime
from taichi_tracer.system.compile_time import compile_time, element, variable
from taichi_tracer.system.errors import InputError, printable
from taichi_tracer.system.memory import Tables
from taichi_tracer.system.parts import PARTS, Spelled, replaced

COLORS = ("Kd", "Ka", "Ks", "Ke", "F0", "Km")
TEXTURES = ("map_Kd", "map_layer", "map_d", "map_Ks")  # the members of a material that are textures


class Unset(float):
    """A default that nobody has written: Ns of a material without this key."""


class WithParameters(Spelled):
    """A ``Material`` also takes the ``parameters`` of the registered BRDFs: ``Material(sigma=0.3)``."""

    def __call__(cls, *values: Any, **named: Any) -> Any:
        own = {one.lower() for brdf in PARTS.all("BRDF") for one in brdf.parameters} if named.keys() - FIELDS else ()
        extra = {name: value for name, value in named.items() if name not in FIELDS and name.lower() in own}
        rest = {name: value for name, value in named.items() if name not in extra}
        if extra:
            rest["extra"] = {**rest.get("extra", {}), **extra}
        return super().__call__(*values, **rest)


@dataclass(frozen=True, repr=False)
class Material(metaclass=WithParameters):
    """One material, as a Python object. Colours are linear RGB; values that are not set are the defaults of MTL.

    Attributes:
        name: the name in the file.
        Kd: reflectance of the diffuse or the Phong lobe (A2-4).
        Ka, Ks: ambient and specular colour. They are kept, but the two BRDFs of the course do not use them.
        Ke: emitted radiance.
        Ns: Phong exponent; a value of 1 or less means a diffuse material (C-4).
        Ni: index of refraction.
        d: opacity; 1 is opaque.
        alpha_x, alpha_y, F0: roughness and reflectance at normal incidence of a microfacet surface; they are
            extensions of the course. ``Material(alpha=0.3, F0=0.9)`` gives both axes one roughness, and all colours one
            reflectance. Where a material has both Ns and a roughness, Ns decides, except with the estimator
            ``microfacet``, see ``modelled``.
        Km: reflectance of the mirror in the sum of Blinn and Phong (RT-11); an extension.
        map_Kd, map_Ks: a ``textures.Texture`` by which Kd or Ks is multiplied; None is none.
        map_d: one whose texels are the opacity: all rays pass through triangles where its red is below 1/2.
        map_layer: one of which green is multiplied with the roughness √α, and blue with the metalness, as in glTF.
        extra: key in lower case → numbers, for every other key of the file. The ``parameters`` of a BRDF are looked up
            here: ``Material(sigma=0.3)`` is the same as ``Material(extra={"sigma": (0.3,)})``, if a BRDF that is
            registered has a parameter ``sigma``.
    """

    name: str = "default"
    Kd: tuple[float, float, float] = (0.8, 0.8, 0.8)
    Ka: tuple[float, float, float] = (0.0, 0.0, 0.0)
    Ks: tuple[float, float, float] = (0.0, 0.0, 0.0)
    Ke: tuple[float, float, float] = (0.0, 0.0, 0.0)
    Ns: float = Unset(1.0)
    Ni: float = 1.0
    d: float = 1.0
    alpha_x: float = 0.0
    alpha_y: float = 0.0
    F0: tuple[float, float, float] = (0.0, 0.0, 0.0)
    Km: tuple[float, float, float] = (0.0, 0.0, 0.0)
    map_Kd: Any = None
    map_layer: Any = None
    map_d: Any = None
    map_Ks: Any = None
    extra: dict[str, tuple[float, ...]] = field(default_factory=dict, hash=False)
    alpha: InitVar[float | None] = None

    def __post_init__(self, alpha: float | None) -> None:
        if alpha is not None:
            vars(self).update(alpha_x=float(alpha), alpha_y=float(alpha))
        if isinstance(self.F0, (int, float)):
            vars(self)["F0"] = (float(self.F0),) * 3
        extra = {key.lower(): tuple(np.ravel(value).tolist()) for key, value in self.extra.items()}
        vars(self)["extra"] = extra
        vars(self)["name"] = printable(str(self.name), keeps="")
        for name in COLORS:
            if not is_color(getattr(self, name)):
                raise InputError(f"Material: {name} must be three numbers, not {getattr(self, name)!r}")

    @property
    def textures(self) -> tuple:
        """Its textures."""
        return tuple(texture for texture in (getattr(self, name) for name in TEXTURES) if texture is not None)

    @property
    def has_holes(self) -> bool:
        """Whether rays pass through parts of its triangles. A lamp has no holes: samples of it would miss them."""
        return self.map_d is not None and max(self.Ke) <= 0

    def __repr__(self) -> str:
        usual, values = vars(Material()), vars(self)
        arguments = [f"{name}={value!r}" for name, value in values.items() if value != usual[name]]
        return f"Material({', '.join(arguments)})"

    @property
    def is_rough(self) -> bool:
        """Whether it has the roughness of a microfacet surface."""
        return self.alpha_x > 0 and self.alpha_y > 0

    @property
    def has_both_models(self) -> bool:
        """Whether it has both an Ns and a roughness, so that the estimator decides which of them counts."""
        return self.is_rough and not isinstance(self.Ns, Unset)

    def modelled(self, microfacets: bool) -> "Material":
        """The material as an estimator reads it: without the roughness, or without Ns, where it has both."""
        if not self.has_both_models:
            return self
        return replace(self, Ns=Material.Ns) if microfacets else replace(self, alpha_x=0.0, alpha_y=0.0)

    def value(self, name: str, default: float | tuple[float, ...]) -> float | tuple[float, ...]:
        """A parameter of a BRDF, from the file, or the default: one number or three numbers, like the default.

        Raises:
            InputError: the file has a different count of numbers.
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


FIELDS = {*Material.__dataclass_fields__}  # what ``Material`` takes without any BRDF of its own
# The members of a material that all kernels know: not the name, textures, and the keys that only some BRDFs read.
BUILT_IN: dict[str, Any] = {f.name: f.default for f in fields(Material) if f.name not in ("name", *TEXTURES, "extra")}


def is_color(value: Any) -> bool:
    """Whether a value is three numbers."""
    return hasattr(value, "__len__") and len(value) == 3 and all(isinstance(c, (int, float, np.number)) for c in value)


class Materials(list):
    """The ``Material`` of every id. In a kernel, ``materials[material_id]`` is the struct of its numbers."""

    library: "MaterialLibrary"

    def __repr__(self) -> str:
        lines = [f"  {i}: {material!r}" for i, material in enumerate(self)]
        return "\n".join([f"{len(self)} materials", *lines])

    def __getitem__(self, index):
        if isinstance(index, Expr):
            return self.library.get(index)
        return super().__getitem__(index)


@ti.func
def _within(number, count: ti.template()):
    return tm.clamp(number, 0, count - 1)


@ti.data_oriented
class MaterialLibrary:
    """The materials of one scene, found by material id.

    Args:
        materials: in the order of their ids.
        brdfs: the BRDFs that the scene knows. A material gets the last one of them that describes it.
        fields: the builder in which the fields of the library are placed.

    Attributes:
        brdf_of: for estimators that read Ns, and for ``microfacet``: the index in ``brdfs`` of each material's BRDF.
        brdf_ids: (M, 2) the same in kernels.
        members: name → default of each member that a material has in kernels: the MTL keys, and the parameters of
            ``brdfs``.
    """

    scene: Any = None  # what owns the fields, where ``load_materials`` has made them
    intersector: Any = None  # of the scene, which says what material was hit

    def __init__(self, materials: list[Material], brdfs: list, fields: ti.FieldsBuilder) -> None:
        self.materials, self.brdfs = Materials(materials), list(brdfs)
        self.materials.library = self
        self.members = dict(BUILT_IN)
        for brdf in self.brdfs:
            self.members |= brdf.parameters
        self._struct = ti.types.struct(**{n: tm.vec3 if np.size(d) == 3 else real for n, d in self.members.items()})
        self.brdf_of = [[self._brdf_of(m, microfacets) for m in self.materials] for microfacets in (False, True)]
        self.table, self.brdf_ids = ti.field(float), ti.field(ti.i32)
        rows = max(1, len(self.materials))
        fields.dense(ti.ij, (rows, 2)).place(self.brdf_ids)
        fields.dense(ti.ij, (rows, self.as_table([Material()]).shape[1])).place(self.table)

    @property
    def has_both_models(self) -> bool:
        """Whether a material has both an Ns and a roughness."""
        return any(material.has_both_models for material in self.materials)

    def reach_all(self, used: np.ndarray, microfacets: bool) -> bool:
        """Whether all BRDFs of the materials with the ids ``used`` have ``reaches_all``, and none was replaced."""
        of_used = {self.brdf_of[microfacets][i] for i in map(int, used)}
        return all(self.brdfs[i].reaches_all and not replaced(self.brdfs[i]) for i in of_used)

    def _brdf_of(self, material: Material, microfacets: bool) -> int:
        dtype, modelled = runtime.dtype(), material.modelled(microfacets)
        for i, brdf in reversed(list(enumerate(self.brdfs))):
            if brdf.describes(modelled, dtype) and (brdf.has_microfacets or modelled is material or not microfacets):
                return i
        raise InputError(f"material {material.name!r}: none of {', '.join(b.name for b in self.brdfs)} describes it")

    def as_table(self, materials: list[Material]) -> np.ndarray:
        """(M, n) float64: one row per material, with its numbers in the order of ``members``."""
        rows = [
            np.hstack([getattr(m, n) if n in BUILT_IN else m.value(n, default) for n, default in self.members.items()])
            for m in materials
        ]
        return np.array(rows, dtype=np.float64).reshape(len(rows), -1)

    def tables(self) -> Tables:
        """The arrays for the fields, which are to be copied after the fields were allocated."""
        tables = Tables()
        if len(self.materials) > 0:
            tables.put(self.table, self.as_table(self.materials))
            tables.put(self.brdf_ids, np.array(self.brdf_of, np.int32).T)
        return tables

    @compile_time
    def get(self, material_id):
        """The numbers of one material, as a struct. The compiler removes the reads of numbers that are not used."""
        values, column, material_id = {}, 0, self.row(material_id)
        for name, default in self.members.items():
            numbers = [element(self.table, material_id, column + k) for k in range(np.size(default))]
            values[name] = variable(tm.vec3(*numbers) if len(numbers) == 3 else numbers[0])
            column += len(numbers)
        return self._struct(**values)

    @compile_time
    def row(self, material_id):
        """The row of a material. Where a user's own intersector says which material was hit, it is one that exists."""
        if self.intersector is None or not replaced(self.intersector):
            return material_id
        return variable(_within(material_id, len(self.materials)))
