"""Whether the JSON of a glTF file says what the format allows, as far as triangles, materials and lights need it.

What a file gets wrong is named by its place, as in ``accessors[3]: count must be …``; trimesh would pass on the error
of Python that follows from it, or none.
"""

import math
from typing import Any

from taichi_tracer.system.errors import InputError

LIGHTS = "KHR_lights_punctual"
STRENGTH = "KHR_materials_emissive_strength"
BYTES = {5120: 1, 5121: 1, 5122: 2, 5123: 2, 5125: 4, 5126: 4}  # of a componentType
ALPHA_MODES = ("OPAQUE", "MASK", "BLEND")
WHOLE = (5121, 5123, 5125)  # those of indices
WIDTHS = {"SCALAR": 1, "VEC2": 2, "VEC3": 3, "VEC4": 4, "MAT2": 4, "MAT3": 9, "MAT4": 16}
LISTS = (
    "accessors",
    "bufferViews",
    "buffers",
    "images",
    "materials",
    "meshes",
    "nodes",
    "samplers",
    "scenes",
    "textures",
)
# (list, member of its entries, list whose entry the member names)
REFERENCES = (
    ("accessors", "bufferView", "bufferViews"),
    ("bufferViews", "buffer", "buffers"),
    ("images", "bufferView", "bufferViews"),
    ("nodes", "mesh", "meshes"),
    ("textures", "sampler", "samplers"),
    ("textures", "source", "images"),
)
TRIANGLES, STRIP, FAN, MODES = 4, 5, 6, 7  # the modes of parts with triangles, and how many modes there are
# Extensions that a file may require, because they do not change the triangles. With others, trimesh finds no triangles.
HARMLESS = ("KHR_materials_", "KHR_texture_", "KHR_lights_", "EXT_texture_")
ATTRIBUTES = {"POSITION": ("VEC3",), "NORMAL": ("VEC3",), "TEXCOORD_0": ("VEC2",), "COLOR_0": ("VEC3", "VEC4")}


def check(content: Any, is_binary: bool = False) -> None:
    """Raise an InputError about the first mistake in the JSON of a glTF file.

    Args:
        is_binary: whether it is that of a GLB, in which a buffer need not name a file.
    """
    for extension in _list(_object(content, "the file"), "extensionsRequired", "the file"):
        if not str(extension).startswith(HARMLESS):
            raise InputError(f"it needs the extension {extension}, which is not supported: export it without")
    for name in LISTS:
        for k, entry in enumerate(_list(content, name, "the file")):
            _object(entry, f"{name}[{k}]")
    for name, member, of in REFERENCES:
        for k, entry in enumerate(content.get(name, [])):
            if member in entry:
                _place(entry[member], content, of, f"{name}[{k}].{member}")
    for k, buffer in enumerate(content.get("buffers", [])):
        if not is_binary and not isinstance(buffer.get("uri"), str):
            raise InputError(f"buffers[{k}]: uri is missing")
    for k, view in enumerate(content.get("bufferViews", [])):
        _check_view(view, content, f"bufferViews[{k}]")
    for k, accessor in enumerate(content.get("accessors", [])):
        _check_accessor(accessor, content, f"accessors[{k}]")
    for k, mesh in enumerate(content.get("meshes", [])):
        if "primitives" not in mesh:
            raise InputError(f"meshes[{k}]: primitives is missing")
        for i, part in enumerate(_list(mesh, "primitives", f"meshes[{k}]")):
            _check_part(part, content, f"meshes[{k}].primitives[{i}]")
    for k, look in enumerate(content.get("materials", [])):
        _check_material(look, f"materials[{k}]")
    _check_nodes(content)
    _check_lights(content)


def _check_view(view: dict, content: dict, where: str) -> None:
    if "buffer" not in view:
        raise InputError(f"{where}: buffer is missing")
    start = _whole(view, "byteOffset", where, 0)
    end, size = start + _whole(view, "byteLength", where), content["buffers"][view["buffer"]].get("byteLength", 0)
    if end > size:
        raise InputError(f"{where}: it ends at byte {end} of a buffer of {size} bytes")
    if _whole(view, "byteStride", where, 4) < 1:
        raise InputError(f"{where}: byteStride must be above 0")


