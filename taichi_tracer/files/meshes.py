"""Meshes that the library trimesh reads (PLY, STL, glTF, OFF), and trimesh's own objects."""

import io
import re
import struct
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from taichi_tracer.files.disk import check_is_file, read_bytes
from taichi_tracer.files.gltf import FAN_MARK, USED, fan_of, numbered
from taichi_tracer.files.ply import plain_triangles, without_strips
from taichi_tracer.files.srgb import linear_from_srgb
from taichi_tracer.geometry import Mesh, check
from taichi_tracer.instances import FEW_COPIES, Instances, group
from taichi_tracer.materials import Material
from taichi_tracer.mesh_parts import joined, move
from taichi_tracer.system.errors import InputError
from taichi_tracer.textures import BASE, Texture

EXTENSIONS = (".ply", ".stl", ".glb", ".gltf", ".off")
STL_HEADER, STL_TRIANGLE = 80, 50  # bytes
OFF_HEADER = 4096  # bytes after the first line of an OFF file in which the counts must stand, after any comments
COLOURS_NOT_USED = "colours are not used"
REASONS = {AssertionError: "a buffer is shorter than it says", RecursionError: "it is nested too deeply"}
LONGEST_REASON = 200  # characters of trimesh's own message that are shown


def read_mesh(path: str | Path) -> Mesh:
    """Read a PLY, STL, GLB, glTF or OFF file. Vertex normals are read from the file and never computed.

    Raises:
        InputError: the file is damaged, or trimesh finds no triangles in it.
    """
    path = Path(path)
    raw = read_bytes(path)
    kind = path.suffix[1:].lower()
    plain = plain_triangles(raw) if kind == "ply" else None
    if plain is not None:
        return Mesh(*plain, source=str(path))
    materials: list[Material] = []
    lights: list[tuple[str, dict]] = []
    notes: list[str] = []
    try:
        if not raw.strip():
            raise InputError("the file is empty")
        if kind in ("glb", "gltf"):
            raw, materials, lights = numbered(raw, notes)
        if kind == "ply":
            raw = without_strips(raw)
        announced = ANNOUNCED[kind](raw) if kind in ANNOUNCED else 0
        parts = _placed(_load(raw, path))
        if kind == "off" and _has_colours(raw):
            notes.append(COLOURS_NOT_USED)
    except Exception as error:  # trimesh passes on all kinds of errors
        reason = " ".join(str(error).split()) or REASONS.get(type(error), type(error).__name__)
        if "unexpected length" in reason:  # in a binary PLY, trimesh gives all polygons the size of the first
            reason = "it is cut short, or mixes triangles with larger polygons: export it with triangles only"
        raise InputError(f"{path}: cannot be read as {kind.upper()} ({reason[:LONGEST_REASON]})") from None
    told = [f"{path}: {note}" for note in notes]
    mesh = _assemble(parts, str(path), materials, told, is_linear=kind in ("glb", "gltf"))
    mesh.lights = lights
    if len(mesh.faces) < announced:
        raise InputError(f"{path}: the file is cut short: it announces {announced} faces and has {len(mesh.faces)}")
    if len(mesh.faces) == 0 and not mesh.instances:
        raise InputError(f"{path}: the file has no triangles")
    return mesh


def _announced_by_stl(raw: bytes) -> int:
    """The number of triangles in the header of a binary STL, 0 for a text; trimesh would guess missing triangles."""
    is_text = raw.lstrip()[:5].lower() == b"solid"
    if len(raw) >= STL_HEADER + 4:
        (count,) = struct.unpack_from("<I", raw, STL_HEADER)
        if len(raw) >= STL_HEADER + 4 + count * STL_TRIANGLE:
            return count
        if not is_text:
            raise InputError(f"the file is cut short: it announces {count} triangles")
    if not is_text:
        raise InputError("the file is too short for a header")
    if b"endsolid" not in raw.lower():
        raise InputError("the file is cut short: endsolid is missing")
    return 0


def _announced_by_ply(raw: bytes) -> int:
    """The number of triangles of an ASCII PLY; of a binary PLY, whose length trimesh checks, the number of polygons."""
    header, _, body = raw.partition(b"end_header")
    counts = {name: int(count) for name, count in re.findall(rb"^element\s+(\S+)\s+(\d+)", header, re.MULTILINE)}
    faces = counts.get(b"face", 0)
    is_plain = re.search(rb"^element\s+face\s+\d+\s+property\s+list\s", header, re.MULTILINE) is not None
    if b"ascii" not in header or not is_plain:
        return faces
    names = list(counts)
    first = sum(counts[name] for name in names[: names.index(b"face")])
    rows = [line for line in body.splitlines() if line.strip()][first : first + faces]
    if len(rows) < faces:
        raise InputError(f"the file is cut short: it announces {faces} faces and has {len(rows)}")
    return sum(max(0, int(row.split(None, 1)[0]) - 2) for row in rows)


