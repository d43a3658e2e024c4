"""Meshes of PLY, STL, OFF and glTF files, and trimesh's own objects."""

import re
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
