"""What a surface is made of: the values of Wavefront MTL files (A1-17), and pictures and colours on surfaces.

At each point, the reflectance of the material is multiplied by a colour: that of a texel at the texture coordinates of
the point, times the one between the colours of vertices. A texture coordinate (u, v) has its origin at the bottom left
of the picture, which is one unit wide and high. Between the centres of texels, colours are interpolated bilinearly.
"""

import hashlib
from collections.abc import Sequence
from dataclasses import InitVar, dataclass, field, fields, replace
from typing import TYPE_CHECKING, Any

import numpy as np
import taichi as ti
from taichi.lang.expr import Expr

from taichi_tracer.brdfs.rough_layer import LAYER_F0
from taichi_tracer.formulas import vector_math as tm
from taichi_tracer.ray import real
from taichi_tracer.system import runtime
from taichi_tracer.system.compile_time import compile_time, element, variable
from taichi_tracer.system.errors import InputError, one_of, printable
from taichi_tracer.system.memory import filled
from taichi_tracer.system.parts import PARTS, Spelled, replaced

if TYPE_CHECKING:
    from taichi_tracer.geometry import Geometry, Mesh

# ── materials ──


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
        map_Kd, map_Ks: a ``Texture`` by which Kd or Ks is multiplied; None is none.
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
        vars(self)["extra"] = {key.lower(): tuple(np.ravel(value).tolist()) for key, value in self.extra.items()}
        vars(self)["name"] = printable(str(self.name), keeps="")
        for name, default in BUILT_IN.items():
            value, what = getattr(self, name), "three finite numbers" if name in COLORS else "a finite number"
            is_number = np.shape(value) == np.shape(default) and np.asarray(value).dtype.kind in "iuf"
            if not (is_number and np.isfinite(value).all()):
                raise InputError(f"Material: {name} must be {what}, not {value!r}")
            vars(self)[name] = tuple(np.asarray(value).tolist()) if name in COLORS else value

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


class Materials(tuple):
    """The ``Material`` of every id. In a kernel, ``materials[material_id]`` is the struct of its numbers."""

    library: "MaterialLibrary"

    def __repr__(self) -> str:
        return "\n".join([f"{len(self)} materials", *(f"  {i}: {one!r}" for i, one in enumerate(self))])

    def __getitem__(self, index):
        if isinstance(index, Expr):
            return self.library.get(index)
        return super().__getitem__(index)


@ti.data_oriented
class MaterialLibrary:
    """The materials of one scene, found by material id.

    Args:
        materials: in the order of their ids.
        brdfs: the BRDFs that the scene knows. A material gets the last one of them that describes it.

    Attributes:
        brdf_of: for estimators that read Ns, and for ``microfacet``: the index in ``brdfs`` of each material's BRDF.
        brdf_ids: (M, 2) the same in kernels.
        members: name → default of each member that a material has in kernels: the MTL keys, and the parameters of
            ``brdfs``.
    """

    intersector: Any = None  # of the scene, which says what material was hit

    def __init__(self, materials: list[Material], brdfs: Sequence) -> None:
        self.materials, self.brdfs = Materials(materials), list(brdfs)
        self.materials.library = self
        self.members = dict(BUILT_IN)
        for brdf in self.brdfs:
            self.members |= brdf.parameters
        self._struct = ti.types.struct(**{n: tm.vec3 if np.size(d) == 3 else real for n, d in self.members.items()})
        self.brdf_of = [[self._brdf_of(m, microfacets) for m in self.materials] for microfacets in (False, True)]
        table = self.as_table(self.materials or [Material()])
        self.memory, (self.table, self.brdf_ids) = filled(table, np.array(self.brdf_of, np.int32).T, indices=2)

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

    def as_table(self, materials: Sequence[Material]) -> np.ndarray:
        """(M, n) float64: one row per material, with its numbers in the order of ``members``."""
        rows = [
            np.hstack([getattr(m, n) if n in BUILT_IN else m.value(n, default) for n, default in self.members.items()])
            for m in materials
        ]
        return np.array(rows, dtype=np.float64).reshape(len(rows), -1)

    @compile_time
    def get(self, material_id):
        """The numbers of one material, as a struct. The compiler removes the reads of numbers that are not used."""
        return self._struct(**{name: self.value(material_id, name) for name in self.members})

    @compile_time
    def value(self, material_id, name):
        """One number, or one colour, of a material."""
        names, sizes = list(self.members), [np.size(default) for default in self.members.values()]
        row, first = self.row(material_id), sum(sizes[: names.index(name)])
        numbers = [element(self.table, row, k) for k in range(first, first + np.size(self.members[name]))]
        return variable(tm.vec3(*numbers) if len(numbers) == 3 else numbers[0])

    @compile_time
    def row(self, material_id):
        """The row of a material. Where a user's own intersector says which material was hit, it is one that exists."""
        if self.intersector is None or not replaced(self.intersector):
            return material_id
        return variable(ti.min(ti.max(material_id, 0), len(self.materials) - 1))


