"""The world of an RT3 document while it is read: the current transform, the current material, the objects so far.

``Contents`` is what stands in the world, or between ``object_instance_begin`` and ``_end`` (RT-12).
"""

from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np

from taichi_tracer.brdfs.microfacet import LAYERED
from taichi_tracer.formulas.vertex_normals import area_weighted
from taichi_tracer.geometry import Mesh
from taichi_tracer.instances import Instances, resolve_instances
from taichi_tracer.lights.base import Light
from taichi_tracer.lights.delta_lights import AmbientLight, DirectionalLight, PointLight, SpotLight
from taichi_tracer.materials import Material
from taichi_tracer.meshes.parts import joined, moved, reverse, similarities
from taichi_tracer.rt3.elements import FLAGS, LONGEST_SHOWN, Element
from taichi_tracer.system.errors import InputError

# ── contents ──


@dataclass
class Contents:
    """The objects of the world, or those of an instance, which is called in several places.

    Attributes:
        name: of the instance, or of the document. where: the line in which it began.
        parts: triangles and spheres, moved into their places.
        calls: meshes of instances, each with the (4, 4) transform of its place.
    """

    name: str
    where: str = ""
    parts: list[Mesh] = field(default_factory=list)
    calls: list[tuple[Mesh, np.ndarray]] = field(default_factory=list)

    def mesh(self, materials: list[Material]) -> Mesh:
        """Everything as one mesh; what is called several times is one mesh in several places.

        Args:
            materials: of the document.
        """
        whole = joined(self.parts, materials, self.name)
        places: dict[int, tuple[Mesh, list[np.ndarray]]] = {}
        for called, matrix in self.calls:
            places.setdefault(id(called), (called, []))[1].append(matrix)
        whole.instances = [Instances(called, np.array(matrices)) for called, matrices in places.values()]
        return whole


# ── lights (RT-10) ──


KINDS = {"ambient": "ambient", "directional": "directional", "distant": "directional", "point": "point", "spot": "spot"}
EVEN = np.array([1.0, 0.0, 0.0])  # Kc, Kl, Kq of a light that does not say them: it does not fall off
CUTOFF, FALLOFF = 30.0, 15.0


def read_light(element: Element, ctm: np.ndarray) -> Light:
    """The light that an element describes.

    Args:
        ctm: (4, 4), the transform for ``from`` and ``to``.

    Raises:
        InputError: with file and line.
    """
    kind, color = element.choice("type", of=KINDS), _color(element)
    try:
        if kind == "ambient":
            return AmbientLight(color)
        start = _place(element, ctm, "from")
        if kind == "directional":
            return DirectionalLight((_place(element, ctm, "to") if element.find("to") else ctm[:3, 3]) - start, color)
        attenuation = element.numbers("attenuation", default=EVEN)
        if kind == "point":
            return PointLight(start, color, attenuation)
        end = _place(element, ctm, "to")
        cutoff = element.number("cutoff", default=CUTOFF)
        falloff = element.number("falloff", default=min(FALLOFF, cutoff))
        return SpotLight(start, end, color, cutoff, falloff, attenuation)
    except InputError as error:
        text = str(error)
        raise (error if text.startswith(element.where) else element.error(text)) from None


def _color(element: Element) -> np.ndarray:
    """L or I, times ``scale``."""
    color = np.resize(element.numbers(element.need("L", "I"), count=(1, 3)), 3)
    scale = np.resize(element.numbers("scale", count=(1, 3), default=np.ones(1)), 3)
    if (color < 0).any() or (scale < 0).any():
        raise element.error("L, I and scale must not be negative")
    return color * scale


def _place(element: Element, ctm: np.ndarray, name: str) -> np.ndarray:
    return ctm[:3, :3] @ element.numbers(element.need(name)) + ctm[:3, 3]


# ── the world ──


