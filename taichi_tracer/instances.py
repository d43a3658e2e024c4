"""Meshes made of parts: moved, turned inside out, joined, and one mesh in several places (instances, RT-12).

A group is a ``Mesh`` with ``instances``: other meshes, each with the transforms that put it into its places. They may
be groups, too. ``settled`` composes all transforms of such a tree: then there are objects, and places where they stand.
The triangles of an object are in memory once, unless copies of them are small, or are needed.
"""

import itertools
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import ArrayLike

from taichi_tracer.geometry import Mesh, check, is_collapsed, smoothed
from taichi_tracer.materials import Material
from taichi_tracer.system.errors import InputError, one_of

CHOICES = ("auto", "shared", "copied")
# Copies of all objects together may have so many primitives more than the objects: a scene without instances is traced
# up to twice as fast, and this is 20 MB.
FEW_COPIES = 100_000
MOST_COPIES = 20_000_000  # as many as docs/speed.md measures: copies must not fill the memory
MOST_PLACES = 10_000_000
MOST_IDS = 2**31 - 1
MOST_LEVELS = 64  # of groups in groups
# The relative deviation from a similarity that a transform may have, because its numbers are rounded.
UNIFORM = 1e-9
# |M| |M⁻¹| of a transform that squeezes more is near that of a plane: its inverse in f32 would be noise.
MOST_SQUEEZED = 1e5
MOST_SCALED = 1e15  # the largest number of a transform or of its inverse: products of f32 stay finite
MOST_VIEWED = 2_000_000  # points that are looked at one by one, to find a camera that shows all of them


@dataclass
class Instances:
    """A mesh that stands in several places.

    Attributes:
        mesh: the mesh, which may have instances itself.
        transforms: (n, 4, 4) or (4, 4) matrices from the mesh to its places: any that moves, turns, scales, shears or
            mirrors. A mirrored front stays a front.
    """

    mesh: Mesh
    transforms: ArrayLike

    def __post_init__(self) -> None:
        if not isinstance(self.mesh, Mesh):
            raise InputError(f"Instances: the mesh must be a Mesh, not {type(self.mesh).__name__}")
        try:
            matrices = np.array(self.transforms, np.float64)
            matrices = matrices.reshape(-1, 4, 4)
        except (TypeError, ValueError):
            raise InputError("Instances: transforms must be numbers of the shape (n, 4, 4) or (4, 4)") from None
        wrong = ~(np.isfinite(matrices).all(axis=(1, 2)) & (matrices[:, 3] == (0, 0, 0, 1)).all(axis=1))
        if wrong.any():
            row = int(np.argmax(wrong))
            raise InputError(
                f"Instances: transform {row} must have finite numbers and the last row 0 0 0 1, not "
                f"{matrices[row].tolist()}"
            )
        self.transforms = matrices

    @property
    def matrices(self) -> np.ndarray:
        """(n, 4, 4) float64, the transforms."""
        return np.asarray(self.transforms)

    def __repr__(self) -> str:
        return f"Instances({self.mesh!r}, {len(self.matrices):,} places)"


