"""Triangles and spheres: as numpy arrays (``Mesh``, the content of a file) and as Taichi fields (``Geometry``)."""

from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
import taichi as ti

from taichi_tracer.formulas import vector_math as tm
from taichi_tracer.formulas.triangles import thinness_of, unit_normals
from taichi_tracer.formulas.vertex_normals import USUAL_CREASE, smooth_normals
from taichi_tracer.formulas.view import box_of
from taichi_tracer.materials import Material
from taichi_tracer.system import runtime
from taichi_tracer.system.errors import InputError
from taichi_tracer.system.memory import filled, varying

TINY, HUGE = 1e-18, 1e18  # the size of a mesh within which the squares of its lengths are numbers of f32
COARSE = 1e-5  # of the mesh's size: the largest step of its coordinates without a note
AT_ONCE = 1 << 14  # triangles whose corners are in memory in float64 at the same time


@dataclass(repr=False)
class Mesh:
    """Indexed triangles with materials, and spheres, in numpy arrays. Ids count from 0; −1 means none (C-16).

    Triangles and spheres are primitives, and they are numbered together, in the order of the file. Without spheres, the
    number of a triangle is its row in ``faces``. With spheres, ``sphere_ids`` has the numbers of the spheres, and the
    triangles have the other numbers.

    Attributes:
        vertices: (V, 3) float64 positions.
        faces: (F, 3) int32 vertex ids, counter-clockwise when seen from the front.
        normals: (N, 3) float64 vertex normals, not necessarily of unit length; (0, 3) if there are none.
        face_normals: (F, 3) int32 ids into ``normals`` for each corner, −1 for a corner without a normal; (0, 3) int32
            if there are no vertex normals at all.
        face_materials: (F,) int32 ids into ``materials``.
        materials: the materials in the order of their first use.
        source: the origin of the mesh, for messages, such as the path of the file.
        notes: what the user should know, such as how many triangles were dropped; one line each.
        dropped: the number of primitives that no ray can hit; ``clean`` sets it.
        spheres: (S, 4) float64 centre and radius.
        sphere_ids: (S,) int32, the number of each sphere among all primitives, in ascending order; if it is left out,
            the spheres follow the triangles.
        sphere_materials: (S,) int32 ids into ``materials``; 0 if it is left out.
        face_culls: (F,) bool, whether rays pass through the back of a triangle; None if they pass through no back.
        corner_uv: (F, 3, 2) float64 texture coordinates of the corners, from the bottom left; None if there are none.
        corner_color: (F, 3, 3) linear colours of the corners, by which Kd is multiplied; None if there are none.
        lights: (name, arguments) of the lights that stand in the file.
        instances: other meshes that stand in several places, see ``instances.resolve_instances``.
        placed: where parts of the mesh stand, see ``instances.Placed``; None if all of it stands where it is.
    """

    vertices: np.ndarray
    faces: np.ndarray
    normals: np.ndarray = field(default_factory=lambda: np.zeros((0, 3)))
    face_normals: np.ndarray = field(default_factory=lambda: np.zeros((0, 3), np.int32))
    face_materials: np.ndarray | None = None
    materials: list[Material] = field(default_factory=lambda: [Material()])
    source: str = "mesh"
    notes: list[str] = field(default_factory=list)
    dropped: int = 0
    spheres: np.ndarray = field(default_factory=lambda: np.zeros((0, 4)))
    sphere_ids: np.ndarray = field(default_factory=lambda: np.zeros(0, np.int32))
    sphere_materials: np.ndarray = field(default_factory=lambda: np.zeros(0, np.int32))
    face_culls: np.ndarray | None = None
    corner_uv: np.ndarray | None = None
    corner_color: np.ndarray | None = None
    lights: list[tuple[str, dict]] = field(default_factory=list)
    instances: list = field(default_factory=list)
    placed: Any = None

    def __post_init__(self) -> None:
        if self.face_materials is None:
            self.face_materials = np.zeros(len(self.faces), np.int32)
        if len(self.sphere_ids) == 0:
            self.sphere_ids = len(self.faces) + np.arange(len(self.spheres), dtype=np.int32)
        if len(self.sphere_materials) == 0:
            self.sphere_materials = np.zeros(len(self.spheres), np.int32)

    def __repr__(self) -> str:
        spheres = f", {len(self.spheres):,} spheres" if len(self.spheres) > 0 else ""
        normals = ", with vertex normals" if self.has_vertex_normals else ""
        return (
            f"Mesh({self.source!r}: {len(self.faces):,} triangles, {len(self.vertices):,} vertices{spheres}, "
            f"{len(self.materials)} materials{normals})"
        )

    @property
    def num_primitives(self) -> int:
        """How many triangles and spheres there are."""
        return len(self.faces) + len(self.spheres)

    @property
    def has_vertex_normals(self) -> bool:
        """Whether at least one corner of a triangle has a normal."""
        return bool((self.face_normals >= 0).any())

    @property
    def has_pictures(self) -> bool:
        """Whether a triangle or a sphere has a material with a texture, and there are texture coordinates."""
        return self.corner_uv is not None and any(self.materials[i].textures for i in self.used_materials())

    @property
    def has_holes(self) -> bool:
        """Whether rays pass through parts of a triangle."""
        return self.has_pictures and any(self.materials[i].has_holes for i in self.used_materials())

    def used_materials(self) -> np.ndarray:
        """The ids of the materials that at least one primitive has, in ascending order."""
        return np.flatnonzero(np.bincount(np.concatenate([self.face_materials, self.sphere_materials])))

    def emits(self) -> np.ndarray:
        """(P,) bool: for each triangle and then for each sphere, whether its material has Ke > 0."""
        is_bright = np.array([max(m.Ke) > 0 for m in self.materials], bool)
        return is_bright[np.concatenate([self.face_materials, self.sphere_materials])]

    def primitives(self) -> np.ndarray:
        """(P,) int32: for each primitive, its row if it is a triangle, and −1 − its row if it is a sphere."""
        table = np.zeros(self.num_primitives, np.int32)
        is_sphere = np.zeros(self.num_primitives, bool)
        is_sphere[self.sphere_ids] = True
        table[is_sphere] = -1 - np.arange(len(self.spheres))
        table[~is_sphere] = np.arange(len(self.faces))
        return table


