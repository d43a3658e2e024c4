"""Triangles and spheres: numpy arrays (``Mesh``, what files hold) and Taichi fields (``Geometry``, what rays meet).

Both kinds are primitives, numbered together in the file's order; a *triangle id* is the number of a primitive.
"""

from dataclasses import dataclass, field, replace

import numpy as np
import taichi as ti
import taichi.math as tm

from taichi_tracer.materials import Material
from taichi_tracer.system import runtime
from taichi_tracer.system.errors import InputError


@dataclass
class Mesh:
    """Indexed triangles with materials: plain numpy, ids 0-based and in the file's order, −1 = none (C-16).

    A sphere takes the number, and so the row, of a triangle: its vertex ids there are 0, its material is its own.

    Attributes:
        vertices: (V, 3) float64 positions; with spheres there is at least one.
        faces: (F, 3) int32 vertex ids, counter-clockwise seen from the front.
        normals: (N, 3) float64 vertex normals, not necessarily unit length; (0, 3) when there are none.
        face_normals: (F, 3) int32 ids into ``normals`` for each corner, −1 where a corner has none; (0, 3) int32 when
            there are no vertex normals at all.
        face_materials: (F,) int32 ids into ``materials``.
        materials: in order of first use.
        source: where the mesh came from, for messages.
        notes: one line per thing that the user should know, such as triangles that were dropped.
        spheres: (S, 4) float64 centre and radius.
        sphere_ids: (S,) int32, the row of ``faces`` that each sphere has.
        face_culls: (F,) bool, whether rays pass through the back of a triangle; None when they pass through none.
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
    face_culls: np.ndarray | None = None

    def __post_init__(self) -> None:
        if self.face_materials is None:
            self.face_materials = np.zeros(len(self.faces), np.int32)


def check(mesh: Mesh) -> None:
    """Raise InputError where the arrays of ``mesh`` do not fit together, naming the triangle and the value."""
    for name, array, width in (("vertices", mesh.vertices, 3), ("faces", mesh.faces, 3), ("normals", mesh.normals, 3)):
        if array.ndim != 2 or array.shape[1] != width:
            raise InputError(f"{mesh.source}: {name} must have the shape (n, {width}), not {array.shape}")
    for name, ids, of in (("vertex", mesh.faces, mesh.vertices), ("normal", mesh.face_normals, mesh.normals)):
        lowest = 0 if name == "vertex" else -1
        wrong = np.argwhere((ids < lowest) | (ids >= len(of)))
        if len(wrong) > 0:
            triangle, corner = wrong[0]
            raise InputError(
                f"{mesh.source}: triangle {triangle} has {name} index {ids[triangle, corner]}, which is out of range "
                f"(there are {len(of)}, counted from 0)"
            )


def unhittable(vertices: np.ndarray, faces: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Triangles that no ray can meet: (F,) bool with a NaN or infinite vertex, and (F,) bool with no area.

    A NaN poisons every box above it, and a triangle without area has no plane. The cross product is taken in float64.
    """
    with np.errstate(all="ignore"):
        v0, v1, v2 = (vertices[faces[:, k]].astype(np.float64) for k in range(3))
        not_finite = ~(np.isfinite(v0) & np.isfinite(v1) & np.isfinite(v2)).all(axis=1)
        no_area = ~not_finite & (np.cross(v1 - v0, v2 - v0) == 0.0).all(axis=1)
    return not_finite, no_area