def _check_accessor(accessor: dict, content: dict, where: str) -> None:
    """The kind of the numbers, and that its buffer view has all of them."""
    for member, known in (("componentType", BYTES), ("type", WIDTHS)):
        if accessor.get(member) not in known:
            raise InputError(f"{where}: {member} {accessor.get(member)!r} is unknown")
    count, start = _whole(accessor, "count", where), _whole(accessor, "byteOffset", where, 0)
    if "bufferView" not in accessor:
        return
    view = content["bufferViews"][accessor["bufferView"]]
    row = BYTES[accessor["componentType"]] * WIDTHS[accessor["type"]]
    end = start + (count - 1) * view.get("byteStride", row) + row if count > 0 else start
    if end > view["byteLength"]:
        raise InputError(f"{where}: it ends at byte {end} of a buffer view of {view['byteLength']} bytes")


def _check_part(part: Any, content: dict, where: str) -> None:
    """The arrays of one part of a mesh fit together."""
    attributes = _object(_object(part, where).get("attributes"), f"{where}.attributes")
    if "material" in part:
        _place(part["material"], content, "materials", f"{where}.material")
    if _whole(part, "mode", where, TRIANGLES) >= MODES:
        raise InputError(f"{where}: mode {part['mode']} is unknown")
    counts = _check_attributes(attributes, content, where)
    if "indices" in part:
        ids = _place(part["indices"], content, "accessors", f"{where}.indices")
        if ids["componentType"] not in WHOLE or ids["type"] != "SCALAR":
            raise InputError(f"{where}: indices must be whole numbers, not {ids['type']} of {ids['componentType']}")
        _check_is_there(ids, f"{where}: indices")
    corners = content["accessors"][part["indices"]]["count"] if "indices" in part else counts["POSITION"]
    if part.get("mode", TRIANGLES) == TRIANGLES and corners % 3:
        raise InputError(f"{where}: {corners} corners are not those of whole triangles")


def _check_attributes(attributes: dict, content: dict, where: str) -> dict[str, int]:
    """Name → count of the arrays of vertices that are used: all have one entry per vertex."""
    counts = {}
    for name, number in attributes.items():
        accessor = _place(number, content, "accessors", f"{where}.attributes.{name}")
        if name not in ATTRIBUTES:
            continue
        if accessor["type"] not in ATTRIBUTES[name]:
            raise InputError(f"{where}: {name} must be {' or '.join(ATTRIBUTES[name])}, not {accessor['type']}")
        _check_is_there(accessor, f"{where}: {name}")
        counts[name] = accessor["count"]
    if "POSITION" not in counts:
        raise InputError(f"{where}: POSITION is missing")
    for name, count in counts.items():
        if count != counts["POSITION"]:
            raise InputError(f"{where}: {count} entries of {name} for {counts['POSITION']} vertices")
    return counts


def _check_is_there(accessor: dict, where: str) -> None:
    """Whether the numbers stand in the file as they are."""
    if "bufferView" not in accessor or "sparse" in accessor:
        raise InputError(f"{where} is sparse or has no bufferView, which is not supported: export it in full")


def _check_material(look: dict, where: str) -> None:
    """The numbers of a material, which a renderer would multiply by light."""
    _numbers(look, "emissiveFactor", (3,), where)
    strength = _object(_object(look.get("extensions", {}), where).get(STRENGTH, {}), where)
    _number(strength, "emissiveStrength", where)
    _number(look, "alphaCutoff", where)
    if look.get("alphaMode", ALPHA_MODES[0]) not in ALPHA_MODES:
        raise InputError(f"{where}: alphaMode {_shown(look['alphaMode'])} is unknown")
    if "pbrMetallicRoughness" not in look:
        return
    where += ".pbrMetallicRoughness"
    values = _object(look["pbrMetallicRoughness"], where)
    _numbers(values, "baseColorFactor", (3, 4), where)
    for name in ("metallicFactor", "roughnessFactor"):
        _number(values, name, where, 0, 1)
    for name in values:
        if name.endswith("Texture"):
            _object(values[name], f"{where}.{name}")


