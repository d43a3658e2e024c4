"""Parts of meshes: moved, turned inside out, and joined."""

import itertools
from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from taichi_tracer.formulas.first_view import Surface
from taichi_tracer.formulas.triangles import norm
from taichi_tracer.geometry import Mesh, is_collapsed
from taichi_tracer.materials import Material

# The relative deviation from a similarity that a transform may have, because its numbers are rounded.
UNIFORM = 1e-9
GROUND = Material("the ground of --ground", Kd=(0.6, 0.6, 0.6))  # of ``instances.on_ground``
POINTS, MOST_MEASURED = 30_000, 200_000  # of ``surface_of``, and triangles; of more, every second or third is used
PLASTIC = np.array([0.7548776662466927, 0.5698402909980532])  # steps of a sequence that fills a square evenly


def with_common_materials(meshes: Sequence[Mesh]) -> tuple[list[Mesh], list[Material]]:
    """The meshes with ids into a common list of materials, and this list; materials that are equal are one."""
    known: dict[Material, int] = {}
    ids = [np.array([known.setdefault(m, len(known)) for m in mesh.materials], np.int32) for mesh in meshes]
    materials = list(known)
    return [
        replace(
            mesh,
            materials=materials,
            face_materials=own[mesh.face_materials],
            sphere_materials=own[mesh.sphere_materials],
        )
        for mesh, own in zip(meshes, ids, strict=True)
    ], materials


def visible_points(mesh: Mesh) -> np.ndarray:
    """(n, 3) float64: the corners of all triangles and of the boxes of all spheres that a ray can hit; n may be 0.

    Those of ``GROUND`` are left out: a camera need not show all of it.

    Args:
        mesh: a mesh that ``clean`` returned.
    """
    is_corner = np.zeros(len(mesh.vertices), bool)
    is_ground = np.array([material.name == GROUND.name for material in mesh.materials], bool)[mesh.face_materials]
    is_corner[mesh.faces[~is_collapsed(mesh.faces) & ~is_ground]] = True
    spheres = mesh.spheres[mesh.spheres[:, 3] > 0].astype(np.float64)
    signs = np.array(list(itertools.product((-1.0, 1.0), repeat=3)))
    corners = spheres[:, None, :3] + spheres[:, None, 3:] * signs
    return np.concatenate([mesh.vertices[is_corner].astype(np.float64), corners.reshape(-1, 3)])


def surface_of(mesh: Mesh) -> Surface:
    """Points on all triangles and spheres, in proportion to their area; the same ones every time.

    What has numbers that are not finite in f32 has none, because no kernel sees it.
    """
    step = 1 + len(mesh.faces) // MOST_MEASURED
    ids, spheres = mesh.faces[::step].T, mesh.spheres.astype(np.float64)
    corners = [np.take(mesh.vertices, own, axis=0).astype(np.float64, copy=False) for own in ids]
    with np.errstate(all="ignore"):
        across = np.cross(corners[1] - corners[0], corners[2] - corners[0])
        lengths, areas = norm(across), 4 * np.pi * spheres[:, 3] ** 2
        is_finite, is_seen = (np.isfinite(np.float32(of)).all(axis=1) for of in (mesh.vertices, spheres))
        is_seen = np.concatenate([is_finite[ids[0]] & is_finite[ids[1]] & is_finite[ids[2]], is_seen])
        upto = np.cumsum(np.where(is_seen, np.concatenate([lengths / 2, areas]), 0))
    if len(upto) == 0 or not 0 < upto[-1] < np.inf:
        return Surface(np.zeros((0, 3)), np.zeros((0, 3)), np.zeros(0, bool), 0.0)
    number = np.arange(POINTS)
    of = np.minimum(np.searchsorted(upto, (number + 0.5) / POINTS * upto[-1]), len(upto) - 1)
    u, v = (number[:, None] * PLASTIC % 1).T
    points, normals, is_sphere = np.empty((POINTS, 3)), np.empty((POINTS, 3)), of >= len(lengths)
    sphere, z, azimuth = spheres[of[is_sphere] - len(lengths)], 1 - 2 * u[is_sphere], 2 * np.pi * v[is_sphere]
    sine = np.sqrt(1 - z * z)
    normals[is_sphere] = np.stack([sine * np.cos(azimuth), sine * np.sin(azimuth), z], axis=1)
    points[is_sphere] = sphere[:, :3] + sphere[:, 3:] * normals[is_sphere]
    row, root = of[~is_sphere], np.sqrt(u[~is_sphere])[:, None]
    a, b, c = (corner[row] for corner in corners)
    points[~is_sphere] = a + root * (b - a + v[~is_sphere, None] * (c - b))
    normals[~is_sphere] = across[row] / lengths[row, None]
    emits, triangles = mesh.emits(), len(mesh.faces)
    emits = np.concatenate([emits[:triangles:step], emits[triangles:]])
    return Surface(points, normals, emits[of], float(upto[-1]))