# ── textures ──


# What lies beyond the picture: it again, its edge, or its mirror image.
WRAPS = ("repeat", "clamp", "mirror")
# Keys of materials. METALLIC: the share of F0 that the texture colours, as it does for glTF's metals; for a material
# with ``map_layer``, its metalness. BASE: the base colour of such a material.
METALLIC, BASE = "metallic", "base"
HOLES = "map_d"
KINDS = len(TEXTURES)
LAYER, HOLE, GLOSS = (TEXTURES.index(name) for name in ("map_layer", HOLES, "map_Ks"))
FARTHEST = 2.0**20  # of a texture coordinate; farther out, f32 does not know its place in the picture


@dataclass(frozen=True, eq=False)
class Texture:
    """A picture for a material.

    Attributes:
        pixels: (h, w, 3) linear colours, top row first.
        wrap: what lies beyond the picture, in u and in v: "repeat", "clamp" or "mirror".
        source: where it comes from, for messages.
    """

    pixels: np.ndarray
    wrap: tuple[str, str] = ("repeat", "repeat")
    source: str = "array"

    def __post_init__(self) -> None:
        shape = np.shape(self.pixels)
        if len(shape) != 3 or shape[2] != 3 or 0 in shape:
            raise InputError(f"texture: pixels must have the shape (height, width, 3), not {shape}")
        for wrap in self.wrap:
            if wrap not in WRAPS:
                raise one_of("wrap of a texture", wrap, WRAPS)

    def __repr__(self) -> str:
        """With a hash of the texels, so that fingerprints of scenes tell two pictures apart."""
        height, width = self.pixels.shape[:2]
        texels = hashlib.sha256(np.ascontiguousarray(self.pixels, np.float32).tobytes()).hexdigest()[:16]
        return f"Texture({width} x {height}, {' '.join(self.wrap)}, {texels})"


@ti.data_oriented
class Textures:
    """The textures of the materials of one scene.

    Args:
        mesh: with ``corner_uv``; its materials have the textures.
        geometry: of the same mesh.

    Attributes:
        texels: the colours of all textures, one row after the other, the top row first.
        places: (4M,) vec5, for each of ``TEXTURES`` of each material: the first of its texels (−1: there is none), the
            width and the height, and the places of both wraps in ``WRAPS``.
        kinds: those of ``TEXTURES`` that a material has.
        metalness, bases: (M,) see ``METALLIC`` and ``BASE``.
        coordinates: (3T,) the texture coordinates of the three corners of each triangle. Those of a sphere are its
            longitude and latitude.
        colors: (3T,) the colours of the same corners.
        memories: of the fields.
    """

    def __init__(self, mesh: "Mesh", geometry: "Geometry") -> None:
        materials, dtype = mesh.materials, runtime.dtype()
        self.geometry, self.has_pictures, self.has_colors = geometry, mesh.has_pictures, mesh.corner_color is not None
        self.kinds = {
            name for m in materials for name in TEXTURES if self.has_pictures and getattr(m, name) is not None
        }
        values = (np.array([m.value(name, (0.0, 0.0, 0.0)) for m in materials]) for name in (METALLIC, BASE))
        memory, (self.metalness, self.bases) = filled(*values)
        self.memories = [memory]
        if self.has_pictures:
            used = dict.fromkeys(texture for material in materials for texture in material.textures)
            texels = [texture.pixels.reshape(-1, 3) for texture in used]
            first = dict(zip(used, np.cumsum([0, *map(len, texels)]).tolist(), strict=False))
            places = np.array([place_of(m, name, first) for m in materials for name in TEXTURES], np.int32)
            coordinates = np.clip(np.nan_to_num(np.asarray(mesh.corner_uv, dtype)), -FARTHEST, FARTHEST)
            memory, fields = filled(np.concatenate(texels).astype(dtype), coordinates.reshape(-1, 2), places)
            self.texels, self.coordinates, self.places = fields
            self.memories.append(memory)
        if self.has_colors:
            memory, (self.colors,) = filled(np.asarray(mesh.corner_color, dtype).reshape(-1, 3))
            self.memories.append(memory)

    @ti.func
    def between(self, of_corners: ti.template(), hit, of_sphere):
        """The mean of what the three corners of a hit have, weighted by the barycentric coordinates."""
        number, value = self.geometry.number(hit.triangle_id), of_sphere
        if ti.static(self.geometry.effects.spheres):
            number = self.geometry.primitives[number]
        if number >= 0:
            value = weighted(of_corners, number, hit.barycentric_coords.x, hit.barycentric_coords.y)
        return value

    @ti.func
    def color(self, hit):
        """The colour of the texture at a hit, times that of the triangle; each is 1 where there is none."""
        color = tm.vec3(1)
        if ti.static(self.has_colors):
            color = self.between(self.colors, hit, tm.vec3(1))
        if ti.static(self.has_pictures):
            color *= self.of_kind(0, hit)
        return color

    @ti.func
    def of_kind(self, kind: ti.template(), hit):
        """The colour of one of ``TEXTURES`` at a hit; 1 where its material has none."""
        color, row = tm.vec3(1), KINDS * hit.material_id + kind
        if self.places[row][0] >= 0:
            color = self.bilinear(self.places[row], self.coordinates_at(hit))
        return color

    @ti.func
    def is_hole(self, material_id, triangle_id, u, v):
        """Whether rays pass through a point of a triangle."""
        found, row = False, KINDS * material_id + HOLE
        if self.places[row][0] >= 0:
            found = self.bilinear(self.places[row], weighted(self.coordinates, triangle_id, u, v)).x < 0.5
        return found

    @ti.func
    def coordinates_at(self, hit):
        """(u, v) of a hit; 0 where no surface has a picture."""
        if ti.static(self.has_pictures):
            return self.between(self.coordinates, hit, hit.barycentric_coords)
        return tm.vec2(0)

    @ti.func
    def bilinear(self, place, uv):
        """The weighted mean of the four texels around a point; ``place`` is the texture's of ``places``."""
        width, height = place[1], place[2]
        x = inside(uv.x, place[3]) * width - 0.5
        y = (1 - inside(uv.y, place[4])) * height - 0.5
        i, j = ti.floor(x), ti.floor(y)
        total = tm.vec3(0)
        for di, dj in ti.static(ti.ndrange(2, 2)):
            weight = (1 - abs(x - (i + di))) * (1 - abs(y - (j + dj)))
            total += weight * self.texel(place, ti.cast(i, ti.i32) + di, ti.cast(j, ti.i32) + dj)
        return total

    @ti.func
    def texel(self, place, i, j):
        """The texel in column i and line j, either of which may be one beyond the edge."""
        column, line = neighbour(i, place[1], place[3]), neighbour(j, place[2], place[4])
        return self.texels[place[0] + line * place[1] + column]