def clean(mesh: Mesh, dtype: type) -> Mesh:
    """``mesh`` with every coordinate in ``dtype`` and every unhittable triangle collapsed into one point, and noted.

    Collapsed, not removed: triangle ids stay those of the file (C-16), and the zero normal keeps every ray out.
    """
    with np.errstate(over="ignore"):
        vertices = mesh.vertices.astype(dtype)
    not_finite, no_area = unhittable(vertices, mesh.faces)
    with np.errstate(over="ignore"):
        spheres = mesh.spheres.astype(dtype)
    not_finite[mesh.sphere_ids], no_area[mesh.sphere_ids] = ~np.isfinite(spheres).all(axis=1), ~(spheres[:, 3] > 0)
    gone = not_finite | no_area
    faces = np.ascontiguousarray(mesh.faces, dtype=np.int32)
    notes = list(mesh.notes)
    if gone.any():
        finite = np.isfinite(vertices).all(axis=1)
        vertices = np.where(finite[:, None], vertices, dtype(0))
        faces = np.where(gone[:, None], np.int32(0), faces)
        causes = ((not_finite, "with a NaN or infinite vertex"), (no_area, "without area"))
        told = ", ".join(f"{which.sum()} {cause}" for which, cause in causes if which.any())
        what = "triangles" if len(spheres) == 0 else "primitives"
        notes.append(f"{mesh.source}: {gone.sum()} of {len(faces)} {what} dropped ({told})")
    kept = ~gone[mesh.sphere_ids]
    return replace(
        mesh,
        vertices=vertices,
        faces=faces,
        notes=notes,
        dropped=int(gone.sum()),
        spheres=spheres[kept],
        sphere_ids=mesh.sphere_ids[kept],
    )


