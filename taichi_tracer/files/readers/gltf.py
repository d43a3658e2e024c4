"""glTF 2.0, as text and as GLB: triangles in all their places, materials with their pictures, and lights.

trimesh has no skins, morphs, instances, texture transforms or second sets of coordinates, and rounds colours to 8 bits.
"""

import base64
import io
import json
import math
from collections.abc import Iterator
from dataclasses import replace
from functools import cache
from pathlib import Path
from typing import Any
from urllib.parse import unquote, unquote_to_bytes

import numpy as np

from taichi_tracer.brdfs.microfacet import LAYERED
from taichi_tracer.brdfs.rough_layer import LAYER_F0
from taichi_tracer.files.disk import read_bytes
from taichi_tracer.files.images import linear_from_srgb
from taichi_tracer.geometry import Mesh, check
from taichi_tracer.instances import assemble
from taichi_tracer.materials import BASE, METALLIC, Material, Texture
from taichi_tracer.meshes.parts import inverse_of
from taichi_tracer.system.errors import InputError

LIGHTS = "KHR_lights_punctual"
STRENGTH = "KHR_materials_emissive_strength"
UNLIT = "KHR_materials_unlit"
TRANSFORM = "KHR_texture_transform"
COLOUR, LAYER = "baseColorTexture", "metallicRoughnessTexture"
LEAST_ALPHA = 1e-6  # of a material; it counts as a mirror
USUAL_CONE = math.pi / 4  # of a spot

Place = tuple[int, tuple, float, tuple]  # the set of coordinates of a picture; its offset, rotation and scale
NO_PLACE: Place = (0, (0.0, 0.0), 0.0, (1, 1))
QUANTIZED = "KHR_mesh_quantization"
INSTANCING = "EXT_mesh_gpu_instancing"
READ = (LIGHTS, STRENGTH, UNLIT, TRANSFORM, QUANTIZED, INSTANCING)

TYPES = {5120: "<i1", 5121: "<u1", 5122: "<i2", 5123: "<u2", 5125: "<u4", 5126: "<f4"}  # of a componentType
WIDTHS = {"SCALAR": 1, "VEC2": 2, "VEC3": 3, "VEC4": 4, "MAT2": 4, "MAT3": 9, "MAT4": 16}
TRIANGLES, STRIP, FAN = 4, 5, 6  # the modes of primitives with triangles
USUAL_CUTOFF = 0.5
WRAPS = {10497: "repeat", 33071: "clamp", 33648: "mirror"}

TRS = {"TRANSLATION": "translation", "ROTATION": "rotation", "SCALE": "scale"}  # of instances, and of nodes


def read_gltf(raw: bytes, path: Path, notes: list[str]) -> Mesh:
    """The meshes of a file in all their places, and its lights.

    Args:
        notes: gets a line for everything that changes the picture and is not read.
    """
    content, buffer = raw, None
    if raw[:4] == b"glTF":
        length = int.from_bytes(raw[12:16], "little")  # the header has 12 bytes, and each chunk 8: its length and type
        content, buffer = raw[20 : 20 + length], raw[28 + length :]
    return Gltf(json.loads(content), buffer, path, notes).read()