MATERIALS = {"flat": "flat", "matte": "matte", "diffuse": "matte", "blinn": "phong", "blinn_phong": "phong"}
MATERIALS |= {"phong": "phong", "microfacet": "microfacet"}
OBJECTS = {"trianglemesh": "trianglemesh", "triangle_mesh": "trianglemesh", "mesh": "trianglemesh", "sphere": "sphere"}
MTL_COLORS, MTL_NUMBERS = ("Kd", "Ka", "Ks", "Ke", "F0", "Km"), ("Ns", "Ni", "d", "alpha_x", "alpha_y")


class World:
    """The objects in the order of the document; their ids have the same order, and those of instances follow.

    Args:
        path: the document in which the world began, for messages.
    """

    def __init__(self, path: Path) -> None:
        self.ctm = np.eye(4)  # the current transform
        self.material: Material | None = None  # the current one; with None, an object has its own
        self.saved: list[tuple[str, np.ndarray, Material | None]] = []
        self.named_transforms: dict[str, np.ndarray] = {}
        self.named_materials: dict[str, Material] = {}
        self.material_ids: dict[Material, int] = {}  # in the order of first use
        self.files: dict[Path, Mesh] = {}
        self.contents = Contents(str(path))  # of the world
        self.current = self.contents  # of the world, or of the instance that is being defined
        self.instances: dict[str, Mesh] = {}
        self.before = self.ctm, self.material  # the instance that is being defined
        self.lights: list[Light] = []
        self.notes: list[str] = []

    # --- transforms ---------------------------------------------------------------------------------------------------

    def transform(self, element: Element) -> None:
        """translate, scale, rotate, matrix: CTM ← CTM · M, so that the new transform is applied to an object first."""
        matrix, kind = np.eye(4), element.tag
        if kind == "translate":
            matrix[:3, 3] = element.numbers(element.need("value"), count=3)
        elif kind == "scale":
            factors = np.resize(element.numbers(element.need("value"), count=(1, 3)), 3)
            if (factors == 0).any():
                raise element.wrong("value", "numbers other than 0, which would flatten everything")
            matrix[:3, :3] = np.diag(factors)
        elif kind == "rotate":
            angle, axis = element.number(element.need("angle")), element.numbers(element.need("axis"), count=3)
            length = np.linalg.norm(axis)
            if not 0 < length < np.inf:
                raise element.wrong("axis", "a direction")
            matrix[:3, :3] = rotation(np.radians(angle), axis / length)
        elif kind == "matrix":
            matrix[:3] = element.numbers(element.need("value"), count=12).reshape(3, 4)
            if np.linalg.det(matrix[:3, :3]) == 0:
                raise element.wrong("value", "a matrix that does not flatten everything")
        self.ctm = np.eye(4) if kind == "identity" else self.ctm @ matrix

    def push(self, element: Element) -> None:
        """push_CTM saves the transform; push_GS the transform and the material."""
        self.saved.append((element.tag.removeprefix("push_"), self.ctm, self.material))

    def pop(self, element: Element) -> None:
        """Restore what the matching push saved."""
        what = element.tag.removeprefix("pop_")
        if not self.saved or self.saved[-1][0] != what:
            last = f"the last push was push_{self.saved[-1][0]}" if self.saved else "nothing is pushed"
            raise element.error(f"has no push_{what} before it: {last}")
        _, self.ctm, material = self.saved.pop()
        if what == "GS":
            self.material = material

    def save_transform(self, element: Element) -> None:
        """Save the transform under a name."""
        self.named_transforms[element.text(element.need("name"))] = self.ctm

    def restore_transform(self, element: Element) -> None:
        """Restore the transform that was saved under a name."""
        self.ctm = element.choice("name", of=self.named_transforms)

    # --- materials ----------------------------------------------------------------------------------------------------

    def make_named_material(self, element: Element) -> None:
        """Save a material under a name."""
        name = element.text(element.need("name"))
        self.named_materials[name] = read_material(element, name)

    def use_material(self, element: Element) -> None:
        """Make a material the current one."""
        self.material = read_material(element, f"material_{element.where.rsplit(':')[-1]}")

    def use_named_material(self, element: Element) -> None:
        """Make a named material the current one."""
        self.material = element.choice("name", of=self.named_materials)

    def _material_of(self, element: Element) -> Material | None:
        if element.find("material") is None:
            return self.material
        return element.choice("material", of=self.named_materials)

    def _id_of(self, material: Material) -> int:
        return self.material_ids.setdefault(material, len(self.material_ids))

    # --- objects ------------------------------------------------------------------------------------------------------

    def add_object(self, element: Element) -> None:
        """Add a sphere or a triangle mesh, transformed by the current transform."""
        kind = element.choice("type", of=OBJECTS)
        if kind == "sphere":
            self._add_sphere(element)
            return
        mesh = self._mesh_of_file(element) if element.find("filename") else inline_mesh(element)
        if element.choice("reverse_vertex_order", of=FLAGS, default=False):
            reverse(mesh)
        if element.choice("compute_normals", of=FLAGS, default=False):
            mesh.normals = area_weighted(mesh.vertices, mesh.faces)
            mesh.face_normals = mesh.faces.astype(np.int32)
        if element.choice("backface_cull", of=FLAGS, default=False):
            mesh.face_culls = np.ones(len(mesh.faces), bool)
        mesh = moved(mesh, self.ctm)
        material = self._material_of(element)
        if material is None:
            ids = np.array([self._id_of(m) for m in mesh.materials], np.int32)
            mesh.face_materials = ids[mesh.face_materials]
        else:
            mesh.face_materials = np.full(len(mesh.faces), self._id_of(material), np.int32)
        self.current.parts.append(mesh)

    def _mesh_of_file(self, element: Element) -> Mesh:
        from taichi_tracer.files import read

        path = element.path("filename")
        if path not in self.files:
            self.files[path] = resolve_instances(read(path), choice="copied")
            self.notes += self.files[path].notes
        return replace(self.files[path])

    def _add_sphere(self, element: Element) -> None:
        radius = element.number(element.need("radius"), above=0.0)
        centre = element.numbers("center", "centre", "origin", default=np.zeros(3))
        material = self._material_of(element)
        sphere = Mesh(
            vertices=np.zeros((0, 3)),
            faces=np.zeros((0, 3), np.int32),
            spheres=np.array([[*centre, radius]]),
            sphere_ids=np.zeros(1, np.int32),
            sphere_materials=np.array([self._id_of(Material() if material is None else material)], np.int32),
        )
        ctm = self.ctm
        if np.isnan(similarities(ctm[None, :3, :3])[0]):  # an ellipsoid, which is a sphere in a place of its own
            self.current.calls.append((replace(sphere, source="sphere", materials=list(self.material_ids)), ctm))
        else:
            self.current.parts.append(moved(sphere, ctm))

    # --- instances ----------------------------------------------------------------------------------------------------

    def begin_instance(self, element: Element) -> None:
        """The following objects belong to an instance: they appear where it is called."""
        name = element.text(element.need("name"))
        if self.current is not self.contents:
            raise element.error(f"stands in the instance {self.current.name!r}, which began at {self.current.where}")
        if name in self.instances:
            raise element.error(f"name: {name[:LONGEST_SHOWN]!r} is defined already")
        self.current, self.before = Contents(name, element.where), (self.ctm, self.material)

    def end_instance(self, element: Element) -> None:
        """The instance is complete; the transform and the material are those from before it."""
        if self.current is self.contents:
            raise element.error("has no object_instance_begin before it")
        self.instances[self.current.name] = self.current.mesh(list(self.material_ids))
        self.current, (self.ctm, self.material) = self.contents, self.before

    def call_instance(self, element: Element) -> None:
        """Put an instance into the current transform, which is applied after those within it."""
        self.current.calls.append((element.choice("name", of=self.instances), self.ctm))

    def add_light(self, element: Element) -> None:
        """Add a light, at its place in the current transform."""
        if self.current is not self.contents:
            raise element.error(f"stands in the instance {self.current.name!r}, and an instance has no lights")
        self.lights.append(read_light(element, self.ctm))


