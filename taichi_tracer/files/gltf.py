"""What trimesh does not read of glTF files, or not exactly: materials, the samplers of textures, and lights."""

import json
import struct
from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from taichi_tracer.brdfs.microfacet import LAYERED
from taichi_tracer.brdfs.rough_layer import LAYER_F0
from taichi_tracer.files import gltf_checks
from taichi_tracer.files.gltf_checks import FAN, LIGHTS, STRENGTH, STRIP, TRIANGLES, WHOLE
from taichi_tracer.materials import Material
from taichi_tracer.textures import BASE, METALLIC, Texture

GLB_HEADER = struct.Struct("<4sIIII")  # magic, version, length of the file, length and type of the JSON chunk
GLB_JSON = 0x4E4F534A  # the type of a JSON chunk: the letters JSON as a little-endian number
LEAST_ALPHA = 1e-6  # of a glTF material; it counts as a mirror
USED = {"map_Kd": "baseColorTexture", "map_layer": "metallicRoughnessTexture"}  # textures: ours, and glTF's names
GLTF_WRAPS = {10497: "repeat", 33071: "clamp", 33648: "mirror"}
FAN_MARK = "_FAN"  # an attribute of the vertices of a part that was a fan, see ``_as_trimesh_reads``
USUAL_CONE = np.pi / 4  # of a spot


def numbered(raw: bytes, notes: list[str]) -> tuple[bytes, list[Material], list[tuple[str, dict]]]:
    """The content of a glTF file with its materials renamed to 0, 1, 2 …; these materials; and its lights.

    Both are read here, because trimesh rounds base colours to 8 bits, and reads neither KHR_materials_emissive_strength
    nor lights. The materials are renamed, because several of a file may have the same name.

    Args:
        notes: gets a line for everything that is not used.
    """
    is_binary = raw[:4] == b"glTF"
    start, rest = 0, b""
    if is_binary:
        _, version, _, length, _ = GLB_HEADER.unpack_from(raw)
        start, rest = GLB_HEADER.size, raw[GLB_HEADER.size + length :]
    content = json.loads(raw[start : len(raw) - len(rest)])
    gltf_checks.check(content, is_binary)
    looks = content.get("materials", [])
    parts = [part for mesh in content.get("meshes", []) for part in mesh.get("primitives", [])]
    if others := sum(part.get("mode", TRIANGLES) not in (TRIANGLES, STRIP, FAN) for part in parts):
        notes.append(f"points and lines are not read: {others} of {len(parts)} parts are left out")
    has_colors = any("COLOR_0" in part.get("attributes", {}) for part in parts)
    materials = [
        replace(
            _material(look, has_colors),
            map_d=_empty_opacity(look, content),
            **{key: _empty_texture(look, name, content) for key, name in USED.items()},
        )
        for look in looks
    ]
    for number, look in enumerate(looks):
        if others := [name for name in _names_of_textures(look) if name not in USED.values()]:
            notes.append(f"material {look.get('name', number)!r}: textures are not used: {', '.join(others)}")
    for number, look in enumerate(looks):
        look["name"] = str(number)
    lights = _lights(content, notes)
    if count := _without_whole_coordinates(content, parts):
        notes.append(f"texture coordinates of whole numbers are not read: {count} of {len(parts)} parts have none")
    _as_trimesh_reads(content, parts)
    text = json.dumps(content).encode()
    if not is_binary:
        return text, materials, lights
    text += b" " * (-len(text) % 4)
    total = GLB_HEADER.size + len(text) + len(rest)
    return GLB_HEADER.pack(b"glTF", version, total, len(text), GLB_JSON) + text + rest, materials, lights


def _as_trimesh_reads(content: dict, parts: list[dict]) -> None:
    """Change what trimesh reads in another way than glTF means it.

    A fan is skipped: it becomes a strip, from whose triangles ``fan_of`` makes those of the fan. Siblings are taken
    from the last to the first. A node with a camera gets no place, and so nothing below it has one.
    """
    for part in parts:
        if part.get("mode") == FAN:
            part["mode"], part["attributes"][FAN_MARK] = STRIP, part["attributes"]["POSITION"]
    for scene in content.get("scenes", []):
        scene["nodes"] = scene.get("nodes", [])[::-1]
    for node in content.get("nodes", []):
        node["children"] = node.get("children", [])[::-1]
        node.pop("camera", None)