def _announced_by_off(raw: bytes) -> int:
    """The number of polygons in the header of an OFF: the second number after the keyword and the comments."""
    words = re.sub(rb"#[^\n]*", b"", raw[: raw.find(b"\n") + OFF_HEADER]).split()
    return int(words[2]) if words[0].upper().endswith(b"OFF") else 0


def _has_colours(raw: bytes) -> bool:
    """Whether an OFF file has colours: its keyword begins with C, or the first face has numbers after its vertices."""
    lines = [line for line in re.sub(rb"#[^\n]*", b"", raw).splitlines() if line.strip()]
    keyword, *counts = lines[0].split()
    first_vertex = 1 if counts else 2
    vertices = int((counts or lines[1].split())[0])
    face = [float(word) for line in lines[first_vertex + vertices :][:1] for word in line.split()]
    return keyword.upper().startswith(b"C") or len(face) > 1 + (face or [0])[0]


ANNOUNCED = {"stl": _announced_by_stl, "ply": _announced_by_ply, "off": _announced_by_off}


def from_trimesh(mesh_or_scene) -> Mesh:
    """The triangles of a ``trimesh.Trimesh``, or of every node of a ``trimesh.Scene`` with its transform applied.

    Vertex normals are used if the user has set them. trimesh also computes normals when a program reads them. Those are
    not used, because reading the normals of a mesh should not make it smooth.
    """
    if not hasattr(mesh_or_scene, "geometry") and not hasattr(mesh_or_scene, "faces"):
        raise InputError(f"mesh: a trimesh.Trimesh or a trimesh.Scene is needed, not {type(mesh_or_scene).__name__}")
    parts = [(mesh, transform, _normals_were_set(mesh)) for mesh, transform in _placed(mesh_or_scene)]
    return _assemble(parts, "mesh", None, [])


def _load(raw: bytes, path: Path):
    import trimesh  # takes half a second if scipy is installed

    class Files(trimesh.resolvers.FilePathResolver):
        """The files that a glTF names."""

        def get(self, name: str) -> bytes:
            """Their bytes; a pipe would never end."""
            named = Path(self.parent) / name.strip()
            if not named.exists():
                raise InputError(f"it needs the file {name[:LONGEST_REASON]}, which is not beside it")
            check_is_file(named)
            return super().get(name)

    resolver = Files(str(path))
    return trimesh.load(io.BytesIO(raw), path.suffix[1:].lower(), resolver=resolver, process=False, maintain_order=True)


def _placed(mesh_or_scene) -> list[tuple]:
    """(Trimesh, 4×4 transform) for everything that has triangles, in the order of the scene's nodes."""
    if not hasattr(mesh_or_scene, "geometry"):
        placed = [(mesh_or_scene, np.eye(4))]
    else:
        graph = mesh_or_scene.graph
        nodes = [graph[node] for node in graph.nodes_geometry]
        placed = [(mesh_or_scene.geometry[name], np.asarray(transform, np.float64)) for transform, name in nodes]
    return [(mesh, transform) for mesh, transform in placed if len(getattr(mesh, "faces", ())) > 0]


def _normals_were_set(mesh) -> bool:
    """Whether the vertex normals of a mesh differ from those that trimesh computes."""
    if "vertex_normals" not in mesh._cache:
        return False
    computed = mesh.copy(include_cache=False).vertex_normals
    return not np.array_equal(mesh.vertex_normals, computed)


def _part(mesh, source: str, takes_normals: bool = True) -> Mesh:
    """A ``trimesh.Trimesh`` without its materials.

    Args:
        source: the file, for messages.
        takes_normals: whether to use the vertex normals in the cache of ``mesh``. trimesh does not mark in any other
            way that a mesh has normals.
    """
    part = Mesh(np.asarray(mesh.vertices, np.float64), _faces(mesh), source=source)
    check(part)
    if takes_normals and "vertex_normals" in mesh._cache:
        part.normals, part.face_normals = np.asarray(mesh.vertex_normals, np.float64), part.faces
    return part


def _moved(part: Mesh, transform: np.ndarray) -> Mesh:
    """A part in its place, with normals of unit length if it has normals."""
    moved = replace(part)
    move(moved, transform)
    lengths = np.linalg.norm(moved.normals, axis=1, keepdims=True)
    moved.normals = moved.normals / np.where(lengths > 0, lengths, 1)
    return moved


def _faces(mesh) -> np.ndarray:
    """(F, 3) the triangles of a ``trimesh.Trimesh``, which are those of a strip if the file has a fan."""
    faces = np.asarray(mesh.faces, np.int64)
    return fan_of(faces) if FAN_MARK in getattr(mesh, "vertex_attributes", {}) else faces