def read_material(element: Element, name: str) -> Material:
    """A material of RT3. As an extension, it may have values of MTL files under their names; they are not converted."""
    kind = element.choice("type", of=MATERIALS, default="matte")
    base = "color" if kind == "flat" else "diffuse"
    colors = element.colors("color", "diffuse", "ambient", "specular", "mirror")
    element.find("color", "diffuse")  # which mean the same
    keys = {base: "Kd", "color": "Kd", "diffuse": "Kd", "ambient": "Ka", "specular": "Ks", "mirror": "Km"}
    values: dict = {key: colors[attribute] for attribute, key in keys.items() if attribute in colors}
    if kind == "phong":
        values["Ns"] = element.number("glossiness", "exponent", default=1.0)
    if kind == "microfacet":
        values |= dict.fromkeys(("alpha_x", "alpha_y"), element.number("alpha", default=0.0))
        values["F0"] = values.get("Ks", values.get("Kd", Material.F0))
    values |= {key: tuple(of.tolist()) for key in MTL_COLORS if (of := element.numbers(key)) is not None}
    values |= {key: of for key in MTL_NUMBERS if (of := element.number(key)) is not None}
    if kind == "microfacet":
        values.pop("Ns", None)  # the type decides
        if not (values["alpha_x"] > 0 and values["alpha_y"] > 0):
            raise element.error("a microfacet material needs alpha, or alpha_x and alpha_y, above 0")
    if min(values.get("Kd", (0,))) < 0 or min(values.get("Ke", (0,))) < 0:
        raise element.error("Kd and Ke must not be negative")
    if element.number(LAYERED) == 1:
        values["extra"] = {LAYERED: (1.0,)}
    return Material(name=name, **values)