@dataclass(frozen=True)
class Placed:
    """Where the objects of a mesh stand. The primitives of all objects follow each other in the mesh.

    The primitives of all places are numbered together: those of the first place come first, in the order of its object.

    Attributes:
        faces, spheres, primitives: (K + 1,) the rows at which the objects begin, and after which the last one ends.
        object_of: (n,) the object of each place.
        matrices: (n, 3, 4) float64, from the object to the place.
        group: the mesh of which this was made.
    """

    faces: np.ndarray
    spheres: np.ndarray
    primitives: np.ndarray
    object_of: np.ndarray
    matrices: np.ndarray
    group: Mesh

    @property
    def starts(self) -> np.ndarray:
        """(n + 1,) int64: the number of the first primitive of each place, and the number of all primitives."""
        return np.concatenate([[0], np.cumsum(np.diff(self.primitives)[self.object_of])])

    def total(self, begins: np.ndarray) -> int:
        """How many rows there are in all places; ``begins`` is ``faces``, ``spheres`` or ``primitives``."""
        return int(np.diff(begins)[self.object_of].sum())

    def inverses(self) -> np.ndarray:
        """(n, 3, 4) float64: from the places to the objects."""
        linear = inverse_of(self.matrices[:, :, :3])
        return np.concatenate([linear, -linear @ self.matrices[:, :, 3:]], axis=2)

    def points(self, of_objects: Sequence[np.ndarray]) -> np.ndarray:
        """Points of the objects, in all places: (m, 3) float64. ``of_objects`` has (k, 3) points for each object."""
        found = [np.zeros((0, 3))]
        for number, points in enumerate(of_objects):
            own = self.matrices[self.object_of == number]
            placed = np.einsum("nij,kj->nki", own[:, :, :3], points) + own[:, None, :, 3]
            found.append(placed.reshape(-1, 3))
        return np.concatenate(found)

    def boxes(self, mesh: Mesh) -> list[np.ndarray]:
        """The 8 corners of the box of each object of a mesh; (0, 3) for one that nothing can hit."""
        found = []
        for number in range(len(self.faces) - 1):
            points = visible_points(self.object(mesh, number))
            sides = np.stack([points.min(axis=0), points.max(axis=0)]) if len(points) > 0 else points
            found.append(np.stack(np.meshgrid(*sides.T, indexing="ij"), axis=-1).reshape(-1, 3))
        return found

    def object(self, mesh: Mesh, number: int) -> Mesh:
        """The triangles and spheres of one object, without its materials, normals and colours."""
        faces = mesh.faces[self.faces[number] : self.faces[number + 1]]
        spheres = mesh.spheres[self.spheres[number] : self.spheres[number + 1]]
        return Mesh(mesh.vertices, faces, spheres=spheres)


def group(parts: "Sequence[Mesh | Instances]", source: str = "group") -> Mesh:
    """One mesh of meshes and of ``Instances``: a scene, or a part of one that stands in several places itself.

    The primitives are numbered in this order: those of the meshes, then those of all places of the first ``Instances``,
    and so on.

    Args:
        parts: a list of them. source: a name for messages.
    """
    parts = [parts] if isinstance(parts, Mesh | Instances) else list(parts)
    for part in parts:
        if not isinstance(part, Mesh | Instances):
            raise InputError(f"group: a part must be a Mesh or Instances, not {type(part).__name__}")
    meshes, materials = with_common_materials([part for part in parts if isinstance(part, Mesh)])
    whole = joined(meshes, materials, source)
    whole.lights = [light for mesh in meshes for light in mesh.lights]
    whole.instances = [one for part in parts for one in (part.instances if isinstance(part, Mesh) else [part])]
    whole.notes = [note for mesh in meshes for note in mesh.notes]
    return whole


