"""Materials and lights of glTF 2.0: the numbers, without pictures."""

import math

import numpy as np

from taichi_tracer.brdfs.microfacet import LAYERED
from taichi_tracer.brdfs.rough_layer import LAYER_F0
from taichi_tracer.materials import Material
from taichi_tracer.textures import BASE, METALLIC

LIGHTS = "KHR_lights_punctual"
STRENGTH = "KHR_materials_emissive_strength"
UNLIT = "KHR_materials_unlit"
TRANSFORM = "KHR_texture_transform"
COLOUR, LAYER = "baseColorTexture", "metallicRoughnessTexture"
LEAST_ALPHA = 1e-6  # of a material; it counts as a mirror
USUAL_CONE = math.pi / 4  # of a spot

Place = tuple[int, tuple, float, tuple]  # the set of coordinates of a picture; its offset, rotation and scale
NO_PLACE: Place = (0, (0.0, 0.0), 0.0, (1, 1))


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
