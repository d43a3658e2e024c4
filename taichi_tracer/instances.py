"""One mesh in several places: instances, and groups of them (RT-12).

A group is a ``Mesh`` with ``instances``: other meshes, each with the transforms that put it into its places. They may
be groups, too. ``resolve_instances`` composes all transforms of such a tree: then there are objects, and their places.
The triangles of an object are in memory once, unless copies of them are small, or are needed.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from taichi_tracer.formulas.view import FROM, box_of, view_of_points, world_axes
from taichi_tracer.geometry import Mesh, check, smoothed
from taichi_tracer.materials import Material
from taichi_tracer.meshes.parts import (
    GROUND,
    inverse_of,
    joined,
    moved,
    similarities,
    visible_points,
    with_common_materials,
)
from taichi_tracer.system.errors import InputError, one_of

CHOICES = ("auto", "shared", "copied")
GROUND_SIZE, GAP = 20.0, 1e-4  # half of the side of a ground, and how far it lies under the mesh, in its diameters
# Copies of all objects together may have so many primitives more than the objects: this is 260 MB, and the rays of a
# scene without instances are faster.
FEW_COPIES = 2_000_000
MOST_COPIES = 20_000_000  # copies must not fill the memory
MOST_PLACES = 10_000_000
MOST_IDS = 2**31 - 1
# |M| |M⁻¹| of a transform that squeezes more is near that of a plane: its inverse in f32 would be noise.
MOST_SQUEEZED = 1e5
MOST_SCALED = 1e15  # the largest number of a transform or of its inverse: products of f32 stay finite
MOST_VIEWED = 2_000_000  # points that are looked at one by one, to find a camera that shows all of them


@dataclass
class Instances:
    """A mesh that stands in several places.

    Attributes:
        mesh: the mesh, which may have instances itself.
        transforms: (n, 4, 4) or (4, 4) matrices from the mesh to its places, afterwards float64: any that moves, turns,
            scales, shears or mirrors. A mirrored front stays a front.
    """

    mesh: Mesh
    transforms: Any

    def __post_init__(self) -> None:
        if not isinstance(self.mesh, Mesh):
            raise InputError(f"Instances: the mesh must be a Mesh, not {type(self.mesh).__name__}")
        try:
            matrices = np.array(self.transforms, np.float64).reshape(-1, 4, 4)
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

    def __repr__(self) -> str:
        return f"Instances({self.mesh!r}, {len(self.transforms):,} places)"


@dataclass(frozen=True)
class Placed:
    """Where the objects of a mesh stand. The primitives of all objects follow each other in the mesh.

    The primitives of all places are numbered together: those of the first place come first, in the order of its object.

    Attributes:
        faces, spheres, primitives: (K + 1,) the rows at which the objects begin, and after which the last one ends.
        object_of: (n,) the object of each place.
        matrices: (n, 3, 4) float64, from the object to the place.
    """

    faces: np.ndarray
    spheres: np.ndarray
    primitives: np.ndarray
    object_of: np.ndarray
    matrices: np.ndarray

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
            found.append((points @ own[:, :, :3].transpose(0, 2, 1) + own[:, None, :, 3]).reshape(-1, 3))
        return np.concatenate(found)

    def boxes(self, mesh: Mesh) -> list[np.ndarray]:
        """The 8 corners of the box of each object of a mesh; (0, 3) for one that nothing can hit."""
        found = []
        for number in range(len(self.faces) - 1):
            points = visible_points(self.object(mesh, number))
            sides = np.stack(box_of(points)) if len(points) > 0 else points
            found.append(np.stack(np.meshgrid(*sides.T, indexing="ij"), axis=-1).reshape(-1, 3))
        return found

    def object(self, mesh: Mesh, number: int) -> Mesh:
        """The triangles and spheres of one object, without its materials, normals and colours."""
        faces = mesh.faces[self.faces[number] : self.faces[number + 1]]
        spheres = mesh.spheres[self.spheres[number] : self.spheres[number + 1]]
        return Mesh(mesh.vertices, faces, spheres=spheres)


def group(parts: "Sequence[Mesh | Instances]", source: str = "group") -> Mesh:
    """One mesh of meshes and of ``Instances``: a scene, or a part of one that stands in several places itself.

    The primitives are numbered in this order: those of the meshes; then those in the first place of the first
    ``Instances``, with all that is in it, those in its second place, and so on.

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


