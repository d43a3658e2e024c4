"""Meshes that are made of parts, each of which has its place: parts are moved, turned inside out, and joined."""

from collections.abc import Sequence

import numpy as np

from taichi_tracer.geometry import Mesh
from taichi_tracer.materials import Material


def reverse(mesh: Mesh) -> None:
    """Reverse the side that each triangle faces; vertex normals do not change."""
    mesh.faces = mesh.faces[:, [0, 2, 1]]
    if len(mesh.face_normals) > 0:
        mesh.face_normals = mesh.face_normals[:, [0, 2, 1]]


def move(mesh: Mesh, matrix: np.ndarray) -> None:
    """Transform vertices by a (4, 4) matrix, and normals by its inverse transpose.

    If the matrix mirrors the mesh, the triangles are reversed, so that fronts stay fronts.
    """
    linear = matrix[:3, :3]
    mesh.vertices = mesh.vertices @ linear.T + matrix[:3, 3]
    if len(mesh.normals) > 0:
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
    )