class Gltf:
    """One file while it is read.

    Attributes:
        content: its JSON. buffer: the binary chunk of a GLB, or None. path: the file. notes: what is not read.
    """

    def __init__(self, content: Any, buffer: bytes | None, path: Path, notes: list[str]) -> None:
        self.content, self.buffer, self.path, self.notes = content, buffer, path, notes
        # Each of them is read once.
        self.bytes_of, self.part = cache(self.read_buffer), cache(self.read_part)
        self.material, self.picture = cache(self.read_material), cache(self.read_picture)
        nodes = enumerate(content.get("nodes", []))
        self.parents = {child: k for k, node in nodes for child in node.get("children", [])}

    def read(self) -> Mesh:
        """As for ``read_gltf``."""
        used = self.content.get("extensionsUsed", [])
        for name in self.content.get("extensionsRequired", []):
            if name not in READ:
                raise InputError(f"it needs the extension {name}, which is not read: export it without")
        self.notes += [f"the extension {name} is not read" for name in used if name not in READ]
        if self.content.get("animations"):
            self.notes.append("animations are not read: the pose is that of the nodes")
        placed, lights, nodes = [], [], self.content.get("nodes", [])
        scenes, without_parent = self.content.get("scenes"), [k for k in range(len(nodes)) if k not in self.parents]
        roots = scenes[self.content.get("scene", 0)].get("nodes", []) if scenes else without_parent
        for node, matrix in self.nodes(roots):
            if "mesh" in node:
                matrices = self.instances(node, matrix)
                placed += [(part, one) for part in self.parts(node) for one in matrices]
            if LIGHTS in extensions(node):
                known = extensions(self.content)[LIGHTS]["lights"]
                lights += light_of(known, extensions(node)[LIGHTS]["light"], matrix, self.notes)
        self.notes[:] = dict.fromkeys(self.notes)
        return replace(assemble(placed, str(self.path)), lights=lights)

    # ── arrays ──

    def bytes_at(self, uri: str) -> bytes:
        """What a URI names: a file beside this one, or the data in it."""
        if uri.startswith("data:"):
            head, _, data = uri.partition(",")
            return base64.b64decode(unquote_to_bytes(data)) if head.endswith(";base64") else unquote_to_bytes(data)
        return read_bytes(self.path.parent / unquote(uri))

    def read_buffer(self, number: int) -> memoryview:
        """The bytes of a buffer; one without a URI is that of the GLB."""
        uri = self.content["buffers"][number].get("uri")
        return memoryview((self.buffer or b"") if uri is None else self.bytes_at(uri))

    def view(self, number: int) -> tuple[memoryview, int]:
        """The bytes of a buffer view, and its stride; 0 for none."""
        view = self.content["bufferViews"][number]
        start = view.get("byteOffset", 0)
        return self.bytes_of(view["buffer"])[start : start + view["byteLength"]], view.get("byteStride", 0)

    def rows(self, view: int, offset: int, kind: str, width: int, count: int) -> np.ndarray:
        """(count, width) numbers of a buffer view."""
        data, stride = self.view(view)
        if count > 0 and len(data) == 0:  # numpy checks no array without bytes, and would read other memory
            raise InputError(f"the file is cut short: buffer view {view} has no bytes")
        size = np.dtype(kind).itemsize
        return np.ndarray((count, width), kind, data, offset, (stride or size * width, size))

    def array(self, number: int, is_share: bool = False) -> np.ndarray:
        """(n, width) the numbers of an accessor, in float64 where they are normalised or floating point.

        Args:
            is_share: whether integers are always normalised, as for texture coordinates and colours.
        """
        accessor = self.content["accessors"][number]
        kind, width, count = TYPES[accessor["componentType"]], WIDTHS[accessor["type"]], accessor["count"]
        if "bufferView" in accessor:
            found = self.rows(accessor["bufferView"], accessor.get("byteOffset", 0), kind, width, count)
        else:
            found = np.zeros((count, width), kind)
        if "sparse" in accessor:
            of, by = accessor["sparse"]["values"], accessor["sparse"]["indices"]
            count, place = accessor["sparse"]["count"], TYPES[by["componentType"]]
            ids = self.rows(by["bufferView"], by.get("byteOffset", 0), place, 1, count).ravel()
            found = found.copy()
            found[ids] = self.rows(of["bufferView"], of.get("byteOffset", 0), kind, width, count)
        if found.dtype.kind == "f":
            return found.astype(np.float64)
        if accessor.get("normalized", is_share and QUANTIZED not in self.content.get("extensionsUsed", [])):
            return np.maximum(found / np.iinfo(found.dtype).max, -1.0)
        return found.astype(np.int64)

    # ── places ──

    def nodes(self, numbers: list[int]) -> Iterator[tuple[dict, np.ndarray]]:
        """Each of these nodes with those below it, and the (4, 4) matrix to world space."""
        for number in numbers:
            node = self.content["nodes"][number]
            yield node, self.to_world(number)
            yield from self.nodes(node.get("children", []))

    def to_world(self, number: int) -> np.ndarray:
        """(4, 4) from a node to the world."""
        matrix = _matrix(self.content["nodes"][number])
        return self.to_world(self.parents[number]) @ matrix if number in self.parents else matrix

    def instances(self, node: dict, matrix: np.ndarray) -> list[np.ndarray]:
        """The (4, 4) matrices of the places of a node's mesh; that of a skin is where its joints are."""
        if "skin" in node:
            return [np.eye(4)]
        given = extensions(node).get(INSTANCING, {}).get("attributes", {})
        names = [name for name in TRS if name in given]
        columns = [self.array(given[name]).tolist() for name in names]
        rows = [{TRS[name]: one for name, one in zip(names, row, strict=True)} for row in zip(*columns, strict=True)]
        return [matrix @ _matrix(row) for row in rows] if names else [matrix]

    def joints(self, number: int) -> np.ndarray:
        """(J, 4, 4) from a mesh to the world by each joint of a skin."""
        skin = self.content["skins"][number]
        places = np.array([self.to_world(joint) for joint in skin["joints"]])
        if "inverseBindMatrices" in skin:
            places = (
                places @ self.array(skin["inverseBindMatrices"]).reshape(-1, 4, 4).transpose(0, 2, 1)[: len(places)]
            )
        return places

    # ── triangles ──

    def parts(self, node: dict) -> Iterator[Mesh]:
        """The primitives of a node's mesh that have triangles; the same object where nothing is different."""
        mesh = self.content["meshes"][node["mesh"]]
        weights = tuple(node.get("weights", mesh.get("weights", ())))
        for number, primitive in enumerate(mesh["primitives"]):
            if primitive.get("mode", TRIANGLES) not in (TRIANGLES, STRIP, FAN):
                self.notes.append("points and lines are not read")
            else:
                yield self.part(node["mesh"], number, weights, node.get("skin"))

    def read_part(self, mesh: int, number: int, weights: tuple, skin: int | None) -> Mesh:
        """A primitive of a mesh, with the morphs of the weights and the pose of the skin."""
        primitive = self.content["meshes"][mesh]["primitives"][number]
        attributes = primitive["attributes"]
        arrays = {name: self.array(attributes[name]) for name in ("POSITION", "NORMAL") if name in attributes}
        for weight, target in zip(weights, primitive.get("targets", []), strict=False):
            arrays |= {name: arrays[name] + weight * self.array(target[name]) for name in arrays if name in target}
        if skin is not None:
            arrays = self.posed(arrays, attributes, self.joints(skin))
        points = arrays["POSITION"].astype(np.float64)
        ids = self.array(primitive["indices"]).ravel() if "indices" in primitive else np.arange(len(points))
        part = Mesh(points, triangles_of(ids, primitive.get("mode", TRIANGLES)), source=str(self.path))
        check(part)
        if "NORMAL" in arrays:
            part.normals, part.face_normals = arrays["NORMAL"].astype(np.float64), part.faces
        material, place = self.material(primitive.get("material"), "COLOR_0" in attributes)
        if "COLOR_0" in attributes:
            colors = np.clip(np.nan_to_num(self.array(attributes["COLOR_0"], is_share=True)), 0, 1)
            part.corner_color = colors[:, :3][part.faces]
            if colors[:, 3:].min(initial=1) < 1:
                self.notes.append("the alpha of the colours of vertices is not read")
            if material == Material():
                material = Material(Kd=(1.0, 1.0, 1.0))
        if material.textures:
            part.corner_uv = self.coordinates(attributes, place, len(points))[part.faces]
        part.materials = [material]
        return part

    def posed(self, arrays: dict, attributes: dict, joints: np.ndarray) -> dict:
        """Positions Σ wⱼ Mⱼ x, and normals by the inverse transpose of Σ wⱼ Mⱼ (glTF 2.0, section 3.7.3.3)."""
        total, k = np.zeros((len(arrays["POSITION"]), 4, 4)), 0
        while f"JOINTS_{k}" in attributes:
            ids, weights = (self.array(attributes[f"{name}_{k}"], name == "WEIGHTS") for name in ("JOINTS", "WEIGHTS"))
            total += np.einsum("nk,nkij->nij", weights, joints[ids])
            k += 1
        sum_of_weights = total[:, 3:, 3:]
        is_posed = sum_of_weights > 0
        matrix = np.where(is_posed, total / np.where(is_posed, sum_of_weights, 1), np.eye(4))
        found = {"POSITION": np.einsum("nij,nj->ni", matrix[:, :3, :3], arrays["POSITION"]) + matrix[:, :3, 3]}
        if "NORMAL" in arrays:
            found["NORMAL"] = np.einsum("nji,nj->ni", inverse_of(matrix[:, :3, :3]), arrays["NORMAL"])
        return found

    def coordinates(self, attributes: dict, place: Place, count: int) -> np.ndarray:
        """(count, 2) texture coordinates from the bottom left, transformed as KHR_texture_transform says."""
        number, offset, rotation, scale = place
        if f"TEXCOORD_{number}" not in attributes:
            return np.zeros((count, 2))
        u, v = (self.array(attributes[f"TEXCOORD_{number}"], is_share=True) * scale).T
        cos, sin = math.cos(rotation), math.sin(rotation)  # v points downwards: counter-clockwise is from v to u
        return np.stack([cos * u + sin * v + offset[0], 1 - (cos * v - sin * u + offset[1])], axis=1)

    # ── materials ──

    def read_material(self, number: int | None, has_colors: bool) -> tuple[Material, Place]:
        """A material with its pictures, and their place; what they cannot have is a note."""
        if number is None:
            return Material(), NO_PLACE
        look = self.content["materials"][number]
        values, name = look.get("pbrMetallicRoughness", {}), look.get("name", number)
        used = {one: place_of(values[one]) for one in (COLOUR, LAYER) if one in values}
        others = [one for part in (look, values) for one in part if one.endswith("Texture") and one not in used]
        if others:
            self.notes.append(f"material {name!r}: textures are not used: {', '.join(others)}")
        place = next(iter(used.values()), NO_PLACE)
        pictures = {one: self.picture(values[one]["index"]) for one in used if used[one] == place}
        for one in used:
            if one not in pictures:
                self.notes.append(f"material {name!r}: {one} is not used: its coordinates are not those of {COLOUR}")
            elif pictures[one] is None:
                self.notes.append(f"the {one} of material {name!r} cannot be read, and is not used")
        material, found = material_of(look, has_colors), {one: of for one, of in pictures.items() if of is not None}
        if LAYER in used and LAYER not in found:  # nothing is known of the layer
            base = material.value(BASE, material.Kd)
            material = replace(material, Kd=base, F0=(0.0,) * 3, alpha_x=0.0, alpha_y=0.0, extra={})
        textures = {"map_Kd": found[COLOUR][0]} if COLOUR in found else {}
        textures |= {"map_layer": found[LAYER][1]} if LAYER in found else {}
        return replace(material, **textures, map_d=self.opacity(look, found.get(COLOUR))), place

    def opacity(self, look: dict, picture: tuple | None) -> Texture | None:
        """The texture with holes where alpha is below the cutoff: alpha is scaled so that the cutoff becomes 1/2."""
        mode, factor = look.get("alphaMode", "OPAQUE"), look.get("pbrMetallicRoughness", {}).get("baseColorFactor", ())
        cutoff = look.get("alphaCutoff", USUAL_CUTOFF) if mode == "MASK" else USUAL_CUTOFF
        alpha = picture[2] if picture else Texture(np.ones((1, 1, 3), np.float32))
        alpha = replace(alpha, pixels=alpha.pixels * np.float32((*factor, 1.0)[3] if len(factor) > 2 else 1.0))
        if mode == "OPAQUE" or cutoff <= 0 or alpha.pixels.min() >= max(1, cutoff):
            return None
        if mode == "BLEND":
            self.notes.append(f"alphaMode BLEND is not read: surfaces with alpha below {USUAL_CUTOFF} are holes")
        return replace(alpha, pixels=alpha.pixels * np.float32(0.5 / cutoff))

    def read_picture(self, number: int) -> tuple[Texture, Texture, Texture] | None:
        """The picture of a texture: as colours in sRGB, as plain numbers, and its alpha. None: it cannot be read."""
        from PIL import Image

        try:
            texture = self.content["textures"][number]
            image = self.content["images"][texture["source"]]
            data = self.bytes_at(image["uri"]) if "uri" in image else bytes(self.view(image["bufferView"])[0])
            with Image.open(io.BytesIO(data)) as opened:
                steps = 65535 if opened.mode.startswith("I") else 255
                pixels = opened if steps == 65535 else opened.convert("RGBA")
                pixels = np.asarray(pixels, np.float32).reshape(opened.height, opened.width, -1) / np.float32(steps)
        except (InputError, LookupError, OSError, ValueError, TypeError):
            return None
        sampler = self.content["samplers"][texture["sampler"]] if "sampler" in texture else {}
        wrap = tuple(WRAPS.get(sampler.get(name), "repeat") for name in ("wrapS", "wrapT"))
        rgb, alpha = (np.broadcast_to(one, (*one.shape[:2], 3)) for one in (pixels[..., :3], pixels[..., -1:]))
        colours = linear_from_srgb(rgb).astype(np.float32)
        alpha = alpha if pixels.shape[2] == 4 else np.ones_like(rgb)
        return Texture(colours, wrap), Texture(rgb, wrap), Texture(alpha, wrap)