def _assemble(
    placed: list[tuple], source: str, materials: list[Material] | None, notes: list[str], is_linear: bool = False
) -> Mesh:
    """One mesh made of all parts, in their order; with ``instances``, if the file has many triangles several times.

    Args:
        placed: for each part, a trimesh.Trimesh, its (4, 4) transform, and the other arguments of ``_part``.
        materials: the materials of the file, by number; None takes those of trimesh.
        is_linear: whether colours of vertices are linear.
    """
    used: list[Material] = []
    told: list[str] = []
    known: dict[int, Material] = {}  # by the identity of trimesh's material: each picture is decoded once
    parts: dict[int, Mesh] = {}  # by the identity of trimesh's mesh
    for mesh, _, *rest in placed:
        if id(mesh) in parts:
            continue
        part, look = _part(mesh, source, *rest), getattr(mesh.visual, "material", None)
        if id(look) not in known:
            known[id(look)] = _with_textures(_material(mesh.visual, materials), look, told)
        material = known[id(look)]
        part.corner_color = _corner_colors(mesh, is_linear)
        if part.corner_color is not None and material == Material():
            material = Material(Kd=(1.0, 1.0, 1.0))
        if material.textures and getattr(mesh.visual, "uv", None) is not None:
            part.corner_uv = np.asarray(mesh.visual.uv, np.float64)[:, :2][part.faces]
        if material not in used:
            used.append(material)
        part.face_materials = np.full(len(part.faces), used.index(material), np.int32)
        part.materials = used
        parts[id(mesh)] = part
    notes = [*notes, *(f"{source}: {text}" for text in dict.fromkeys(told))]
    copies = sum(len(mesh.faces) for mesh, *_ in placed) - sum(len(part.faces) for part in parts.values())
    if copies > FEW_COPIES:
        whole = group([Instances(parts[id(mesh)], transform) for mesh, transform, *_ in placed], source)
    else:
        whole = joined([_moved(parts[id(mesh)], transform) for mesh, transform, *_ in placed], used, source)
    return replace(whole, notes=notes)


def _material(visual, materials: list[Material] | None) -> Material:
    """A diffuse ``Material``, made of the material that trimesh found for a mesh."""
    look = getattr(visual, "material", None)
    if look is None or materials == []:
        return Material()
    if materials is not None:
        return materials[int(look.name)]
    name = getattr(look, "name", None) or "default"
    if hasattr(look, "baseColorFactor"):
        kd, ke = _color(look.baseColorFactor, (1.0, 1.0, 1.0)), _color(look.emissiveFactor, (0.0, 0.0, 0.0))
        return Material(name=name, Kd=kd, Ke=ke)
    return Material(name=name, Kd=_color(getattr(look, "diffuse", None), Material.Kd))


def _corner_colors(mesh, is_linear: bool) -> np.ndarray | None:
    """(F, 3, 3) linear colours of the corners of a ``trimesh.Trimesh``; None if it has none of its own.

    Args:
        is_linear: whether the numbers are linear colours, as in glTF; those of other formats are sRGB.
    """
    visual, faces = mesh.visual, _faces(mesh)
    given = getattr(visual, "vertex_attributes", {}).get("color")
    if given is None and getattr(visual, "kind", None) in ("vertex", "face"):
        given = visual.vertex_colors if visual.kind == "vertex" else visual.face_colors
    if given is None:
        return None
    colors = np.asarray(given)[:, :3]
    colors = colors / np.iinfo(colors.dtype).max if colors.dtype.kind in "iu" else colors
    colors = np.clip(np.nan_to_num(colors.astype(np.float64)), 0, 1)
    colors = colors if is_linear else linear_from_srgb(colors)
    return np.repeat(colors[:, None], 3, axis=1) if getattr(visual, "kind", None) == "face" else colors[faces]


def _with_textures(material: Material, look: Any, notes: list[str]) -> Material:
    """``material`` with the pictures that trimesh has decoded."""
    found: dict[str, Any] = {}
    for key, name in USED.items():
        empty, image = getattr(material, key), getattr(look, name, None)
        if image is None and key == "map_Kd":
            image = getattr(look, "image", None)
        if image is None and empty is not None:
            notes.append(f"the {name} of material {material.name!r} cannot be read, and is not used")
            if key == "map_layer":  # nothing is known of the layer
                found |= {"Kd": material.value(BASE, material.Kd), "alpha_x": 0.0, "alpha_y": 0.0, "extra": {}}
        found[key] = None
        if key == "map_Kd" and material.map_d is not None:
            found["map_d"] = None if image is None else _opacity(image, material.map_d)
        if image is not None:
            pixels = np.asarray(image.convert("RGB"), np.float32) / 255
            pixels = linear_from_srgb(pixels).astype(np.float32) if key == "map_Kd" else pixels
            found[key] = replace(empty or Texture(pixels), pixels=pixels)
    return replace(material, **found)


def _opacity(image: Any, empty: Texture) -> Texture:
    """The alpha of a picture that trimesh has decoded, times what ``empty`` has."""
    alpha = np.asarray(image.convert("RGBA"), np.float32)[..., 3:] / 255
    return replace(empty, pixels=alpha * empty.pixels)


def _color(value, default: tuple[float, float, float]) -> tuple[float, float, float]:
    """Three numbers in [0, 1] from None, bytes or floats, with or without alpha."""
    if value is None:
        return default
    color = np.asarray(value)
    steps = 255 if color.dtype.kind in "iu" else 1
    return tuple(float(c) / steps for c in color[:3])
