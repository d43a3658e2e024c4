"""Meshes that trimesh reads (PLY, STL, glTF, OFF), and trimesh's own objects."""

import json
import struct
from pathlib import Path

import numpy as np

from taichi_tracer.errors import InputError
from taichi_tracer.files.text import read_bytes
from taichi_tracer.geometry import Mesh
from taichi_tracer.materials import Material

EXTENSIONS = (".ply", ".stl", ".glb", ".gltf", ".off")


def read_mesh(path: str | Path) -> Mesh:
    """Read a PLY, STL, GLB, glTF or OFF file. Vertex normals are those of the file; none are made up.

    Raises:
        InputError: the file is damaged, or holds no triangles that trimesh understands.
    """
    import trimesh  # half a second where scipy is installed

    path = Path(path)
    read_bytes(path)
    try:
        loaded = trimesh.load(path, process=False, maintain_order=True)
    except Exception as error:  # trimesh lets whatever its readers meet escape
        reason = " ".join(str(error).split()) or type(error).__name__
        raise InputError(f"{path}: cannot be read as {path.suffix[1:].upper()} ({reason[:200]})") from None
    strengths = _emission_strengths(path) if path.suffix.lower() in (".glb", ".gltf") else {}
    return from_trimesh(loaded, source=str(path), emission_strengths=strengths)


def from_trimesh(loaded, source: str = "mesh", emission_strengths: dict[str, float] | None = None) -> Mesh:
    """The triangles of a ``trimesh.Trimesh`` or of every node of a ``trimesh.Scene``, transforms applied.

    Args:
        loaded: the trimesh object.
        source: for messages.
        emission_strengths: material name → factor on its emission (KHR_materials_emissive_strength).
    """
    parts = [(loaded, np.eye(4))]
    if hasattr(loaded, "geometry"):
        placed = [loaded.graph[node] for node in loaded.graph.nodes_geometry]
        parts = [(loaded.geometry[name], transform) for transform, name in placed]
    parts = [(part, transform) for part, transform in parts if len(getattr(part, "faces", ())) > 0]
    notes: list[str] = []
    materials: list[Material] = []
    pieces = [_piece(part, transform, materials, emission_strengths or {}, notes, source) for part, transform in parts]
    if not pieces:
        return Mesh(np.zeros((0, 3)), np.zeros((0, 3), np.int32), source=source, notes=notes)

    vertex_counts = [len(piece["vertices"]) for piece in pieces]
    normal_counts = [len(piece["normals"]) for piece in pieces]
    faces, face_normals = [], []
    for i, piece in enumerate(pieces):
        faces.append(piece["faces"] + sum(vertex_counts[:i]))
        own = piece["faces"] + sum(normal_counts[:i])
        face_normals.append(own if normal_counts[i] > 0 else np.full_like(own, -1))
    has_normals = sum(normal_counts) > 0
    return Mesh(
        vertices=np.concatenate([piece["vertices"] for piece in pieces]),
        faces=np.concatenate(faces).astype(np.int32),
        normals=np.concatenate([piece["normals"] for piece in pieces]),
        face_normals=np.concatenate(face_normals).astype(np.int32) if has_normals else np.zeros((0, 3), np.int32),
        face_materials=np.concatenate([piece["material_ids"] for piece in pieces]).astype(np.int32),
        materials=materials or [Material()],
        source=source,
        notes=notes,
    )


def _piece(part, transform: np.ndarray, materials: list, strengths: dict, notes: list, source: str) -> dict:
    """The arrays of one trimesh in world space; its material is appended to ``materials`` unless it is there."""
    linear = np.asarray(transform, np.float64)[:3, :3]
    vertices = np.asarray(part.vertices, np.float64) @ linear.T + transform[:3, 3]
    faces = np.asarray(part.faces, np.int64)
    # trimesh computes vertex normals on demand; in its cache are those that were given.
    normals = np.zeros((0, 3))
    if "vertex_normals" in part._cache.cache:
        determinant = np.linalg.det(linear)
        if determinant != 0:
            normals = np.asarray(part.vertex_normals, np.float64) @ (np.linalg.inv(linear) * np.sign(determinant))
            lengths = np.linalg.norm(normals, axis=1, keepdims=True)
            normals = normals / np.where(lengths > 0, lengths, 1)
    if np.linalg.det(linear) < 0:  # a mirror turns fronts into backs; the normals above follow it
        faces = faces[:, ::-1]
        normals = -normals
    if getattr(part.visual, "kind", None) in ("vertex", "face"):
        notes.append(f"{source}: its colours per {part.visual.kind} are not used")
    material = _material(getattr(part.visual, "material", None), strengths)
    if material not in materials:
        materials.append(material)
    return {
        "vertices": vertices,
        "faces": faces,
        "normals": normals,
        "material_ids": np.full(len(faces), materials.index(material)),
    }


def _material(visual, strengths: dict[str, float]) -> Material:
    """A diffuse ``Material`` from trimesh's PBR or simple one."""
    if visual is None:
        return Material()
    name = getattr(visual, "name", None) or "default"
    if hasattr(visual, "baseColorFactor"):
        emission = visual.emissiveFactor
        strength = strengths.get(name, 1.0)
        return Material(
            name=name,
            Kd=_color(visual.baseColorFactor, (1.0, 1.0, 1.0)),
            Ke=tuple(strength * e for e in _color(emission, (0.0, 0.0, 0.0))),
        )
    return Material(name=name, Kd=_color(getattr(visual, "diffuse", None), (0.8, 0.8, 0.8)))


def _color(value, default: tuple[float, float, float]) -> tuple[float, float, float]:
    """Three numbers in [0, 1] from what may be None, bytes or floats, with or without alpha."""
    if value is None:
        return default
    color = np.asarray(value)
    scale = 1 / 255 if color.dtype.kind in "iu" else 1.0
    return tuple(float(c) * scale for c in color[:3])


def _emission_strengths(path: Path) -> dict[str, float]:
    """Material name → KHR_materials_emissive_strength of a glTF file, which trimesh drops."""
    raw = read_bytes(path)
    if raw[:4] == b"glTF":  # header of 12 bytes, then the length and type of the JSON chunk
        (length,) = struct.unpack_from("<I", raw, 12)
        raw = raw[20 : 20 + length]
    extension = "KHR_materials_emissive_strength"
    return {
        material.get("name", "default"): float(material["extensions"][extension].get("emissiveStrength", 1.0))
        for material in json.loads(raw).get("materials", [])
        if extension in material.get("extensions", {})
    }