def _without_whole_coordinates(content: dict, parts: list[dict]) -> int:
    """Take away texture coordinates that are normalised whole numbers, which trimesh does not scale; how many parts."""
    count = 0
    for part in parts:
        number = part["attributes"].get("TEXCOORD_0")
        if number is not None and content["accessors"][number]["componentType"] in WHOLE:
            del part["attributes"]["TEXCOORD_0"]
            count += 1
    return count


def fan_of(strip: np.ndarray) -> np.ndarray:
    """(F, 3) triangles of the fan whose vertices have the same order as those of a strip (glTF 2.0, section 3.7.2.1).

    Args:
        strip: (F, 3) triangles of the strip; every second one is turned round.
    """
    last = np.where(np.arange(len(strip)) % 2 == 0, strip[:, 2], strip[:, 0])
    vertices = np.concatenate([strip[:1, :2].ravel(), last])
    return np.stack([vertices[1:-1], vertices[2:], np.full(len(strip), vertices[:1])], axis=1)


def _material(look: dict, has_colors: bool) -> Material:
    """A metal, or a base under a rough layer; Ke is the emission times its strength (glTF 2.0, section 3.9).

    All colours are linear. A material without ``pbrMetallicRoughness`` is diffuse.

    Args:
        has_colors: whether vertices of the file have colours, by which base colours are multiplied.
    """
    values = look.get("pbrMetallicRoughness")
    base = np.array((values or {}).get("baseColorFactor", (1.0, 1.0, 1.0))[:3], float)
    rough: dict = {"Kd": tuple(base.tolist())}
    is_unlit, is_in_picture = "KHR_materials_unlit" in extensions(look), USED["map_layer"] in (values or {})
    if values is not None and not is_unlit:
        metal, roughness = (float(values.get(f"{name}Factor", 1.0)) for name in ("metallic", "roughness"))
        alpha = max(roughness**2, LEAST_ALPHA)
        rough = {"Kd": (1 - metal) * base, "F0": (1 - metal) * LAYER_F0 + metal * base}
        rough = {name: tuple(color.tolist()) for name, color in rough.items()}
        share = np.divide(metal * base, rough["F0"], out=np.zeros(3), where=np.array(rough["F0"]) > 0)
        extra = {} if metal == 1 and not is_in_picture else {LAYERED: (1.0,)}
        if metal > 0 and (has_colors or "baseColorTexture" in values):
            extra[METALLIC] = tuple(share.tolist())
        if is_in_picture:
            extra |= {METALLIC: (metal,) * 3, BASE: tuple(base.tolist())}
        rough |= {"alpha_x": alpha, "alpha_y": alpha, "extra": extra}
    strength = extensions(look).get(STRENGTH, {}).get("emissiveStrength", 1.0)
    return Material(
        name=str(look.get("name") or "default"),
        **rough,
        Ke=tuple(float(strength * c) for c in look.get("emissiveFactor", (0.0, 0.0, 0.0))),
    )


def extensions(part: dict) -> dict:
    """The extensions of a part of a glTF file."""
    return part.get("extensions", {})


def _empty_texture(look: dict, name: str, content: dict) -> Texture | None:
    """A texture of a glTF material, still white; its sampler says what lies beyond the picture."""
    place = look.get("pbrMetallicRoughness", {}).get(name)
    if place is None:
        return None
    of = _at(content, "samplers", _at(content, "textures", place.get("index")).get("sampler"))
    wrap = tuple(GLTF_WRAPS.get(of.get(name), "repeat") for name in ("wrapS", "wrapT"))
    return Texture(np.ones((1, 1, 3), np.float32), wrap, look.get("name", ""))