def check(mesh: Mesh) -> None:
    """Raise an InputError if the arrays of ``mesh`` do not fit together; it names the triangle and the value."""
    for name, array, width in (
        *(("vertices", mesh.vertices, 3), ("faces", mesh.faces, 3)),
        *(("normals", mesh.normals, 3), ("spheres", mesh.spheres, 4)),
    ):
        if array.ndim != 2 or array.shape[1] != width:
            raise InputError(f"{mesh.source}: {name} must have the shape (n, {width}), not {array.shape}")
    of_faces, materials, primitives = np.asarray(mesh.face_materials), len(mesh.materials), mesh.num_primitives
    for name, ids, count in (
        ("face_materials", of_faces, len(mesh.faces)),
        ("sphere_materials", mesh.sphere_materials, len(mesh.spheres)),
        ("sphere_ids", mesh.sphere_ids, len(mesh.spheres)),
    ):
        if np.shape(ids) != (count,):
            raise InputError(f"{mesh.source}: {name} must have the shape ({count},), not {np.shape(ids)}")
    for name, ids, lowest, count in (
        *(("faces", mesh.faces, 0, len(mesh.vertices)), ("face_normals", mesh.face_normals, -1, len(mesh.normals))),
        *(("face_materials", of_faces, 0, materials), ("sphere_materials", mesh.sphere_materials, 0, materials)),
        ("sphere_ids", mesh.sphere_ids, 0, primitives),
    ):
        wrong = np.argwhere((ids < lowest) | (ids >= count))
        if len(wrong) > 0:
            at, value = wrong[0].tolist(), ids[tuple(wrong[0])]
            raise InputError(f"{mesh.source}: {name}{at} is {value}, which is out of range ({lowest} to {count - 1})")
    if (np.diff(mesh.sphere_ids) <= 0).any():
        raise InputError(f"{mesh.source}: sphere_ids must ascend, and no number may occur twice")