def settled(mesh: Mesh, smooth: bool | float = False, choice: str = "auto") -> Mesh:
    """``mesh`` without ``instances``: with copies of them, or with objects that are shared; then it has ``placed``.

    Args:
        smooth: see ``geometry.smoothed``; each object is smoothed by itself.
        choice: "shared": what can be shared is; "copied": nothing is; "auto": objects are shared if their copies would
            have many primitives. Objects that emit light are copied, because each copy is a lamp of its own; so are
            those that are pressed flat, which have no inverse transform.

    Raises:
        InputError: a group contains itself, or there are too many places or copies.
    """
    if choice not in CHOICES:
        raise one_of("instances", choice, CHOICES)
    if not mesh.instances:
        return smoothed(mesh, smooth)
    places = list(_places(mesh, np.eye(4)[None], (mesh,)))
    distinct = list({id(one): one for one, _ in places}.values())
    for one in distinct:
        check(one)
    notes = [note for one in distinct if one is not mesh for note in one.notes]
    if any(one.lights for one in distinct if one is not mesh):
        notes.append(f"{mesh.source}: lights in files of meshes that stand in several places are left out")
    objects, materials = with_common_materials([smoothed(one, smooth) for one in distinct])
    number = {id(one): k for k, one in enumerate(distinct)}
    object_of = np.concatenate([np.zeros(0, int), *(np.full(len(m), number[id(one)]) for one, m in places)])
    matrices = np.concatenate([np.zeros((0, 4, 4)), *(m for _, m in places)])
    shared = _shared(objects, object_of, matrices, choice, mesh.source)
    copies = [_copy(objects[k], matrix) for k, matrix in zip(object_of[~shared], matrices[~shared], strict=True)]
    kept = np.unique(object_of[shared])
    parts = [joined(copies, materials, mesh.source), *(objects[k] for k in kept)]
    whole = replace(joined(parts, materials, mesh.source), notes=[*mesh.notes, *notes], lights=mesh.lights)
    if len(kept) > 0:
        counts = np.array([(len(part.faces), len(part.spheres), part.num_primitives) for part in parts])
        faces, spheres, primitives = np.concatenate([np.zeros((1, 3), int), counts.cumsum(axis=0)]).T
        renumbered = np.concatenate([[0], 1 + np.searchsorted(kept, object_of[shared])])
        stands = np.concatenate([np.eye(4)[None], matrices[shared]])[:, :3]
        whole.placed = Placed(faces, spheres, primitives, renumbered.astype(np.int32), stands, mesh)
        count = whole.placed.starts[-1]
        if count > MOST_IDS:
            raise InputError(f"{mesh.source}: {count:,} primitives in all places, and ids end at {MOST_IDS:,}")
    return whole


def _places(mesh: Mesh, matrices: np.ndarray, path: tuple[Mesh, ...]) -> Iterator[tuple[Mesh, np.ndarray]]:
    """(a mesh with primitives, the (n, 4, 4) transforms to its places) for a group and everything in it."""
    if mesh.num_primitives > 0:
        yield mesh, matrices
    for one in mesh.instances:
        way = " → ".join(part.source for part in (*path, one.mesh))
        if any(part is one.mesh for part in path):
            raise InputError(f"a group contains itself: {way}")
        if len(path) >= MOST_LEVELS:
            raise InputError(f"groups are nested more than {MOST_LEVELS} deep: {way}")
        if len(matrices) * len(one.matrices) > MOST_PLACES:
            raise InputError(f"{way}: more than {MOST_PLACES:,} places")
        every = (matrices[:, None] @ one.matrices[None]).reshape(-1, 4, 4)
        yield from _places(one.mesh, every, (*path, one.mesh))


def meshes_within(mesh: Mesh, known: dict[int, Mesh] | None = None) -> list[Mesh]:
    """All meshes of a group, each once: those that stand in another before that one, and ``mesh`` last."""
    known = {} if known is None else known
    for one in mesh.instances:
        if id(one.mesh) not in known:
            meshes_within(one.mesh, known)
    known[id(mesh)] = mesh
    return list(known.values())


def with_common_materials(meshes: Sequence[Mesh]) -> tuple[list[Mesh], list[Material]]:
    """The meshes with ids into a common list of materials, and this list; materials that are equal are one."""
    known: dict[Material, int] = {}
    ids = [np.array([known.setdefault(m, len(known)) for m in mesh.materials], np.int32) for mesh in meshes]
    materials = list(known)
    found = [
        replace(
            mesh,
            materials=materials,
            face_materials=own[mesh.face_materials],
            sphere_materials=own[mesh.sphere_materials],
        )
        for mesh, own in zip(meshes, ids, strict=True)
    ]
    return found, materials