@ti.data_oriented
class Geometry:
    """The primitives of one scene in Taichi fields.

    Attributes:
        num_primitives, num_spheres, num_triangles: how many, those included that no ray can hit.
        is_plain: whether there are only triangles, and rays meet both sides of all: then nothing else is compiled.
        vertices: (V,) vec3. faces: (F,) ivec3 vertex ids. face_materials: (F,) int.
        unit_normals: (F,) vec3, (v1 − v0) × (v2 − v0) normalised.
        normals, face_normals: (N,) vec3 and (F,) ivec3, only where ``has_normals``.
        spheres, sphere_of: (S,) vec4 and (F,) int, −1 for a triangle, only where ``has_spheres``.
        culls: (F,) int, only where ``has_culling``.
        low, high: corners of the bounding box, numpy float64 (3,).
        arrays: the same vertices and faces as numpy arrays, for builders of accelerators.

    Args:
        keep_normals, keep_spheres: have the fields, and the code, where there is nothing to put into them.
    """

    def __init__(
        self, mesh: Mesh, fields: ti.FieldsBuilder, keep_normals: bool = False, keep_spheres: bool = False
    ) -> None:
        self.num_primitives, self.num_spheres = len(mesh.faces), len(mesh.spheres)
        self.num_triangles = self.num_primitives - self.num_spheres
        self.arrays = mesh.vertices, mesh.faces
        self.sphere_arrays = mesh.spheres, mesh.sphere_ids
        if keep_normals and len(mesh.face_normals) == 0:
            no_ids = np.full((max(1, self.num_primitives), 3), -1, np.int32)
            mesh.normals, mesh.face_normals = np.zeros((1, 3)), no_ids
        self.has_normals = keep_normals or bool((mesh.face_normals >= 0).any())
        self.has_spheres = keep_spheres or self.num_spheres > 0
        self.has_culling = mesh.face_culls is not None and bool(mesh.face_culls.any())
        self.is_plain = not (self.has_spheres or self.has_culling)
        self.low, self.high = self._bounds(mesh)

        self.vertices = ti.Vector.field(3, float)
        self.faces = ti.Vector.field(3, ti.i32)
        self.face_materials = ti.field(ti.i32)
        # Of every triangle, since every point that is shaded asks for them.
        self.unit_normals, self.thinness = ti.Vector.field(3, float), ti.field(float)
        fields.dense(ti.i, max(1, len(mesh.vertices))).place(self.vertices)
        per_face = fields.dense(ti.i, max(1, self.num_primitives))
        per_face.place(self.faces, self.face_materials, self.unit_normals, self.thinness)
        if self.has_normals:
            self.normals = ti.Vector.field(3, float)
            self.face_normals = ti.Vector.field(3, ti.i32)
            fields.dense(ti.i, len(mesh.normals)).place(self.normals)
            per_face.place(self.face_normals)
        if self.has_spheres:
            self.spheres = ti.Vector.field(4, float)
            self.sphere_of = ti.field(ti.i32)
            fields.dense(ti.i, max(1, self.num_spheres)).place(self.spheres)
            per_face.place(self.sphere_of)
        if self.has_culling:
            self.culls = ti.field(ti.i32)
            per_face.place(self.culls)

    def _bounds(self, mesh: Mesh) -> tuple[np.ndarray, np.ndarray]:
        faces = mesh.faces
        if self.num_spheres > 0:  # whose rows name vertex 0
            faces = faces[self.hittable_triangles()]
        corners = [mesh.vertices[np.unique(faces)]] if len(faces) > 0 else []
        if self.num_spheres > 0:
            corners += np.split(self.sphere_boxes(), 2, axis=1)
        used = np.concatenate(corners) if corners else np.zeros((1, 3))
        return used.min(axis=0).astype(np.float64), used.max(axis=0).astype(np.float64)

    def hittable_triangles(self) -> np.ndarray:
        """(n,) ids of the triangles that ``clean`` did not collapse."""
        faces = self.arrays[1]
        return np.flatnonzero((faces[:, 0] != faces[:, 1]) | (faces[:, 1] != faces[:, 2]))

    def sphere_boxes(self) -> np.ndarray:
        """(S, 6) low and high corner of every sphere, in the running precision."""
        spheres = self.sphere_arrays[0]
        return np.concatenate([spheres[:, :3] - spheres[:, 3:], spheres[:, :3] + spheres[:, 3:]], axis=1)

    def hittable(self) -> tuple[np.ndarray, np.ndarray]:
        """(n,) ids of the primitives that a ray can meet, and their (n, 6) boxes."""
        vertices, faces = self.arrays
        ids = self.hittable_triangles()
        corners = vertices[faces[ids]]
        boxes = np.concatenate([corners.min(axis=1), corners.max(axis=1)], axis=1)
        if self.num_spheres > 0:
            ids = np.concatenate([ids, self.sphere_arrays[1]])
            boxes = np.concatenate([boxes, self.sphere_boxes()])
        return ids, boxes

    def load(self, mesh: Mesh) -> None:
        """Copy the arrays into the fields; after the builder's ``finalize``."""
        if self.num_primitives == 0:
            return
        dtype = runtime.dtype()
        self._load_triangles(mesh.vertices, mesh.faces, np.ascontiguousarray(mesh.face_materials, np.int32))
        if self.has_normals:
            self._load_normals(
                np.ascontiguousarray(mesh.normals, dtype), np.ascontiguousarray(mesh.face_normals, np.int32)
            )
        if self.has_spheres:
            sphere_of = np.full(self.num_primitives, -1, np.int32)
            sphere_of[mesh.sphere_ids] = np.arange(self.num_spheres)
            self._load_spheres(np.ascontiguousarray(mesh.spheres, dtype), sphere_of)
        if self.has_culling:
            self._load_culls(mesh.face_culls.astype(np.int32))

    @ti.kernel
    def _load_triangles(
        self,
        vertices: ti.types.ndarray(ndim=2),
        faces: ti.types.ndarray(ndim=2),
        face_materials: ti.types.ndarray(ndim=1),
    ):
        for i in range(vertices.shape[0]):
            for k in ti.static(range(3)):
                self.vertices[i][k] = vertices[i, k]
        for i in range(faces.shape[0]):
            self.face_materials[i] = face_materials[i]
            for k in ti.static(range(3)):
                self.faces[i][k] = faces[i, k]
        for i in range(faces.shape[0]):
            v0, v1, v2 = self.triangle(i)
            self.unit_normals[i] = unit(stable_normal(v0, v1, v2))
            self.thinness[i] = thinness(v0, v1, v2)

    @ti.kernel
    def _load_normals(self, normals: ti.types.ndarray(ndim=2), face_normals: ti.types.ndarray(ndim=2)):
        for i in range(normals.shape[0]):
            for k in ti.static(range(3)):
                self.normals[i][k] = normals[i, k]
        for i in range(face_normals.shape[0]):
            for k in ti.static(range(3)):
                self.face_normals[i][k] = face_normals[i, k]

    @ti.kernel
    def _load_spheres(self, spheres: ti.types.ndarray(ndim=2), sphere_of: ti.types.ndarray(ndim=1)):
        for i in range(spheres.shape[0]):
            for k in ti.static(range(4)):
                self.spheres[i][k] = spheres[i, k]
        for i in range(sphere_of.shape[0]):
            self.sphere_of[i] = sphere_of[i]

    @ti.kernel
    def _load_culls(self, culls: ti.types.ndarray(ndim=1)):
        for i in range(culls.shape[0]):
            self.culls[i] = culls[i]

    @ti.func
    def is_special(self, triangle_id):
        """Whether a primitive is anything but a triangle with two sides."""
        special = False
        if ti.static(self.has_spheres):
            special = self.sphere_of[triangle_id] >= 0
        if ti.static(self.has_culling):
            special = special or self.culls[triangle_id] != 0
        return special

    @ti.func
    def triangle(self, triangle_id):
        """The three vertices v0, v1, v2."""
        ids = self.faces[triangle_id]
        return self.vertices[ids.x], self.vertices[ids.y], self.vertices[ids.z]

    @ti.func
    def position(self, triangle_id, u, v):
        """(1 − u − v) v0 + u v1 + v v2, and a bound of its rounding error by component, for ``offset_origin``.

        From barycentrics the point lies on the triangle but for rounding, however far the ray came from. The bound is
        γ(7) of PBR, 4th edition, section 6.8.5, and what the next triangle test adds: it rounds v0 as seen from here,
        and the normal, by more the thinner the triangle.
        """
        v0, v1, v2 = self.triangle(triangle_id)
        w = 1 - u - v
        p = w * v0 + u * v1 + v * v2
        size = abs(w * v0) + abs(u * v1) + abs(v * v2) + (v0 - p).norm() * self.thinness[triangle_id]
        return p, size * ti.static(8 * runtime.epsilon())

    @ti.func
    def hit_position(self, data):
        """Where a ray met the surface, and a bound of the rounding error, as for ``position``; of either primitive.

        On a sphere it is c + r n, which lies on it however far the ray came from.
        """
        position, error = tm.vec3(0), tm.vec3(0)
        sphere = -1
        if ti.static(self.has_spheres):
            sphere = self.sphere_of[data.triangle_id]
            if sphere >= 0:
                centre, radius = self.spheres[sphere].xyz, self.spheres[sphere].w
                outward = ti.select(data.is_backfacing, -data.geometric_normal, data.geometric_normal)
                position = centre + radius * outward
                error = (abs(centre) + radius) * ti.static(8 * runtime.epsilon())
        if sphere < 0:
            u, v = data.barycentric_coords.x, data.barycentric_coords.y
            position, error = self.position(data.triangle_id, u, v)
        return position, error

    @ti.func
    def shading_normal(self, triangle_id, u, v, geometric_normal):
        """normalize(w n0 + u n1 + v n2) (A1-13); the geometric normal where a corner has none, or where they cancel."""
        normal = geometric_normal
        if ti.static(self.has_normals):
            ids = self.face_normals[triangle_id]
            if ids.min() >= 0:
                n = (1 - u - v) * self.normals[ids.x] + u * self.normals[ids.y] + v * self.normals[ids.z]
                length = n.norm()
                if length > 0:
                    normal = n / length
        return normal


