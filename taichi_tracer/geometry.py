"""Indexed triangles: numpy arrays (``Mesh``, what files hold) and Taichi fields (``Geometry``, what rays meet)."""

from dataclasses import dataclass, field, replace

import numpy as np
import taichi as ti
import taichi.math as tm

from taichi_tracer import runtime
from taichi_tracer.errors import InputError
from taichi_tracer.materials import Material


@dataclass
class Mesh:
    """Indexed triangles with materials: plain numpy, ids 0-based and in the file's order, −1 = none (C-16).

    Attributes:
        vertices: (V, 3) float64 positions.
        faces: (F, 3) int32 vertex ids, counter-clockwise seen from the front.
        normals: (N, 3) float64 vertex normals, not necessarily unit length; (0, 3) when there are none.
        face_normals: (F, 3) int32 ids into ``normals`` for each corner, −1 where a corner has none; (0, 3) int32 when
            there are no vertex normals at all.
        face_materials: (F,) int32 ids into ``materials``.
        materials: in order of first use.
        source: where the mesh came from, for messages.
        notes: one line per thing that the user should know, such as triangles that were dropped.
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
    gone = not_finite | no_area
    faces = np.ascontiguousarray(mesh.faces, dtype=np.int32)
    notes = list(mesh.notes)
    if gone.any():
        finite = np.isfinite(vertices).all(axis=1)
        vertices = np.where(finite[:, None], vertices, dtype(0))
        faces = np.where(gone[:, None], np.int32(0), faces)
        causes = ((not_finite, "with a NaN or infinite vertex"), (no_area, "without area"))
        told = ", ".join(f"{which.sum()} {cause}" for which, cause in causes if which.any())
        notes.append(f"{mesh.source}: {gone.sum()} of {len(faces)} triangles dropped ({told})")
    return replace(mesh, vertices=vertices, faces=faces, notes=notes, dropped=int(gone.sum()))


@ti.data_oriented
class Geometry:
    """The triangles of one scene in Taichi fields.

    Attributes:
        vertices: (V,) vec3. faces: (F,) ivec3 vertex ids. face_materials: (F,) int.
        normals, face_normals: (N,) vec3 and (F,) ivec3, only where ``has_normals``.
        low, high: corners of the bounding box, numpy float64 (3,).
        arrays: the same vertices and faces as numpy arrays, for builders of accelerators.
    """

    def __init__(self, mesh: Mesh, fields: ti.FieldsBuilder, keep_normals: bool = False) -> None:
        self.num_triangles = len(mesh.faces)
        self.arrays = mesh.vertices, mesh.faces
        if keep_normals and len(mesh.face_normals) == 0:
            no_ids = np.full((max(1, self.num_triangles), 3), -1, np.int32)
            mesh.normals, mesh.face_normals = np.zeros((1, 3)), no_ids
        self.has_normals = keep_normals or bool((mesh.face_normals >= 0).any())
        used = mesh.vertices[np.unique(mesh.faces)] if self.num_triangles > 0 else np.zeros((1, 3))
        self.low, self.high = used.min(axis=0).astype(np.float64), used.max(axis=0).astype(np.float64)

        self.vertices = ti.Vector.field(3, float)
        self.faces = ti.Vector.field(3, ti.i32)
        self.face_materials = ti.field(ti.i32)
        fields.dense(ti.i, max(1, len(mesh.vertices))).place(self.vertices)
        per_face = fields.dense(ti.i, max(1, self.num_triangles))
        per_face.place(self.faces, self.face_materials)
        if self.has_normals:
            self.normals = ti.Vector.field(3, float)
            self.face_normals = ti.Vector.field(3, ti.i32)
            fields.dense(ti.i, len(mesh.normals)).place(self.normals)
            per_face.place(self.face_normals)

    def hittable_ids(self) -> np.ndarray:
        """(n,) ids of the triangles that ``clean`` did not collapse."""
        faces = self.arrays[1]
        return np.flatnonzero((faces[:, 0] != faces[:, 1]) | (faces[:, 1] != faces[:, 2]))

    def load(self, mesh: Mesh) -> None:
        """Copy the arrays into the fields; after the builder's ``finalize``."""
        if self.num_triangles == 0:
            return
        dtype = runtime.dtype()
        self._load_triangles(mesh.vertices, mesh.faces, np.ascontiguousarray(mesh.face_materials, np.int32))
        if self.has_normals:
            self._load_normals(
                np.ascontiguousarray(mesh.normals, dtype), np.ascontiguousarray(mesh.face_normals, np.int32)
            )

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

    @ti.kernel
    def _load_normals(self, normals: ti.types.ndarray(ndim=2), face_normals: ti.types.ndarray(ndim=2)):
        for i in range(normals.shape[0]):
            for k in ti.static(range(3)):
                self.normals[i][k] = normals[i, k]
        for i in range(face_normals.shape[0]):
            for k in ti.static(range(3)):
                self.face_normals[i][k] = face_normals[i, k]

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
        size = abs(w * v0) + abs(u * v1) + abs(v * v2) + (v0 - p).norm() * thinness(v0, v1, v2)
        return p, size * ti.static(8 * runtime.epsilon())

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