def smoothed(mesh: Mesh, smooth: bool | float) -> Mesh:
    """``mesh`` with smooth normals at all corners that have none, see ``formulas.vertex_normals.smooth_normals``.

    Args:
        smooth: the crease angle in degrees, from 0 to 180: edges at which the mesh bends by more stay sharp. True takes
            the usual angle, 30; False, but not 0, changes nothing.
    """
    if smooth is False:
        return mesh
    crease = USUAL_CREASE if smooth is True else smooth
    if not isinstance(crease, (int, float, np.number)) or not 0 <= crease <= 180:
        raise InputError(f"smooth must be True or an angle from 0 to 180 degrees, not {smooth!r}")
    face_normals = np.full(mesh.faces.shape, -1, np.int32) if len(mesh.face_normals) == 0 else mesh.face_normals
    if len(mesh.faces) == 0 or (face_normals >= 0).all():
        why = "it has no triangles" if len(mesh.faces) == 0 else "every corner has a normal in the file"
        return replace(mesh, notes=[*mesh.notes, f"{mesh.source}: smooth changes nothing: {why}"])
    normals, ids = smooth_normals(mesh.vertices, mesh.faces, float(crease))
    return replace(
        mesh,
        normals=np.concatenate([mesh.normals, normals]),
        face_normals=np.where(face_normals < 0, len(mesh.normals) + ids, face_normals),
    )


