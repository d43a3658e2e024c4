"""Meshes of PLY, STL, OFF and glTF files, of trimesh's objects, and of arrays with their colours and materials."""

import re
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from taichi_tracer.files.images import linear_colors, linear_from_srgb
from taichi_tracer.files.readers.gltf import read_gltf
from taichi_tracer.files.readers.ply import read_ply
from taichi_tracer.geometry import Mesh, check
from taichi_tracer.instances import assemble
from taichi_tracer.materials import Material, Texture
from taichi_tracer.meshes.polygons import triangulate
from taichi_tracer.system.errors import InputError

STL_START, STL_TRIANGLE = 84, np.dtype([("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("attribute", "<u2")])
STL_VERTEX = re.compile(rb"\bvertex\s+(\S+)\s+(\S+)\s+(\S+)", re.IGNORECASE)
OFF_START = re.compile(rb"\s*([A-Z]*OFF)", re.IGNORECASE)


def _read_stl(raw: bytes, path: Path, notes: list[str]) -> Mesh:
    """A binary STL, whose length says so, or a text."""
    count = int.from_bytes(raw[STL_START - 4 : STL_START], "little")
    rest = len(raw) - STL_START - count * STL_TRIANGLE.itemsize
    if raw.lstrip()[:5].lower() == b"solid" and (rest < 0 or len(raw) < STL_START):
        if b"endsolid" not in raw.lower():
            raise InputError("the file is cut short: endsolid is missing")
        corners = np.array(STL_VERTEX.findall(raw), np.float64).reshape(-1, 3, 3)
    else:
        if len(raw) < STL_START or rest < 0:
            raise InputError(f"the file is cut short: its header announces {count} triangles")
        if rest > 0:
            notes.append(f"{rest} bytes after the last triangle are not read")
        corners = np.frombuffer(raw, STL_TRIANGLE, count, STL_START)["corners"]
    points = corners.reshape(-1, 3).astype(np.float64)
    return Mesh(points, np.arange(len(points), dtype=np.int32).reshape(-1, 3), source=str(path))


def _read_off(raw: bytes, path: Path, notes: list[str]) -> Mesh:
    """An OFF file: the counts of vertices and faces, the vertices, and the faces, each with its number of corners."""
    text = re.sub(rb"#[^\n]*", b"", raw)
    start = OFF_START.match(text)
    if start is None:
        raise InputError("it must begin with OFF")
    lines = [line.split() for line in text[start.end() :].splitlines() if line.strip()]
    vertices, faces = (int(word) for word in lines[0][:2])
    rows = [lines[1 + vertices + face] for face in range(faces)]
    points = np.array([line[:3] for line in lines[1 : 1 + vertices]], np.float64).reshape(-1, 3)
    polygons = [np.array(row[1 : 1 + int(row[0])], np.int64) for row in rows]
    ids = np.concatenate([np.zeros(0, np.int64), *polygons])
    corners, _ = triangulate(points, np.array([int(row[0]) for row in rows], np.int64), ids)
    return Mesh(points, ids[corners].astype(np.int32), source=str(path))


READERS = {".ply": read_ply, ".stl": _read_stl, ".glb": read_gltf, ".gltf": read_gltf, ".off": _read_off}


# ── trimesh ──


def from_trimesh(mesh_or_scene) -> Mesh:
    """The triangles of a ``trimesh.Trimesh``, or of every node of a ``trimesh.Scene`` with its transform applied.

    Vertex normals are used if the user has set them. trimesh also computes normals when a program reads them. Those are
    not used, because reading the normals of a mesh should not make it smooth.
    """
    if not hasattr(mesh_or_scene, "geometry") and not hasattr(mesh_or_scene, "faces"):
        raise InputError(f"mesh: a trimesh.Trimesh or a trimesh.Scene is needed, not {type(mesh_or_scene).__name__}")
    import trimesh

    scene = mesh_or_scene if hasattr(mesh_or_scene, "geometry") else trimesh.Scene(mesh_or_scene)
    nodes = [scene.graph[node] for node in scene.graph.nodes_geometry]
    placed = [(scene.geometry[name], np.asarray(transform, np.float64)) for transform, name in nodes]
    placed = [(mesh, transform) for mesh, transform in placed if len(getattr(mesh, "faces", ())) > 0]
    looks: dict[int, Material] = {}  # by the identity of trimesh's material, so that each picture is one texture
    parts = {id(mesh): _part(mesh, looks) for mesh, _ in placed}
    return assemble([(parts[id(mesh)], transform) for mesh, transform in placed], "mesh")


def _normals_were_set(mesh) -> bool:
    """Whether the vertex normals of a mesh differ from those that trimesh computes."""
    if "vertex_normals" not in mesh._cache:
        return False
    computed = mesh.copy(include_cache=False).vertex_normals
    return not np.array_equal(mesh.vertex_normals, computed)


def _part(mesh, looks: dict[int, Material]) -> Mesh:
    """A ``trimesh.Trimesh``; ``looks`` has the materials that are known."""
    part = Mesh(np.asarray(mesh.vertices, np.float64), np.asarray(mesh.faces, np.int64), source="mesh")
    check(part)
    if _normals_were_set(mesh):
        part.normals, part.face_normals = np.asarray(mesh.vertex_normals, np.float64), part.faces
    look, uv = getattr(mesh.visual, "material", None), getattr(mesh.visual, "uv", None)
    material = looks.setdefault(id(look), _material(look)) if id(look) not in looks else looks[id(look)]
    part.corner_color = _corner_colors(mesh)
    if part.corner_color is not None and material == Material():
        material = Material(Kd=(1.0, 1.0, 1.0))
    if material.textures and uv is not None:
        part.corner_uv = np.asarray(uv, np.float64)[:, :2][part.faces]
    part.materials = [material]
    return part


def _material(look: Any) -> Material:
    """A diffuse ``Material``, made of the material of trimesh, with its picture; trimesh's placeholder is none."""
    from trimesh.visual.material import empty_material

    image = getattr(look, "image", None) or getattr(look, "baseColorTexture", None)
    if look is None or (image is not None and np.array_equal(np.asarray(image), np.asarray(empty_material().image))):
        return Material()
    is_pbr = hasattr(look, "baseColorFactor")
    kd = (
        _color(look.baseColorFactor, (1.0, 1.0, 1.0)) if is_pbr else _color(getattr(look, "diffuse", None), Material.Kd)
    )
    ke = _color(getattr(look, "emissiveFactor", None), Material.Ke)
    pixels = None if image is None else linear_from_srgb(np.asarray(image.convert("RGB"), np.float32) / 255)
    picture = None if pixels is None else Texture(pixels.astype(np.float32))
    return Material(name=getattr(look, "name", None) or "default", Kd=kd, Ke=ke, map_Kd=picture)


def _corner_colors(mesh) -> np.ndarray | None:
    """(F, 3, 3) linear colours of the corners of a ``trimesh.Trimesh``, whose own are sRGB; None if it has none."""
    visual, faces = mesh.visual, np.asarray(mesh.faces, np.int64)
    given = getattr(visual, "vertex_attributes", {}).get("color")
    if given is None and getattr(visual, "kind", None) in ("vertex", "face"):
        given = visual.vertex_colors if visual.kind == "vertex" else visual.face_colors
    if given is None:
        return None
    colors = linear_colors(np.asarray(given)[:, :3])
    return np.repeat(colors[:, None], 3, axis=1) if getattr(visual, "kind", None) == "face" else colors[faces]


def _color(value, default: tuple[float, float, float]) -> tuple[float, float, float]:
    """Three numbers in [0, 1] from None, bytes or floats, with or without alpha."""
    if value is None:
        return default
    color = np.asarray(value)
    steps = 255 if color.dtype.kind in "iu" else 1
    return tuple(float(c) / steps for c in color[:3])


# ── arrays ──


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