def _shared(objects: list[Mesh], object_of: np.ndarray, matrices: np.ndarray, choice: str, source: str) -> np.ndarray:
    """(n,) bool: which places have no copy of their object."""
    linear = matrices[:, :3, :3]
    with np.errstate(all="ignore"):
        inverse = inverse_of(linear)
        squeezed = np.linalg.norm(linear, axis=(1, 2)) * np.linalg.norm(inverse, axis=(1, 2))
        largest = np.maximum(np.abs(matrices).max(axis=(1, 2)), np.abs(inverse).max(axis=(1, 2)))
        fits = (squeezed < MOST_SQUEEZED) & (largest < MOST_SCALED)
    has_spheres = np.array([len(one.spheres) > 0 for one in objects], bool)[object_of]
    is_ellipsoid = has_spheres & fits
    is_ellipsoid[is_ellipsoid] = [similarity(one) is None for one in linear[is_ellipsoid]]
    emits = np.array([bool(one.emits().any()) for one in objects], bool)[object_of]
    sizes = np.array([one.num_primitives for one in objects], np.int64)
    could = fits & ~emits
    saved = sizes[object_of[could]].sum() - sizes[np.unique(object_of[could])].sum()
    shared = could if choice == "shared" or (choice == "auto" and saved > FEW_COPIES) else is_ellipsoid
    if choice == "copied" and is_ellipsoid.any():
        raise InputError(f"{source}: a sphere would become an ellipsoid, which only the package's own bvh knows")
    if (is_ellipsoid & emits).any():
        raise InputError(f"{source}: a sphere that emits light would become an ellipsoid; use triangles for it")
    copied = int(sizes[object_of[~shared]].sum())
    if copied > MOST_COPIES:
        raise InputError(
            f"{source}: the copies of what cannot be shared have {copied:,} primitives; {MOST_COPIES:,} fit"
        )
    return shared


def _copy(mesh: Mesh, matrix: np.ndarray) -> Mesh:
    """A mesh in its place; the identity leaves every bit as it is."""
    copied = replace(mesh)
    if not (matrix == np.eye(4)).all():
        move(copied, matrix)
    return copied


def inverse_of(linear: np.ndarray) -> np.ndarray:
    """(n, 3, 3) inverse matrices, with infinity or NaN where there is none."""
    a, b, c = np.moveaxis(linear, 1, 0)  # rows
    adjugate = np.stack([np.cross(b, c), np.cross(c, a), np.cross(a, b)], axis=2)
    with np.errstate(all="ignore"):
        return adjugate / (a * adjugate[:, :, 0]).sum(axis=1)[:, None, None]


def visible_points(mesh: Mesh) -> np.ndarray:
    """(n, 3) float64: the corners of all triangles and of the boxes of all spheres that a ray can hit; n may be 0.

    Args:
        mesh: a mesh that ``clean`` returned.
    """
    is_corner = np.zeros(len(mesh.vertices), bool)
    is_corner[mesh.faces[~is_collapsed(mesh.faces)]] = True
    spheres = mesh.spheres[mesh.spheres[:, 3] > 0].astype(np.float64)
    signs = np.array(list(itertools.product((-1.0, 1.0), repeat=3)))
    corners = spheres[:, None, :3] + spheres[:, None, 3:] * signs
    return np.concatenate([mesh.vertices[is_corner].astype(np.float64), corners.reshape(-1, 3)])


def points_to_show(mesh: Mesh) -> np.ndarray:
    """(n, 3) float64: points that a camera should show to show everything, see ``geometry.visible_points``."""
    if mesh.placed is None:
        return visible_points(mesh)
    objects = [visible_points(mesh.placed.object(mesh, k)) for k in range(len(mesh.placed.faces) - 1)]
    sizes = np.array([len(points) for points in objects])
    if sizes[mesh.placed.object_of].sum() > MOST_VIEWED:
        objects = mesh.placed.boxes(mesh)
    return mesh.placed.points(objects)


def similarity(linear: np.ndarray) -> float | None:
    """The factor by which a transform multiplies all lengths; None if the factor depends on the direction."""
    gram = linear.T @ linear
    square = float(np.trace(gram)) / 3
    if not np.abs(gram - square * np.eye(3)).max() <= UNIFORM * square:
        return None
    return float(np.sqrt(square))