def triangles_of(ids: np.ndarray, mode: int) -> np.ndarray:
    """(F, 3) the vertex ids of triangles, of a strip or of a fan (glTF 2.0, section 3.7.2.1)."""
    if mode == TRIANGLES:
        return ids.reshape(-1, 3)
    k = np.arange(len(ids) - 2)
    if mode == FAN:
        return np.stack([ids[k + 1], ids[k + 2], ids[0 * k]], axis=1)
    return np.stack([ids[k], ids[k + 1 + k % 2], ids[k + 2 - k % 2]], axis=1)


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


# ── materials and lights: the numbers, without pictures ──


def extensions(part: dict) -> dict:
    """The extensions of a part of a file."""
    return part.get("extensions", {})


def place_of(info: dict) -> Place:
    """The set of coordinates of a picture, and how they are transformed."""
    given = extensions(info).get(TRANSFORM, {})
    number = given.get("texCoord", info.get("texCoord", 0))
    return number, tuple(given.get("offset", (0.0, 0.0))), given.get("rotation", 0.0), tuple(given.get("scale", (1, 1)))


def material_of(look: dict, has_colors: bool) -> Material:
    """A metal, or a base under a rough layer; Ke is the emission times its strength (glTF 2.0, section 3.9).

    All colours are linear. A material without ``pbrMetallicRoughness`` is diffuse.

    Args:
        has_colors: whether its vertices have colours, by which the base colour is multiplied.
    """
    values, strength = look.get("pbrMetallicRoughness"), extensions(look).get(STRENGTH, {})
    base = np.array((values or {}).get("baseColorFactor", (1.0, 1.0, 1.0))[:3], float)
    rough: dict = {"Kd": tuple(base.tolist())}
    if values is not None and UNLIT not in extensions(look):
        metal, roughness = (float(values.get(f"{name}Factor", 1.0)) for name in ("metallic", "roughness"))
        alpha = max(roughness**2, LEAST_ALPHA)
        rough = {"Kd": (1 - metal) * base, "F0": (1 - metal) * LAYER_F0 + metal * base}
        rough = {name: tuple(color.tolist()) for name, color in rough.items()}
        share = np.divide(metal * base, rough["F0"], out=np.zeros(3), where=np.array(rough["F0"]) > 0)
        extra = {} if metal == 1 and LAYER not in values else {LAYERED: (1.0,)}
        if metal > 0 and (has_colors or COLOUR in values):
            extra[METALLIC] = tuple(share.tolist())
        if LAYER in values:
            extra |= {METALLIC: (metal,) * 3, BASE: tuple(base.tolist())}
        rough |= {"alpha_x": alpha, "alpha_y": alpha, "extra": extra}
    Ke = strength.get("emissiveStrength", 1.0) * np.array(look.get("emissiveFactor", (0.0, 0.0, 0.0)), float)
    return Material(name=str(look.get("name") or "default"), **rough, Ke=tuple(Ke.tolist()))


def light_of(known: list, number: int, matrix: np.ndarray, notes: list[str]) -> list[tuple[str, dict]]:
    """(name, arguments) of a light of KHR_lights_punctual in its place; it shines along −z.

    Args:
        known: the lights of the file. matrix: (4, 4) of the light's node. notes: gets a line for what is not used.
    """
    light = known[number]
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
        return []
    return [(light["type"], of_kind[light["type"]])]