def assemble(placed: Sequence[tuple[Mesh, np.ndarray]], source: str) -> Mesh:
    """One mesh of all parts, in their order; with ``instances``, if there are many triangles several times.

    Args:
        placed: each part with its (4, 4) transform; a part in several places is the same object.
    """
    parts = {id(mesh): mesh for mesh, _ in placed}
    colored, materials = with_common_materials(list(parts.values()))
    parts = dict(zip(parts, colored, strict=True))
    copies = sum(len(mesh.faces) for mesh, _ in placed) - sum(len(part.faces) for part in colored)
    if copies > FEW_COPIES:
        return group([Instances(parts[id(mesh)], transform) for mesh, transform in placed], source)
    return joined([moved(parts[id(mesh)], transform) for mesh, transform in placed], materials, source)


def resolve_instances(mesh: Mesh, smooth: bool | float = False, choice: str = "auto") -> Mesh:
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
    found: list[Mesh] = []
    object_of, matrices = _places(mesh, (mesh,), found, {})
    distinct = meshes_within(mesh)
    for one in distinct:
        check(one)
    notes = [note for one in distinct for note in one.notes]
    if any(one.lights for one in distinct if one is not mesh):
        notes.append(f"{mesh.source}: lights in files of meshes that stand in several places are left out")
    objects, materials = with_common_materials([smoothed(one, smooth) for one in found])
    shared = _shared(objects, object_of, matrices, choice, mesh.source)
    whole = _with_copies(objects, object_of, matrices, shared, materials, mesh.source)
    return replace(whole, notes=notes, lights=mesh.lights)


def _places(
    mesh: Mesh, path: tuple[Mesh, ...], objects: list[Mesh], known: dict[int, tuple[np.ndarray, np.ndarray]]
) -> tuple[np.ndarray, np.ndarray]:
    """For all places in a group, in order: the number of the object, and its (4, 4) transform.

    Args:
        path: the groups around the mesh, and the mesh. objects: gets the meshes that have primitives.
        known: the results for meshes that were met before, by identity.

    Raises:
        InputError: a group contains itself, or is too large.
    """
    count = int(mesh.num_primitives > 0)
    found = [(np.full(count, len(objects)), np.tile(np.eye(4), (count, 1, 1)))]
    objects += [mesh] * count
    for one in mesh.instances:
        way = " → ".join(part.source for part in (*path, one.mesh))
        if any(part is one.mesh for part in path):
            raise InputError(f"a group contains itself: {way}")
        if id(one.mesh) not in known:
            known[id(one.mesh)] = _places(one.mesh, (*path, one.mesh), objects, known)
        inner, within = known[id(one.mesh)]
        count += len(one.transforms) * len(inner)
        if count > MOST_PLACES:
            raise InputError(f"{way}: more than {MOST_PLACES:,} places")
        found.append((np.tile(inner, len(one.transforms)), (one.transforms[:, None] @ within).reshape(-1, 4, 4)))
    object_of, matrices = zip(*found, strict=True)
    return np.concatenate(object_of), np.concatenate(matrices)


def _with_copies(
    objects: list[Mesh],
    object_of: np.ndarray,
    matrices: np.ndarray,
    shared: np.ndarray,
    materials: list[Material],
    source: str,
) -> Mesh:
    """One mesh of copies, and of the objects that are shared; beside these, each copy is an object of its own."""
    copies = [moved(objects[number], at) for number, at in zip(object_of[~shared], matrices[~shared], strict=True)]
    kept = np.unique(object_of[shared])
    parts = [*copies, *(objects[k] for k in kept)]
    whole = joined(parts, materials, source)
    if len(kept) > 0:
        counts = np.array([(len(part.faces), len(part.spheres), part.num_primitives) for part in parts])
        faces, spheres, primitives = np.concatenate([np.zeros((1, 3), int), counts.cumsum(axis=0)]).T
        number = len(copies) + np.searchsorted(kept, object_of)
        number[~shared], matrices[~shared] = np.arange(len(copies)), np.eye(4)
        whole.placed = Placed(faces, spheres, primitives, number.astype(np.int32), matrices[:, :3])
        if (count := whole.placed.starts[-1]) > MOST_IDS:
            raise InputError(f"{source}: {count:,} primitives in all places, and ids end at {MOST_IDS:,}")
    return whole


