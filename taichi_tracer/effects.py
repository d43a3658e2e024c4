"""Which effects a scene calls for: derived from it, never set by hand, and what is left out is not compiled."""

from dataclasses import dataclass

from taichi_tracer import brdf
from taichi_tracer.background import Background
from taichi_tracer.environment import Environment
from taichi_tracer.materials import Material
from taichi_tracer.system.errors import one_of

MODES = ("scene", "all")


@dataclass(frozen=True)
class Effects:
    """What the kernels of one scene are compiled for.

    Attributes:
        brdfs: indices into ``brdf.ALL`` of those that occur; with one there is no choice to be made at a hit.
        environment: "none" or "black": no light from far away, and no shadow ray; "constant": no look-up; "image".
        emitters: whether a material emits.
        interpolated_normals: whether a triangle has vertex normals.
        spheres: whether there are spheres beside the triangles.
        background: whether there is a picture behind the scene.
        reasons: (effect, is simulated, why), for the receipt.
    """

    brdfs: tuple[int, ...]
    environment: str
    emitters: bool
    interpolated_normals: bool
    spheres: bool
    background: bool
    reasons: tuple[tuple[str, bool, str], ...]

    @property
    def is_lit(self) -> bool:
        """Whether light can arrive from far away."""
        return self.environment in ("constant", "image")

    @property
    def is_dark(self) -> bool:
        """Whether nothing emits light at all."""
        return not self.is_lit and not self.emitters

    def receipt(self) -> list[str]:
        """A line for each effect: simulated or not, and why."""
        width = max(len(name) for name, _, _ in self.reasons)
        return [
            f"{name:<{width}}  {'simulated' if is_on else 'not simulated'}, {why}" for name, is_on, why in self.reasons
        ]


def derive(
    materials: list[Material],
    face_materials,
    has_normals: bool,
    environment: Environment | None,
    dtype: type,
    mode: str = "scene",
    num_spheres: int = 0,
    has_culling: bool = False,
    background: Background | None = None,
) -> Effects:
    """The effects of a scene; ``mode`` "all" has every one, for comparison.

    Args:
        face_materials: (F,) material ids; a material that no triangle has calls for nothing.
        has_culling: whether rays pass through the backs of some triangles.
    """
    if mode not in MODES:
        raise one_of("effects", mode, MODES)
    used = [materials[i] for i in sorted(set(face_materials.tolist()))]
    kinds = [brdf.brdf_of(m, dtype) for m in used]
    found = set(kinds)
    emits = any(max(m.Ke) > 0 for m in used)
    sky = _kind_of(environment)
    if mode == "all":
        found, emits, has_normals = set(range(len(brdf.ALL))), True, True
        sky = "none" if environment is None else "image"
        reason = "everything is compiled in"
        names = [b.name for b in brdf.ALL] + ["environment", "look-up", "shadow rays", "emitters", "vertex normals"]
        names += ["spheres"]
        reasons = [(name, sky != "none" or name not in ("environment", "look-up"), reason) for name in names]
        reasons.append(_about_background(background))
        return Effects(tuple(sorted(found)), sky, emits, has_normals, True, background is not None, tuple(reasons))
    reasons = [_about_brdf(i, kinds.count(i), len(kinds)) for i in range(len(brdf.ALL))]
    reasons += _about_light(sky, environment, emits)
    reasons.append(
        (
            "vertex normals",
            has_normals,
            "a triangle has them" if has_normals else "the face's normal is that of every point",
        )
    )
    has_spheres = num_spheres > 0
    reasons.append(("spheres", has_spheres, f"{num_spheres:,} of them" if has_spheres else "the scene has none"))
    why = "rays pass through the backs of some triangles" if has_culling else "all triangles have two sides"
    reasons.append(("backface cull", has_culling, why))
    reasons.append(_about_background(background))
    return Effects(tuple(sorted(found)), sky, emits, has_normals, has_spheres, background is not None, tuple(reasons))


def _about_background(background: Background | None) -> tuple[str, bool, str]:
    return "background", background is not None, "the scene has none" if background is None else background.what


def _kind_of(environment: Environment | None) -> str:
    if environment is None:
        return "none"
    if environment.is_black:
        return "black"
    return "image" if environment.constant is None else "constant"


def _about_brdf(index: int, count: int, materials: int) -> tuple[str, bool, str]:
    kind = brdf.ALL[index]
    why = f"{count} of {materials} materials" if count > 0 else f"no triangle has {kind.needs}"
    return kind.name, count > 0, why


def _about_light(sky: str, environment: Environment | None, emits: bool) -> list[tuple[str, bool, str]]:
    name = "" if environment is None else environment.name
    is_lit = sky in ("constant", "image")
    why = {
        "none": "the scene has none",
        "black": f"{name} is black everywhere",
        "constant": f"{name}",
        "image": f"{name}",
    }[sky]
    look_up = "its radiance is the same in every direction" if sky == "constant" else why
    shadow = "where the light would be more than 0" if is_lit else "no light comes from far away"
    return [
        ("environment", is_lit, why),
        ("look-up", sky == "image", look_up),
        ("shadow rays", is_lit, shadow),
        (
            "emitters",
            emits,
            "a material has Ke > 0; seen, not sampled" if emits else "no triangle has a material with Ke > 0",
        ),
    ]