def place_of(material: Material, name: str, first: dict[Texture, int]) -> list[int]:
    """One of ``Textures.places``; ``first`` has the number of the first texel of each texture."""
    texture = getattr(material, name)
    if texture is None or (name == HOLES and not material.has_holes):
        return [-1, 1, 1, 0, 0]
    height, width = texture.pixels.shape[:2]
    return [first[texture], width, height, *map(WRAPS.index, texture.wrap)]


@ti.func
def weighted(of_corners: ti.template(), triangle_id, u, v):
    """The mean of what the three corners of a triangle have, weighted by 1 − u − v, u and v."""
    corner = 3 * triangle_id
    return (1 - u - v) * of_corners[corner] + u * of_corners[corner + 1] + v * of_corners[corner + 2]


@ti.func
def inside(u, wrap):
    """A coordinate of the same colour in [0, 1]."""
    t = u - ti.floor(u)
    if wrap == 1:
        t = ti.min(ti.max(u, 0.0), 1.0)
    elif wrap == 2:
        t = 1 - abs(u - 2 * ti.floor(u / 2) - 1)
    return t


@ti.func
def neighbour(i, count, wrap):
    """The number of a texel in its row, which is certainly one of 0 … count − 1."""
    at = i
    if wrap == 0:
        at = ti.select(i < 0, i + count, ti.select(i >= count, i - count, i))
    return ti.min(ti.max(at, 0), count - 1)


@ti.func
def textured(material, textures: ti.template(), hit):
    """The ``material`` of a hit with the colour of its texture."""
    found = material
    color = textures.color(hit)
    metalness = textures.metalness[hit.material_id]
    found.Kd *= color
    found.F0 *= 1 + metalness * (color - 1)
    if ti.static("map_Ks" in textures.kinds):
        found.Ks *= textures.of_kind(GLOSS, hit)
    if ti.static("map_layer" in textures.kinds):
        if textures.places[KINDS * hit.material_id + LAYER][0] >= 0:
            layer = textures.of_kind(LAYER, hit)  # factors: of the roughness in green, of the metalness in blue
            base = textures.bases[hit.material_id] * color
            metal = metalness.x * layer.z
            found.Kd, found.F0 = (1 - metal) * base, (1 - metal) * LAYER_F0 + metal * base
            found.alpha_x, found.alpha_y = material.alpha_x * layer.y**2, material.alpha_y * layer.y**2
    return found