def reverse(mesh: Mesh) -> None:
    """Reverse the side that each triangle faces; vertex normals do not change."""
    mesh.faces = mesh.faces[:, [0, 2, 1]]
    if len(mesh.face_normals) > 0:
        mesh.face_normals = mesh.face_normals[:, [0, 2, 1]]
    for name in ("corner_uv", "corner_color"):
        if getattr(mesh, name) is not None:
            setattr(mesh, name, getattr(mesh, name)[:, [0, 2, 1]])


def move(mesh: Mesh, matrix: np.ndarray) -> None:
    """Transform vertices by a (4, 4) matrix, normals by its inverse transpose, and spheres if they stay spheres.

    If the matrix mirrors the mesh, the triangles are reversed, so that fronts stay fronts. If it presses the mesh flat,
    the normals are gone. A sphere that would become an ellipsoid disappears: its radius is 0. The poles of others, by
    which a texture lies on them, stay where they are.
    """
    linear = matrix[:3, :3]
    mesh.vertices = mesh.vertices @ linear.T + matrix[:3, 3]
    if len(mesh.spheres) > 0:
        centres, scale = mesh.spheres[:, :3] @ linear.T + matrix[:3, 3], similarity(linear) or 0.0
        mesh.spheres = np.column_stack([centres, scale * mesh.spheres[:, 3]])
    if len(mesh.normals) > 0:
        if np.linalg.det(linear) == 0:
            mesh.normals, mesh.face_normals = np.zeros((0, 3)), np.zeros((0, 3), np.int32)
        else:
            mesh.normals = mesh.normals @ np.linalg.inv(linear)
    if np.linalg.det(linear) < 0:
        reverse(mesh)


def joined(parts: Sequence[Mesh], materials: list[Material], source: str) -> Mesh:
    """One mesh of all parts, in their order, without their notes.

    Args:
        materials: of the whole; the ids of materials that the parts have are ids into this list.
        source: of the whole.
    """
    if not parts:
        return Mesh(np.zeros((0, 3)), np.zeros((0, 3), np.int32), materials=materials or [Material()], source=source)
    vertices, normals, primitives = (
        np.cumsum([0, *counts[:-1]])
        for counts in zip(*((len(p.vertices), len(p.normals), p.num_primitives) for p in parts), strict=True)
    )
    faces, corners = [], []
    for part, first, first_normal in zip(parts, vertices, normals, strict=True):
        faces.append(part.faces + first)
        ids = part.face_normals if len(part.face_normals) > 0 else np.full(part.faces.shape, -1)
        corners.append(np.where(ids < 0, -1, ids + first_normal))
    has_normals = any(len(p.face_normals) > 0 for p in parts)
    culls = [np.zeros(len(p.faces), bool) if p.face_culls is None else p.face_culls for p in parts]
    return Mesh(
        vertices=np.concatenate([p.vertices for p in parts]),
        faces=np.concatenate(faces).astype(np.int32),
        normals=np.concatenate([p.normals for p in parts]),
        face_normals=np.concatenate(corners).astype(np.int32) if has_normals else np.zeros((0, 3), np.int32),
        face_materials=np.concatenate([p.face_materials for p in parts]),
        materials=materials or [Material()],
        source=source,
        spheres=np.concatenate([p.spheres for p in parts]),
        sphere_ids=np.concatenate([p.sphere_ids + k for p, k in zip(parts, primitives, strict=True)]).astype(np.int32),
        sphere_materials=np.concatenate([p.sphere_materials for p in parts]),
        face_culls=np.concatenate(culls) if any(c.any() for c in culls) else None,
        corner_uv=_joined_corners(parts, "corner_uv", 2, 0.0),
        corner_color=_joined_corners(parts, "corner_color", 3, 1.0),
    )


def _joined_corners(parts: Sequence[Mesh], name: str, size: int, default: float) -> np.ndarray | None:
    """(F, 3, ``size``) what the corners of all parts have; None if no part has any, and the default for the others."""
    of_parts = [getattr(part, name) for part in parts]
    if all(one is None for one in of_parts):
        return None
    sizes = [(len(part.faces), 3, size) for part in parts]
    return np.concatenate([np.full(s, default) if one is None else one for one, s in zip(of_parts, sizes, strict=True)])