def meshes_within(mesh: Mesh, known: dict[int, Mesh] | None = None) -> list[Mesh]:
    """All meshes of a group, each once: those that stand in another before that one, and ``mesh`` last."""
    known = {} if known is None else known
    for one in mesh.instances:
        if id(one.mesh) not in known:
            meshes_within(one.mesh, known)
    known[id(mesh)] = mesh
    return list(known.values())


def _shared(objects: list[Mesh], object_of: np.ndarray, matrices: np.ndarray, choice: str, source: str) -> np.ndarray:
    """(n,) bool: which places have no copy of their object."""
    linear = matrices[:, :3, :3]
    with np.errstate(all="ignore"):
        inverse = inverse_of(linear)
        squeezed = np.linalg.norm(linear, axis=(1, 2)) * np.linalg.norm(inverse, axis=(1, 2))
        largest = np.maximum(np.abs(matrices).max(axis=(1, 2)), np.abs(inverse).max(axis=(1, 2)))
        fits = (squeezed < MOST_SQUEEZED) & (largest < MOST_SCALED)
    has_spheres = np.array([len(one.spheres) > 0 for one in objects], bool)[object_of]
    is_ellipsoid = has_spheres & fits & np.isnan(similarities(linear))
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


def on_ground(mesh: Mesh, up_axis: str) -> Mesh:
    """``mesh`` and a large diffuse square under it; a material that its file does not name is as grey as the square.

    Args:
        up_axis: which axis points upwards, "y" or "z".
    """
    points = points_to_show(resolve_instances(mesh))
    with np.errstate(over="ignore"):
        points = points[np.isfinite(np.float32(points)).all(axis=1)]  # nothing is cleaned yet
    if len(points) == 0:
        return mesh
    low, high = box_of(points)
    axes = world_axes(up_axis)
    side, up, front = axes.T
    size = float(np.linalg.norm(high - low))
    middle = (low + high) / 2
    middle += up * (float((points @ up).min()) - GAP * size - float(middle @ up))
    corners = [middle + GROUND_SIZE * size * (x * side + z * front) for x, z in ((-1, 1), (1, 1), (1, -1), (-1, -1))]
    ground = Mesh(np.array(corners), np.array([[0, 1, 2], [0, 2, 3]], np.int32), materials=[GROUND])
    grey = [replace(one, Kd=GROUND.Kd) if one.name == Material.name else one for one in mesh.materials]
    parts, materials = with_common_materials([replace(mesh, materials=grey), ground])
    whole = joined(parts, materials, mesh.source)
    return replace(whole, instances=mesh.instances, lights=mesh.lights, notes=mesh.notes, dropped=mesh.dropped)


def points_to_show(mesh: Mesh) -> np.ndarray:
    """(n, 3) float64: points that a camera should show to show everything, see ``meshes.parts.visible_points``."""
    if mesh.placed is None:
        return visible_points(mesh)
    objects = [visible_points(mesh.placed.object(mesh, k)) for k in range(len(mesh.placed.faces) - 1)]
    sizes = np.array([len(points) for points in objects])
    if sizes[mesh.placed.object_of].sum() > MOST_VIEWED:
        objects = mesh.placed.boxes(mesh)
    return mesh.placed.points(objects)


def view_of_mesh(
    mesh: Mesh, up_axis: str, aspect: float = 1.0, seen_from: tuple[float, float] = FROM
) -> dict[str, Any]:
    """``view_of_points`` of all that a mesh shows."""
    return view_of_points(points_to_show(mesh), up_axis, aspect=aspect, seen_from=seen_from)