@ti.func
def thinness(v0, v1, v2):
    """1/sin of the angle between the two shortest edges, ≥ 1: how many times its own rounding a normal is off."""
    a, b, c = (v1 - v0).norm(), (v2 - v1).norm(), (v0 - v2).norm()
    longest = ti.max(a, b, c)
    others = ti.select(longest == a, b * c, ti.select(longest == b, c * a, a * b))
    return others / tm.cross(v1 - v0, v2 - v0).norm()


@ti.func
def stable_normal(v0, v1, v2):
    """(v1 − v0) × (v2 − v0), from the two shortest edges, which lose least to rounding on a sliver."""
    e0 = v1 - v0
    e1 = v2 - v1
    e2 = v0 - v2
    l0, l1, l2 = e0.norm_sqr(), e1.norm_sqr(), e2.norm_sqr()
    is_0_longest = l0 >= l1 and l0 >= l2
    is_1_longest = l1 >= l2
    p = ti.select(is_0_longest, e1, ti.select(is_1_longest, e2, e0))
    q = ti.select(is_0_longest, e2, ti.select(is_1_longest, e0, e1))
    return tm.cross(p, q)


@ti.func
def unit(v):
    """v / |v|, also where |v|² is beyond the largest or below the smallest number: scaled by its largest component."""
    w = v / abs(v).max()
    return w / w.norm()
