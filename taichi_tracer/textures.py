"""Pictures and colours on surfaces: at each point, the reflectance of the material is multiplied by a colour.

The colour is that of a texel at the texture coordinates of the point, times the one between the colours of vertices.

A texture coordinate (u, v) has its origin at the bottom left of the picture, which is one unit wide and high. Between
the centres of texels, colours are interpolated bilinearly.
"""

import hashlib
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
import taichi as ti
import taichi.math as tm

from taichi_tracer.brdfs.rough_layer import LAYER_F0
from taichi_tracer.materials import TEXTURES, Material
from taichi_tracer.system.errors import InputError, one_of
from taichi_tracer.system.memory import Tables

if TYPE_CHECKING:
    from taichi_tracer.geometry import Mesh

# What lies beyond the picture: it again, its edge, or its mirror image.
WRAPS = ("repeat", "clamp", "mirror")
# Keys of materials. METALLIC: the share of F0 that the texture colours, as it does for glTF's metals; for a material
# with ``map_layer``, its metalness. BASE: the base colour of such a material.
METALLIC, BASE = "metallic", "base"
HOLES = "map_d"
KINDS = len(TEXTURES)
LAYER, HOLE, GLOSS = (TEXTURES.index(name) for name in ("map_layer", HOLES, "map_Ks"))
FARTHEST = 2.0**20  # of a texture coordinate; farther out, f32 does not know its place in the picture
OF_SPHERE = np.array([[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]])


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
        fields: the builder in which the fields are placed.

    Attributes:
        texels: the colours of all textures, one row after the other, the top row first.
        places: (4M, 5) for each of ``TEXTURES`` of each material: the first of its texels (−1: there is none), the
            width and the height, and the places of both wraps in ``WRAPS``.
        metalness, bases: (M,) see ``METALLIC`` and ``BASE``.
        coordinates: (3P,) the texture coordinates of the three corners of each primitive. A sphere has those with which
            its longitude and latitude are (u, v).
        colors: (3P,) the colours of the same corners.
        hole_coordinates: (3T,) the texture coordinates of the corners of each triangle, if some have holes.
    """

    def __init__(self, mesh: "Mesh", fields: ti.FieldsBuilder) -> None:
        self._mesh = mesh
        self.has_instances = mesh.placed is not None
        self.instances: Any = None  # the ``Places`` of the scene, if objects stand in several places
        self.has_pictures, self.has_colors = mesh.has_pictures, mesh.corner_color is not None
        used = dict.fromkeys(texture for material in mesh.materials for texture in material.textures)
        self.has_layers = self.has_pictures and any(material.map_layer is not None for material in mesh.materials)
        self.has_gloss = self.has_pictures and any(material.map_Ks is not None for material in mesh.materials)
        sizes = [texture.pixels.shape[0] * texture.pixels.shape[1] for texture in used]
        self._first = dict(zip(used, np.cumsum([0, *sizes]).tolist(), strict=False))
        self.metalness = ti.Vector.field(3, float)
        per_material = fields.dense(ti.i, len(mesh.materials))
        per_material.place(self.metalness)
        if self.has_pictures:
            self.texels, self.coordinates = ti.Vector.field(3, float), ti.Vector.field(2, float)
            self.places = ti.field(ti.i32)
            fields.dense(ti.i, sum(sizes)).place(self.texels)
            fields.dense(ti.i, 3 * mesh.num_primitives).place(self.coordinates)
            fields.dense(ti.ij, (KINDS * len(mesh.materials), 5)).place(self.places)
        if mesh.has_holes:
            self.hole_coordinates = ti.Vector.field(2, float)
            fields.dense(ti.i, 3 * len(mesh.faces)).place(self.hole_coordinates)
        if self.has_layers:
            self.bases = ti.Vector.field(3, float)
            per_material.place(self.bases)
        if self.has_colors:
            self.colors = ti.Vector.field(3, float)
            fields.dense(ti.i, 3 * mesh.num_primitives).place(self.colors)

    def put(self, tables: Tables) -> None:
        """Give ``tables`` the arrays of the fields."""
        mesh, materials = self._mesh, self._mesh.materials
        tables.put(self.metalness, np.array([m.value(METALLIC, (0.0, 0.0, 0.0)) for m in materials]))
        if self.has_layers:
            tables.put(self.bases, np.array([m.value(BASE, (0.0, 0.0, 0.0)) for m in materials]))
        rows = mesh.primitives()
        is_triangle = rows >= 0
        if self.has_pictures:
            places = [self._place(m, name) for m in materials for name in TEXTURES]
            tables.put(self.places, np.array(places, np.int32))
            tables.put(self.texels, np.concatenate([one.pixels.reshape(-1, 3) for one in self._first]))
            of_triangles = np.clip(np.nan_to_num(np.asarray(mesh.corner_uv)), -FARTHEST, FARTHEST)
            coordinates = np.tile(OF_SPHERE, (len(rows), 1, 1))
            coordinates[is_triangle] = of_triangles[rows[is_triangle]]
            tables.put(self.coordinates, coordinates.reshape(-1, 2))
            if mesh.has_holes:
                tables.put(self.hole_coordinates, of_triangles.reshape(-1, 2))
        if self.has_colors:
            colors = np.ones((len(rows), 3, 3))
            colors[is_triangle] = np.asarray(mesh.corner_color)[rows[is_triangle]]
            tables.put(self.colors, colors.reshape(-1, 3))

    def _place(self, material: Material, name: str) -> list[int]:
        texture = getattr(material, name)
        if texture is None or (name == HOLES and not material.has_holes):
            return [-1, 1, 1, 0, 0]
        height, width = texture.pixels.shape[:2]
        return [self._first[texture], width, height, *map(WRAPS.index, texture.wrap)]

    @ti.func
    def between(self, of_corners: ti.template(), hit):
        """The mean of what the three corners of a hit have, weighted by the barycentric coordinates."""
        number = hit.triangle_id
        if ti.static(self.has_instances):
            number = self.instances.number(hit.triangle_id)
        return weighted(of_corners, number, hit.barycentric_coords.x, hit.barycentric_coords.y)

    @ti.func
    def color(self, hit):
        """The colour of the texture at a hit, times that of the triangle; each is 1 where there is none."""
        color = tm.vec3(1)
        if ti.static(self.has_colors):
            color = self.between(self.colors, hit)
        if ti.static(self.has_pictures):
            color *= self.of_kind(0, hit)
        return color

    @ti.func
    def of_kind(self, kind: ti.template(), hit):
        """The colour of one of ``TEXTURES`` at a hit; 1 where its material has none."""
        color, row = tm.vec3(1), KINDS * hit.material_id + kind
        if self.places[row, 0] >= 0:
            color = self.bilinear(row, self.coordinates_at(hit))
        return color

    @ti.func
    def is_hole(self, material_id, triangle_id, u, v):
        """Whether rays pass through a point of a triangle."""
        found, row = False, KINDS * material_id + HOLE
        if self.places[row, 0] >= 0:
            found = self.bilinear(row, weighted(self.hole_coordinates, triangle_id, u, v)).x < 0.5
        return found

    @ti.func
    def coordinates_at(self, hit):
        """(u, v) of a hit; 0 where no surface has a picture."""
        uv = tm.vec2(0)
        if ti.static(self.has_pictures):
            uv = self.between(self.coordinates, hit)
        return uv

    @ti.func
    def bilinear(self, row, uv):
        """The weighted mean of the four texels around a point; ``row`` is that of the texture in ``places``."""
        width, height = self.places[row, 1], self.places[row, 2]
        x = inside(uv.x, self.places[row, 3]) * width - 0.5
        y = (1 - inside(uv.y, self.places[row, 4])) * height - 0.5
        i, j = ti.floor(x), ti.floor(y)
        total = tm.vec3(0)
        for di, dj in ti.static(ti.ndrange(2, 2)):
            weight = (1 - abs(x - (i + di))) * (1 - abs(y - (j + dj)))
            total += weight * self.texel(row, ti.cast(i, ti.i32) + di, ti.cast(j, ti.i32) + dj)
        return total

    @ti.func
    def texel(self, row, i, j):
        """The texel in column i and line j, either of which may be one beyond the edge."""
        width, height = self.places[row, 1], self.places[row, 2]
        column = neighbour(i, width, self.places[row, 3])
        line = neighbour(j, height, self.places[row, 4])
        return self.texels[self.places[row, 0] + line * width + column]


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
    if ti.static(textures.has_gloss):
        found.Ks *= textures.of_kind(GLOSS, hit)
    if ti.static(textures.has_layers):
        if textures.places[KINDS * hit.material_id + LAYER, 0] >= 0:
            layer = textures.of_kind(LAYER, hit)  # factors: of the roughness in green, of the metalness in blue
            base = textures.bases[hit.material_id] * color
            metal = metalness.x * layer.z
            found.Kd, found.F0 = (1 - metal) * base, (1 - metal) * LAYER_F0 + metal * base
            found.alpha_x, found.alpha_y = material.alpha_x * layer.y**2, material.alpha_y * layer.y**2
    return found
