"""Which effects a scene calls for. They are derived from the scene, and an effect that is left out is not compiled.

Kernels read the one ``Effects`` object of their scene (``if ti.static(effects.spheres)``). The receipt prints the same
object, so that it always says what was compiled.
"""

from dataclasses import dataclass, field
from typing import Any

from taichi_tracer.system import runtime
from taichi_tracer.system.errors import one_of
from taichi_tracer.system.parts import replaced

MODES = ("scene", "all")


@dataclass(frozen=True, repr=False)
class Effects:
    """What the kernels of one scene are compiled for.

    Attributes:
        brdfs: which of the scene's BRDFs occur. If there is only one, no choice is compiled.
        environment: "none" or "black": the environment gives no light; "constant": light without a look-up; "image":
            light with a look-up.
        lights: the names of the other lights.
        emitters: whether the emission of materials is looked up.
        lamps: whether a surface emits, so that it lights others.
        interpolated_normals: whether a triangle has vertex normals.
        spheres: whether there are spheres.
        culling: whether rays pass through the backs of some triangles.
        holes: whether rays pass through parts of some triangles.
        instances: whether objects stand in several places, and are in memory once.
        textures: whether a material has a picture, or triangles have colours of their own.
        background: whether there is a picture behind the scene.
        blockers: what a ray that leaves a surface can hit: "all": anything; "backs": something only if it leaves the
            back of a surface, as inside a convex body; "none": nothing, as in a plane. See ``formulas.convexity``.
        scatters: whether a material reflects into more than single directions, so that it is worth sampling the lights.
        reasons: (effect, whether it is simulated, why) for each line of the receipt.
    """

    brdfs: tuple[int, ...]
    environment: str
    lights: tuple[str, ...]
    emitters: bool
    lamps: bool
    interpolated_normals: bool
    spheres: bool
    culling: bool
    holes: bool
    instances: bool
    textures: bool
    background: bool
    blockers: str
    scatters: bool
    reasons: tuple[tuple[str, bool, str], ...] = field(compare=False)

    @property
    def is_lit(self) -> bool:
        """Whether there is light to reflect, from the environment, from a surface that emits or from another light."""
        return self.environment in ("constant", "image") or len(self.lights) > 0 or self.lamps

    @property
    def samples_lights(self) -> bool:
        """Whether directions that are drawn from the environment or from lamps find light that a surface reflects."""
        return self.scatters and (self.environment in ("constant", "image") or self.lamps)

    def __repr__(self) -> str:
        names = {is_on: [name for name, on, _ in self.reasons if on == is_on] for is_on in (True, False)}
        return f"Effects({', '.join(names[True]) or 'nothing'}; not simulated: {', '.join(names[False]) or 'nothing'})"

    def receipt(self) -> list[str]:
        """One line per effect: whether it is simulated, and why."""
        width = max(len(name) for name, _, _ in self.reasons)
        return [
            f"{name:<{width}}  {'simulated' if is_on else 'not simulated'}, {why}" for name, is_on, why in self.reasons
        ]


def derive(scene, blockers: str = "all", microfacets: bool = False) -> Effects:
    """The effects of a scene.

    Args:
        scene: a ``SceneData``, whose ``effects_mode`` is "scene": what the scene calls for, or "all": every effect, for
            comparison. A material that no primitive has does not call for any effect.
        blockers: what a ray that leaves a surface can hit, see ``Effects``.
        microfacets: whether the roughness decides where a material has both Ns and a roughness.
    """
    if scene.effects_mode not in MODES:
        raise one_of("effects", scene.effects_mode, MODES)
    mesh, library = scene.mesh, scene.material_library
    brdf_of = {i: library.brdf_of[microfacets][i] for i in mesh.used_materials().tolist()}
    emits = any(max(mesh.materials[i].Ke) > 0 for i in brdf_of)
    found: dict[str, Any] = {
        "brdfs": tuple(sorted(set(brdf_of.values()))),
        "environment": _kind_of(scene.environment),
        "lights": tuple(light.name for light in scene.lights),
        "emitters": emits,
        "lamps": emits,
        "interpolated_normals": mesh.has_vertex_normals,
        "spheres": len(mesh.spheres) > 0,
        "culling": mesh.face_culls is not None and bool(mesh.face_culls.any()),
        "holes": mesh.has_holes,
        "instances": mesh.placed is not None,
        "textures": mesh.has_pictures or mesh.corner_color is not None,
        "background": scene.background is not None,
        "blockers": blockers,
        "scatters": any(not library.brdfs[i].is_delta for i in brdf_of.values()),
    }
    reasons = _reasons(scene, found, brdf_of)
    if scene.effects_mode == "all":
        has_environment = scene.environment is not None
        brdfs = tuple(range(len(scene.material_library.brdfs)))
        found |= {"brdfs": brdfs, "environment": "image" if has_environment else "none", "blockers": "all"}
        found |= dict.fromkeys(("emitters", "interpolated_normals", "spheres", "scatters"), True)
        of_scene = ["background", "backface cull", "textures", "instances"]
        of_scene += [] if has_environment else ["environment", "look-up"]
        reasons = [
            (name, is_on, why)
            if name in of_scene or name.startswith("light ")
            else (name, True, "everything is compiled")
            for name, is_on, why in reasons
        ]
    return Effects(**found, reasons=tuple(reasons))