def similarities(linear: np.ndarray) -> np.ndarray:
    """(n,) the factors by which (n, 3, 3) transforms multiply all lengths; NaN if one depends on the direction."""
    gram = linear.transpose(0, 2, 1) @ linear
    square = np.trace(gram, axis1=1, axis2=2) / 3
    off = np.abs(gram - square[:, None, None] * np.eye(3)).max(axis=(1, 2))
    return np.where(off <= UNIFORM * square, np.sqrt(square), np.nan)


def reverse(mesh: Mesh) -> None:
    """Reverse the side that each triangle faces; vertex normals do not change."""
    mesh.faces = mesh.faces[:, [0, 2, 1]]
    if len(mesh.face_normals) > 0:
        mesh.face_normals = mesh.face_normals[:, [0, 2, 1]]
    for name in ("corner_uv", "corner_color"):
        if getattr(mesh, name) is not None:
            setattr(mesh, name, getattr(mesh, name)[:, [0, 2, 1]])


def moved(mesh: Mesh, matrix: np.ndarray) -> Mesh:
    """``mesh`` transformed by a (4, 4) matrix; its normals by the inverse transpose, its spheres if they stay spheres.

    If the matrix mirrors the mesh, the triangles are reversed, so that fronts stay fronts. If it presses the mesh flat,
    the normals are gone. A sphere that would become an ellipsoid disappears: its radius is 0. The poles of others, by
    which a texture lies on them, stay where they are. The identity leaves every bit as it is.
    """
    mesh = replace(mesh)
    if (matrix == np.eye(4)).all():
        return mesh
    linear = matrix[:3, :3]
    mesh.vertices = mesh.vertices @ linear.T + matrix[:3, 3]
    if len(mesh.spheres) > 0:
        centres, scale = mesh.spheres[:, :3] @ linear.T + matrix[:3, 3], np.nan_to_num(similarities(linear[None])[0])
        mesh.spheres = np.column_stack([centres, scale * mesh.spheres[:, 3]])
    if len(mesh.normals) > 0:
        if np.linalg.det(linear) == 0:
            mesh.normals, mesh.face_normals = np.zeros((0, 3)), np.zeros((0, 3), np.int32)
        else:
            mesh.normals = mesh.normals @ np.linalg.inv(linear)
    if np.linalg.det(linear) < 0:
        reverse(mesh)
    return mesh


def inverse_of(linear: np.ndarray) -> np.ndarray:
    """(n, 3, 3) inverse matrices, with infinity or NaN where there is none."""
    a, b, c = np.moveaxis(linear, 1, 0)  # rows
    adjugate = np.stack([np.cross(b, c), np.cross(c, a), np.cross(a, b)], axis=2)
    with np.errstate(all="ignore"):
        return adjugate / (a * adjugate[:, :, 0]).sum(axis=1)[:, None, None]


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
