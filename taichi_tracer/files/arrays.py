"""Meshes from the arrays of a program, with the colours, materials and normals that it gives."""

from dataclasses import replace

import numpy as np

from taichi_tracer.geometry import Mesh, check
from taichi_tracer.materials import Material
from taichi_tracer.system.errors import InputError


def mesh_from_arrays(vertices, faces) -> Mesh:
    """A ``Mesh`` with one material from (V, 3) and (F, 3) arrays or lists."""
    vertices, ids = numbers("vertices", vertices).astype(np.float64), numbers("faces", faces)
    if ids.dtype.kind not in "iu":
        raise InputError(f"mesh: faces must be integers, not {ids.dtype}")
    return Mesh(vertices=vertices, faces=ids.astype(np.int64), source="mesh")


def with_appearance(mesh: Mesh, color=None, material=None, normals=None, face_materials=None, uv=None) -> Mesh:
    """``mesh`` with other materials or normals; arguments as for ``scene_data.scene_from_mesh``."""
    check(mesh)
    changed: dict = {}
    if color is not None and material is not None:
        raise InputError("mesh: give color or material, not both: Kd of a Material is its colour")
    if color is not None:
        changed["materials"] = [Material(Kd=tuple(row)) for row in colors(color).tolist()]
    if material is not None:
        several = list(material) if isinstance(material, (list, tuple)) else [material]
        if not several or not all(isinstance(one, Material) for one in several):
            raise InputError(f"mesh: material must be a Material, or a list of them, not {material!r}")
        changed["materials"] = several
    if changed or face_materials is not None:
        count = len(changed.get("materials", mesh.materials))
        changed["face_materials"] = material_ids(face_materials, len(mesh.faces), count)
    if normals is not None:
        rows = of_corners("normals", normals, 3, mesh)
        ids = mesh.faces if rows.ndim == 2 else np.arange(3 * len(mesh.faces)).reshape(-1, 3)
        changed["normals"], changed["face_normals"] = rows.reshape(-1, 3), ids.astype(np.int32)
    if uv is not None:
        rows = of_corners("uv", uv, 2, mesh)
        changed["corner_uv"] = rows[mesh.faces] if rows.ndim == 2 else rows
    return replace(mesh, **changed)


def colors(given) -> np.ndarray:
    """(M, 3) numbers from 0 to 1, from three numbers or several rows of them."""
    rows = numbers("color", given)
    if rows.shape[-1:] != (3,) or rows.ndim > 2 or len(rows) == 0:
        raise InputError(f"mesh: color must be three numbers, or have the shape (m, 3), not {rows.shape}")
    wrong = rows[~((rows >= 0) & (rows <= 1))]
    if len(wrong) > 0:
        advice = ": divide colours of 8 bits by 255" if wrong[0] > 1 else ""
        raise InputError(f"mesh: color must be numbers from 0 to 1, not {wrong[0]:g}{advice}")
    return rows.reshape(-1, 3)


def material_ids(given, triangles: int, count: int) -> np.ndarray:
    """(F,) int32 ids into ``count`` materials; without any, all triangles have the only material."""
    if given is None:
        if count > 1:
            raise InputError(f"mesh: {count} materials need face_materials, the id of one of them for each triangle")
        return np.zeros(triangles, np.int32)
    ids = numbers("face_materials", given)
    if ids.size > 0 and ids.dtype.kind not in "iu":
        raise InputError(f"mesh: face_materials must be whole numbers, not {ids.dtype}")
    return ids.astype(np.int32)


def of_corners(name: str, given, width: int, mesh: Mesh) -> np.ndarray:
    """(V, width) or (F, 3, width) finite float64: numbers of vertices or of corners; an InputError for others."""
    rows, (v, f) = numbers(name, given), (len(mesh.vertices), len(mesh.faces))
    if rows.shape not in ((v, width), (f, 3, width)):
        known = f"({v}, {width}), one per vertex, or ({f}, 3, {width}), one per corner"
        raise InputError(f"mesh: {name} must have the shape {known}, not {rows.shape}")
    if not np.isfinite(rows).all():
        raise InputError(f"mesh: {name} must be finite numbers, not {rows[~np.isfinite(rows)][0]}")
    return rows.astype(np.float64)


def numbers(name: str, given) -> np.ndarray:
    """An array of real numbers; an InputError if it is something else."""
    array = np.asarray(given)
    if array.dtype.kind not in "iuf":
        raise InputError(f"mesh: {name} must be an array of numbers, not {type(given).__name__} of {array.dtype}")
    return array