def _check_nodes(content: dict) -> None:
    """The places of nodes, and what they name."""
    scenes, nodes = content.get("scenes", []), content.get("nodes", [])
    if "scene" in content:
        _place(content["scene"], content, "scenes", "scene")
    for name, entries, member in (("scenes", scenes, "nodes"), ("nodes", nodes, "children")):
        for k, entry in enumerate(entries):
            for child in _list(entry, member, f"{name}[{k}]"):
                _place(child, content, "nodes", f"{name}[{k}].{member}")
    for k, node in enumerate(nodes):
        for member, count in (("matrix", 16), ("translation", 3), ("rotation", 4), ("scale", 3)):
            _numbers(node, member, (count,), f"nodes[{k}]", -math.inf)
        reference = _object(_object(node.get("extensions", {}), f"nodes[{k}]").get(LIGHTS, {}), f"nodes[{k}]")
        if reference:
            _place(reference.get("light"), _lights_of(content), "lights", f"nodes[{k}].{LIGHTS}.light")


def _check_lights(content: dict) -> None:
    """The numbers of lights (KHR_lights_punctual): a range is above 0, and the inner cone is within the outer one."""
    for k, entry in enumerate(_list(_lights_of(content), "lights", LIGHTS)):
        where = f"lights[{k}]"
        light = _object(entry, where)
        _number(light, "intensity", where)
        _numbers(light, "color", (3,), where)
        _number(light, "range", where)
        if light.get("range") == 0:
            raise InputError(f"{where}: range must be above 0")
        cone = _object(light.get("spot", {}), f"{where}.spot")
        inner = _number(cone, "innerConeAngle", f"{where}.spot", 0, math.pi / 2, 0.0)
        outer = _number(cone, "outerConeAngle", f"{where}.spot", 0, math.pi / 2, math.pi / 4)
        if light.get("type") == "spot" and not inner < outer:
            raise InputError(f"{where}.spot: innerConeAngle {inner:g} must be less than outerConeAngle {outer:g}")


def _lights_of(content: dict) -> dict:
    return _object(_object(content.get("extensions", {}), "extensions").get(LIGHTS, {}), LIGHTS)


def _object(value: Any, where: str) -> dict:
    if not isinstance(value, dict):
        raise InputError(f"{where}: an object is needed, not {_shown(value)}")
    return value


def _list(part: dict, name: str, where: str) -> list:
    """A list of an object; empty if there is none."""
    found = part.get(name, [])
    if not isinstance(found, list):
        raise InputError(f"{where}: {name} must be a list, not {_shown(found)}")
    return found


def _place(number: Any, content: dict, name: str, where: str) -> Any:
    """The entry of a list that a number names."""
    entries = _list(content, name, where)
    if not _is_whole(number) or not 0 <= number < len(entries):
        raise InputError(f"{where} is {_shown(number)}, but {name} has {len(entries)} entries, counted from 0")
    return entries[number]


def _is_whole(value: Any) -> bool:
    return isinstance(value, int) and not isinstance(value, bool)


def _whole(part: dict, name: str, where: str, default: int | None = None) -> int:
    """A count of an object, which must be there if there is no default."""
    value = part.get(name, default)
    if not _is_whole(value) or value < 0:
        raise InputError(f"{where}: {name} must be a whole number of at least 0, not {_shown(value)}")
    return value


def _number(
    part: dict, name: str, where: str, least: float = 0.0, most: float = math.inf, default: float = 0.0
) -> float:
    """A number of an object within two bounds, and finite."""
    value = part.get(name, default)
    if not _is_number(value) or not least <= value <= most:
        bounds = f" of at least {least:g}" if math.isinf(most) else f" from {least:g} to {most:.4g}"
        raise InputError(f"{where}: {name} must be a finite number{bounds}, not {_shown(value)}")
    return value


def _numbers(part: dict, name: str, counts: tuple[int, ...], where: str, least: float = 0.0) -> None:
    """Some numbers of an object, if it has them, each finite and at least ``least``."""
    if name not in part:
        return
    values = part[name]
    is_right = isinstance(values, list) and len(values) in counts and all(_is_number(value) for value in values)
    if not is_right or min(values) < least:
        bound = "" if math.isinf(least) else f" of at least {least:g}"
        raise InputError(f"{where}: {name} must be {counts[-1]} finite numbers{bound}, not {_shown(values)}")


def _is_number(value: Any) -> bool:
    return isinstance(value, (int, float)) and not isinstance(value, bool) and math.isfinite(value)


def _shown(value: Any, most: int = 40) -> str:
    """A value in a message."""
    text = repr(value)
    return text if len(text) <= most else text[:most] + " …"