def _empty_opacity(look: dict, content: dict) -> Texture | None:
    """The texture that cuts holes into a glTF material; as yet, it has what its alpha is to be multiplied with.

    A point is a hole where the alpha of the base colour, times that of its factor, is less than ``alphaCutoff``.
    """
    texture, cutoff = _empty_texture(look, USED["map_Kd"], content), look.get("alphaCutoff", 0.5)
    if texture is None or look.get("alphaMode") != "MASK" or cutoff <= 0:
        return None
    factor = (*look["pbrMetallicRoughness"].get("baseColorFactor", ()), 1.0, 1.0, 1.0, 1.0)[3]
    return replace(texture, pixels=texture.pixels * np.float32(0.5 * factor / cutoff))


def _at(content: dict, name: str, index: int | None) -> dict:
    """An entry of one of the lists of a glTF file; empty if there is none."""
    entries = content.get(name, [])
    return entries[index] if isinstance(index, int) and 0 <= index < len(entries) else {}


def _names_of_textures(look: dict) -> list[str]:
    """The kinds of pictures that a glTF material has."""
    return [name for part in (look, look.get("pbrMetallicRoughness", {})) for name in part if name.endswith("Texture")]


def _lights(content: dict, notes: list[str]) -> list[tuple[str, dict]]:
    """(name, arguments) of the lights of KHR_lights_punctual, each in the place of its node; they shine along −z."""
    known, found = extensions(content).get(LIGHTS, {}).get("lights", []), []
    for node, matrix in _placed_nodes(content):
        if LIGHTS not in extensions(node):
            continue
        light = known[extensions(node)[LIGHTS]["light"]]
        name = light.get("name", light.get("type"))
        direction, position = -matrix[:3, 2], matrix[:3, 3]
        color = light.get("intensity", 1.0) * np.array(light.get("color", (1.0, 1.0, 1.0)), float)
        cone = light.get("spot", {})
        inner, outer = cone.get("innerConeAngle", 0.0), cone.get("outerConeAngle", USUAL_CONE)
        of_kind = {
            "directional": {"direction": direction, "irradiance": color},
            "point": {"position": position, "intensity": color},
            "spot": {"position": position, "target": position + direction, "intensity": color}
            | {"cutoff": float(np.degrees(outer)), "falloff": float(np.degrees(inner))},
        }
        if "range" in light:
            notes.append(f"light {name!r}: its range is not used, so that it shines farther")
        if light.get("type") not in of_kind or not direction.any():
            notes.append(f"light {name!r} is not used: its type or its place is unknown")
        else:
            found.append((light["type"], of_kind[light["type"]]))
    return found


def _placed_nodes(content: dict) -> Iterator[tuple[dict, np.ndarray]]:
    """Every node of the scene that is shown, and its (4, 4) matrix to world space; each node once."""
    nodes, scenes = content.get("nodes", []), content.get("scenes", [])
    roots = scenes[content.get("scene", 0)].get("nodes", []) if scenes else list(range(len(nodes)))
    waiting, seen = [(number, np.eye(4)) for number in reversed(roots)], set()
    while waiting:
        number, above = waiting.pop()
        if number in seen:
            continue
        seen.add(number)
        matrix = above @ _matrix(nodes[number])
        yield nodes[number], matrix
        waiting += [(child, matrix) for child in reversed(nodes[number].get("children", []))]


def _matrix(node: dict) -> np.ndarray:
    """(4, 4) from a node to its parent: given column by column, or as translation, rotation (x, y, z, w) and scale."""
    if "matrix" in node:
        return np.array(node["matrix"], float).reshape(4, 4).T
    x, y, z, w = node.get("rotation", (0.0, 0.0, 0.0, 1.0))
    matrix = np.eye(4)
    matrix[:3, :3] = [
        [1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
        [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
        [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)],
    ]
    matrix[:3, :3] *= node.get("scale", (1.0, 1.0, 1.0))
    matrix[:3, 3] = node.get("translation", (0.0, 0.0, 0.0))
    return matrix