def inline_mesh(element: Element) -> Mesh:
    """A mesh whose lists are in the document. ``normals`` have the indices of the vertices, or ``normal_indices``."""
    vertices = element.table(element.need("vertices"), 3)
    indices = element.table(element.need("indices"), 3, np.int64)
    check_indices(element, "indices", indices, len(vertices), 0)
    element.find("ntriangles")  # how many there are, the indices say
    element.find("uv")  # RT3 has no textures
    mesh = Mesh(vertices=vertices, faces=indices)
    normals, normal_indices = element.table("normals", 3), element.table("normal_indices", 3, np.int64)
    if normals is not None:
        ids = indices if normal_indices is None else normal_indices
        if len(ids) != len(indices):
            raise element.error(f"normal_indices has {len(ids)} triangles, indices {len(indices)}")
        check_indices(element, "normal_indices", ids, len(normals), -1)
        mesh.normals, mesh.face_normals = normals, ids.astype(np.int32)
    return mesh


def check_indices(element: Element, name: str, ids: np.ndarray, count: int, least: int) -> None:
    """Raise an InputError that names the first triangle with an index out of range."""
    wrong = np.argwhere((ids < least) | (ids >= count))
    if len(wrong) > 0:
        triangle, corner = wrong[0]
        raise element.error(
            f"{name}: triangle {triangle} has index {ids[triangle, corner]}, which is out of range "
            f"(there are {count}, counted from 0)"
        )


def rotation(angle: float, axis: np.ndarray) -> np.ndarray:
    """(3, 3) rotation about a unit axis, counter-clockwise when seen from the tip of the axis (Rodrigues)."""
    x, y, z = axis
    cross = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    return np.eye(3) + np.sin(angle) * cross + (1 - np.cos(angle)) * (cross @ cross)