def _reasons(scene, found: dict[str, Any], brdf_of: dict[int, int]) -> list[tuple[str, bool, str]]:
    """The lines of the receipt.

    Args:
        found: the attributes of ``Effects``. brdf_of: the BRDF of each material that a primitive has.
    """
    mesh, has = scene.mesh, list(brdf_of.values())
    materials = [mesh.materials[i] for i in brdf_of]
    normals, spheres, culls = found["interpolated_normals"], found["spheres"], found["culling"]
    return [
        *(_about_brdf(brdf, has.count(i), materials) for i, brdf in enumerate(scene.material_library.brdfs)),
        *_about_light(found["environment"], scene.environment, scene.lights),
        *_about_paths(found, len(scene.lights), int(mesh.emits().sum()) if found["emitters"] else 0),
        ("vertex normals", normals, "a triangle has them" if normals else "no triangle has them"),
        ("spheres", spheres, f"{len(mesh.spheres):,} of them" if spheres else "the scene has none"),
        (
            "backface cull",
            culls,
            "rays pass through the backs of some triangles" if culls else "all triangles have two sides",
        ),
        _about_textures(mesh, materials),
        *([_about_instances(mesh.placed)] if found["instances"] else []),
        ("background", found["background"], scene.background.what if found["background"] else "the scene has none"),
    ]


def _kind_of(environment) -> str:
    if environment is None:
        return "none"
    if replaced(environment):
        return "image"
    if environment.is_black:
        return "black"
    return "image" if environment.constant is None else "constant"


def _about_brdf(brdf, count: int, materials: list) -> tuple[str, bool, str]:
    if count > 0:
        return brdf.name, True, f"{count} of {len(materials)} materials"
    described = any(brdf.describes(material, runtime.dtype()) for material in materials)
    if described and any(material.has_both_models for material in materials):
        return brdf.name, False, "Ns decides; with the estimator microfacet, alpha_x and alpha_y decide"
    return brdf.name, False, "another BRDF takes its materials" if described else f"no triangle has {brdf.needs}"


def _about_textures(mesh, materials: list) -> tuple[str, bool, str]:
    count = sum(len(material.textures) > 0 for material in materials)
    if mesh.has_pictures:
        holes = ", rays pass through their holes" if mesh.has_holes else ""
        return "textures", True, f"{count} of {len(materials)} materials{holes}"
    if mesh.corner_color is not None:
        return "textures", True, "vertices have colours"
    return "textures", False, "the triangles have no texture coordinates" if count > 0 else "no material has one"


def _about_instances(placed) -> tuple[str, bool, str]:
    objects, places = len(placed.faces) - 1, len(placed.object_of)
    return "instances", True, f"objects: {objects:,}, in {places:,} places, {placed.starts[-1]:,} primitives in all"


def _about_light(sky: str, environment, lights) -> list[tuple[str, bool, str]]:
    name = "" if environment is None else environment.name
    is_lit = sky in ("constant", "image")
    why = {
        "none": "the scene has none",
        "black": f"{name} is black everywhere",
        "constant": f"{name}",
        "image": f"{name}",
    }[sky]
    look_up = "its radiance is the same in every direction" if sky == "constant" else why
    return [
        ("environment", is_lit, why),
        ("look-up", sky == "image", look_up),
        *((f"light {light.name}", True, type(light).__name__) for light in lights),
    ]


def _about_paths(found: dict, lights: int, lamps: int) -> list[tuple[str, bool, str]]:
    """The lines about rays that leave a surface, and about the two ways to find the light that a surface reflects.

    Args:
        found: the attributes of ``Effects``. lights: the number of lights that are sampled one by one.
        lamps: the number of surfaces that emit.
    """
    has_even_light = found["environment"] in ("constant", "image") or lamps > 0
    is_lit = has_even_light or lights > 0
    free = {
        "all": "",
        "backs": "no surface lies in front of another; only rays that leave the back of one are traced",
        "none": "no surface lies in front of another, nor behind",
    }[found["blockers"]]
    shadow = free or "sent where light could be reflected"
    bounces = free or "a surface can lie in front of another"
    if not is_lit:
        shadow, bounces = "there is no light to be blocked", "there is no light to be reflected"
    if found["scatters"] and has_even_light:
        both = "both can find what a surface reflects"
    elif has_even_light:
        both = "every material is a mirror or glass: only the BRDF's own direction finds light"
    else:
        both = "only samples find the lights, which have no area" if lights > 0 else "there is no light"
    emitters = "no triangle has a material with Ke > 0"
    if lamps > 0:
        emitters = f"{lamps:,} of the triangles and spheres have Ke > 0, and light the others"
    is_traced = is_lit and found["blockers"] == "all"
    return [
        ("emitters", lamps > 0, emitters),
        ("shadow rays", is_traced, shadow),
        ("bounces", is_traced, bounces),
        ("light and BRDF", found["scatters"] and has_even_light, both),
    ]