def unhittable(vertices: np.ndarray, faces: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Triangles that no ray can hit: (F,) bool with a NaN or infinite vertex, and (F,) bool without area.

    A NaN vertex would make every box that contains it NaN, and a triangle without area has no plane. The cross product
    is computed in float64, for a part of the triangles at a time: so little memory stays in the cache of the CPU.
    """
    not_finite, no_area = np.zeros(len(faces), bool), np.zeros(len(faces), bool)
    for first in range(0, len(faces), AT_ONCE):
        part = slice(first, first + AT_ONCE)
        with np.errstate(all="ignore"):
            v0, v1, v2 = (vertices[faces[part, k]].astype(np.float64) for k in range(3))
            not_finite[part] = ~(np.isfinite(v0) & np.isfinite(v1) & np.isfinite(v2)).all(axis=1)
            no_area[part] = ~not_finite[part] & (np.cross(v1 - v0, v2 - v0) == 0.0).all(axis=1)
    return not_finite, no_area


def is_collapsed(faces: np.ndarray) -> np.ndarray:
    """(F,) bool: whether ``clean`` collapsed a triangle into a point."""
    return (faces[:, 0] == faces[:, 1]) & (faces[:, 1] == faces[:, 2])


def note_steps(source: str, points: np.ndarray) -> list[str]:
    """A note if f32, where it is the precision, does not tell apart points that are near, or has no areas."""
    notes: list[str] = []
    if points.dtype == np.float32 and len(points) > 0:
        low, high = box_of(points)
        size, most = float((high - low).max()), max(abs(low).max(), abs(high).max())
        step = float(np.spacing(most))
        if size > 0 and not TINY < size < HUGE:
            notes.append(f"{source}: {size:.2g} units large: such areas are no numbers of f32: use --precision f64")
        elif 0 < COARSE * size < step < np.inf:
            notes.append(f"{source}: coordinates of {most:g} have steps of {step:.2g} in f32: use --precision f64")
    return notes


def clean(mesh: Mesh, dtype: type[np.floating]) -> Mesh:
    """``mesh`` with every coordinate in ``dtype``; primitives that no ray can hit are collapsed into a point.

    They are collapsed and not removed, so that the ids stay those of the file (C-16); a note reports their number. No
    ray can hit such a triangle, because its normal is 0, or such a sphere, because its radius is −∞.
    """
    with np.errstate(over="ignore"):
        vertices, spheres = mesh.vertices.astype(dtype), mesh.spheres.astype(dtype)
    not_finite, no_area = unhittable(vertices, mesh.faces)
    sphere_not_finite = ~np.isfinite(spheres).all(axis=1)
    no_radius = ~sphere_not_finite & ~(spheres[:, 3] > 0)
    gone, spheres_gone = not_finite | no_area, sphere_not_finite | no_radius
    faces = np.ascontiguousarray(mesh.faces, dtype=np.int32)
    notes = list(mesh.notes)
    if mesh.corner_uv is not None and mesh.has_pictures:
        odd = int((~np.isfinite(mesh.corner_uv)).any(axis=(1, 2)).sum())
        notes += [f"{mesh.source}: {odd} triangles have texture coordinates that are not finite numbers"] * (odd > 0)
    notes += note_steps(mesh.source, vertices[np.isfinite(vertices).all(axis=1)])
    dropped = int(gone.sum() + spheres_gone.sum())
    if dropped > 0:
        finite = np.asarray(np.isfinite(vertices).all(axis=1))
        vertices = np.where(finite[:, None], vertices, dtype(0))
        faces = np.where(gone[:, None], np.int32(0), faces)
        spheres = np.where(spheres_gone[:, None], np.array([0, 0, 0, -np.inf], dtype), spheres)
        causes = (
            (not_finite.sum() + sphere_not_finite.sum(), "with a vertex that is NaN, infinite or too large"),
            (no_area.sum() + no_radius.sum(), "without area"),
        )
        reasons = ", ".join(f"{count} {cause}" for count, cause in causes if count > 0)
        what = "triangles" if len(spheres) == 0 else "primitives"
        rest = ": nothing is left to be seen" if dropped == mesh.num_primitives else ""
        notes.append(f"{mesh.source}: {dropped} of {mesh.num_primitives} {what} dropped ({reasons}){rest}")
    return replace(mesh, vertices=vertices, faces=faces, notes=notes, dropped=dropped, spheres=spheres)


@ti.data_oriented
class Geometry:
    """The primitives of one scene in Taichi fields, under the handout's names. Ids count from 0.

    Attributes:
        n_triangles, n_spheres, n_primitives: their numbers, including the primitives that no ray can hit.
        vertices: (V,) vec3.
        triangle_vertex_ids: (F,) ivec3. triangle_material_ids: (F,) int.
        normals, triangle_normal_ids: (N,) vec3 and (F,) ivec3. They exist only if triangles have vertex normals, or if
            ``completes_normals`` is True.
        unit_normals: (F,) vec3, (v1 − v0) × (v2 − v0) normalised.
        thinness: (F,) see ``formulas.triangles``.
        culls: (F,) int, whether rays pass through the back; only if the scene has such triangles.
        spheres, sphere_material_ids: (S,) vec4 centre and radius, and (S,) int; only if the scene has spheres.
        primitives: (P,) int, the id of a triangle, or −1 − the id of a sphere; only if the scene has spheres.
        low, high: corners of the bounding box, numpy float64 (3,).
        mesh: the same primitives as numpy arrays, for the builders of hierarchies.
        memories: of the fields.

    Args:
        mesh: a mesh that ``clean`` returned.
        effects: which of the optional fields the scene calls for, see ``effects.Effects``.
        completes_normals: whether every corner of every triangle gets a normal, because a student's method may read it.
            A corner that has none in the file gets the normal of its triangle's plane.
    """

    def __init__(self, mesh: Mesh, effects: Any, completes_normals: bool = False) -> None:
        self.n_triangles, self.n_spheres = varying(len(mesh.faces)), varying(len(mesh.spheres))
        self.n_primitives = varying(mesh.num_primitives)
        self.mesh, self.effects = mesh, effects
        points = self.hittable()[1] if mesh.placed is None else mesh.placed.points(mesh.placed.boxes(mesh))
        points = points.reshape(-1, 3).astype(np.float64)
        self.low, self.high = box_of(points if len(points) > 0 else np.zeros((1, 3)))
        self.corners = varying((tuple(self.low.tolist()), tuple(self.high.tolist())))  # the same, for kernels
        self.n_vertex_normals = len(mesh.normals)
        self.has_normals = effects.interpolated_normals or completes_normals
        self.textures: Any = None  # those of the scene, which has made them of the same mesh
        self.places: Any = None  # the same, see ``intersectors.instances``; only if objects stand in several places

        # The normal and the thinness are kept per triangle, because every point that is shaded needs them.
        corners = [mesh.vertices[mesh.faces[:, k]] for k in range(3)]
        normals_of_planes = unit_normals(*corners)
        of_triangles = mesh.faces, np.asarray(mesh.face_materials), normals_of_planes, thinness_of(*corners)
        memory, (self.vertices, *fields) = filled(mesh.vertices, *of_triangles)
        self.triangle_vertex_ids, self.triangle_material_ids, self.unit_normals, self.thinness = fields
        self.memories = [memory]
        if self.has_normals:
            normals, ids = mesh.normals if len(mesh.normals) > 0 else np.zeros((1, 3)), mesh.face_normals
            if len(ids) == 0:
                ids = np.full(mesh.faces.shape, -1, np.int32)
            if completes_normals:  # behind those of the file, the normals of the planes
                ids = np.where(ids < 0, len(normals) + np.arange(self.n_triangles, dtype=np.int32)[:, None], ids)
                normals = np.concatenate([normals, normals_of_planes])
            memory, (self.normals, self.triangle_normal_ids) = filled(normals, ids)
            self.memories.append(memory)
        if effects.spheres:
            memory, fields = filled(mesh.spheres, mesh.sphere_materials, mesh.primitives())
            self.spheres, self.sphere_material_ids, self.primitives = fields
            self.memories.append(memory)
        if effects.culling:
            memory, (self.culls,) = filled(np.asarray(mesh.face_culls, np.int32))
            self.memories.append(memory)

    def sphere_boxes(self) -> np.ndarray:
        """(n, 6) low and high corner of the box of every sphere that a ray can hit, in the running precision."""
        spheres = self.mesh.spheres[self.mesh.spheres[:, 3] > 0]
        return np.concatenate([spheres[:, :3] - spheres[:, 3:], spheres[:, :3] + spheres[:, 3:]], axis=1)

    def hittable_triangles(self) -> np.ndarray:
        """(n,) ids of the triangles that ``clean`` did not collapse."""
        return np.flatnonzero(~is_collapsed(self.mesh.faces))

    def hittable(self) -> tuple[np.ndarray, np.ndarray]:
        """(n,) int32 numbers of the primitives that a ray can hit, and their (n, 6) boxes."""
        rows = self.hittable_triangles()
        v0, v1, v2 = (np.take(self.mesh.vertices, self.mesh.faces[rows, k], axis=0) for k in range(3))
        boxes = np.empty((len(rows), 6), self.mesh.vertices.dtype)
        np.minimum(np.minimum(v0, v1), v2, out=boxes[:, :3])
        np.maximum(np.maximum(v0, v1), v2, out=boxes[:, 3:])
        ids = rows.astype(np.int32)
        if self.n_spheres > 0:
            ids = np.flatnonzero(self.mesh.primitives() >= 0)[rows]
            ids = np.concatenate([ids, self.mesh.sphere_ids[self.mesh.spheres[:, 3] > 0]]).astype(np.int32)
            boxes = np.concatenate([boxes, self.sphere_boxes()])
        return ids, boxes

    @ti.func
    def triangle(self, triangle_id):
        """The three vertices v0, v1, v2."""
        ids = self.triangle_vertex_ids[triangle_id]
        return self.vertices[ids.x], self.vertices[ids.y], self.vertices[ids.z]

    @ti.func
    def position(self, u, v, v0, v1, v2, thinness):
        """(1 − u − v) v0 + u v1 + v v2, and a bound of its rounding error for each component, for ``offset_origin``.

        A point that is computed from barycentric coordinates lies on the triangle, except for rounding, at any distance
        from the origin of the ray. The bound is γ(7) of PBR, 4th edition, section 6.8.5, plus the error of the next
        triangle test. That test rounds v0 as seen from this point, and the normal; the thinner the triangle is, the
        larger is the error of the normal.
        """
        w = 1 - u - v
        p = w * v0 + u * v1 + v * v2
        size = abs(w * v0) + abs(u * v1) + abs(v * v2) + tm.length(v0 - p) * thinness
        return p, size * ti.static(8 * runtime.epsilon())

    @ti.func
    def number(self, primitive_id):
        """The number of a primitive in memory: its id, unless objects stand in several places."""
        if ti.static(self.effects.instances):
            return self.places.number(primitive_id)
        return primitive_id

    @ti.func
    def shading_normal(self, triangle_id, u, v, geometric_normal):
        """normalize(w n0 + u n1 + v n2) (A1-13); the geometric normal if a corner has no normal, or if the sum is 0."""
        normal = geometric_normal
        if ti.static(self.effects.interpolated_normals):
            ids = self.triangle_normal_ids[triangle_id]
            if ids.min() >= 0 and ids.max() < self.n_vertex_normals:
                n = (1 - u - v) * self.normals[ids.x] + u * self.normals[ids.y] + v * self.normals[ids.z]
                length = tm.length(n)
                if length > 0:
                    normal = n / length
        return normal
