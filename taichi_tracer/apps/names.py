"""The names that can be typed: what they lead to, and the list of them at the end of a command's help.

Names are read where they are defined: those of parts in the registry, what counts when none is given in the signature
of the function that takes it.
"""

import inspect
import shutil
import textwrap
from collections.abc import Callable, Sequence
from dataclasses import dataclass

from taichi_tracer.camera import ProjectiveCamera, make_camera
from taichi_tracer.effects import MODES
from taichi_tracer.environment import LOOKUPS, Environment
from taichi_tracer.files.shipped import shipped_environments
from taichi_tracer.formulas.camera_frame import HANDEDNESS, UP_AXES
from taichi_tracer.integrators.base import Integrator
from taichi_tracer.picture.aovs import AOVS
from taichi_tracer.progressive import ProgressiveRenderer
from taichi_tracer.renderer import A2Renderer, A3Renderer, A4Renderer
from taichi_tracer.sampler import DEFAULT_SAMPLER
from taichi_tracer.scene_data import SceneData
from taichi_tracer.scene_data_loader import scene_names
from taichi_tracer.system import runtime
from taichi_tracer.system.errors import one_of
from taichi_tracer.system.overrides import unfinished
from taichi_tracer.system.registry import PARTS
from taichi_tracer.tones.display import Display

VIEW = "normal"  # what a picture shows when nobody says it
ALL = "all"  # every view of the renderer that shows ``VIEW``
TITLE_WIDTH = 16  # characters: the longest title and a little more

View = tuple[type[ProgressiveRenderer], Integrator]  # what a picture shows, and the renderer that offers it


def renderers() -> list[type[ProgressiveRenderer]]:
    """Every registered renderer that offers something."""
    return [c for c in PARTS.all("renderer") if len(c.offered()) > 0]


def find_views(text: str) -> tuple[View, ...]:
    """What a list of names with commas asks for; "all" is everything that the renderer of ``VIEW`` offers.

    A name that several renderers offer belongs to the one that was registered last: a renderer of your own that derives
    from ``A1Renderer`` takes its place.

    Raises:
        InputError: a name that none of them offers.
    """
    offered = [(renderer_class, one) for renderer_class in renderers() for one in renderer_class.offered()]
    offered.sort(key=lambda pair: is_second_choice(*pair), reverse=True)
    known: dict[str, View] = {alias: (cls, one) for cls, one in offered for alias in one.aliases}
    known |= {one.name: (cls, one) for cls, one in offered}
    if text == ALL:
        renderer_class, _ = known[VIEW]
        return tuple((renderer_class, integrator) for integrator in renderer_class.offered())
    for name in text.split(","):
        if name not in known:
            raise one_of(kinds_of_views(), name, [*view_names(), ALL])
    return tuple(known[name] for name in text.split(","))


def is_second_choice(renderer_class: type[ProgressiveRenderer], one: Integrator) -> bool:
    """Whether another renderer shows this, if it can: a student has not written this one, or only A2 has the mode."""
    return "shade_ray" in unfinished(renderer_class) or (one.microfacets and renderer_class is A3Renderer)


def kinds_of_views() -> str:
    """What the renderers call what they offer: "view, estimator or integrator"."""
    *rest, last = dict.fromkeys(c.what for c in renderers())
    return f"{', '.join(rest)} or {last}" if rest else last


def find_estimator(name: str) -> Integrator:
    """The way to sample light of that name.

    Raises:
        InputError: there is none, or it shows something for which no light is needed.
    """
    offered = [one for c in renderers() if issubclass(c, A2Renderer | A4Renderer) for one in c.offered()]
    known = {alias: one for one in offered for alias in (*one.aliases, one.name)}
    if name not in known:
        raise one_of("estimator", name, list(dict.fromkeys(one.name for one in offered)))
    return known[name]


def view_names() -> list[str]:
    """Every name that some renderer offers, once."""
    return [*dict.fromkeys(name for c in renderers() for name in c.names())]


# ── the end of a help ──


@dataclass(frozen=True)
class Names:
    """The names of one kind, for a list.

    Attributes:
        known: all of them. usual: those that count when none is given.
    """

    known: tuple[str, ...]
    usual: tuple[str, ...] = ()

    @classmethod
    def of_parameter(cls, known: Sequence[str], function: Callable, parameter: str) -> "Names":
        """Names that a parameter of a function takes."""
        return cls(tuple(known), (inspect.signature(function).parameters[parameter].default,))


def names_of_views() -> dict[str, Names]:
    """What the renderers offer, by what they call it: views, estimators, integrators."""
    found: dict[str, list[str]] = {}
    for renderer_class in renderers():
        found.setdefault(f"{renderer_class.what}s", []).extend(renderer_class.names())
    (renderer_class, _), *_ = find_views(VIEW)
    found[f"{renderer_class.what}s"].append(ALL)
    return {title: Names(tuple(dict.fromkeys(names)), (VIEW,)) for title, names in found.items()}


def names_of_knobs() -> dict[str, Names]:
    """What a study of accuracy compares."""
    from taichi_tracer.studies import variants

    knobs = (*variants.NAMED, "roulettes")
    return {knob.replace("_", " "): Names(variants.known(knob), variants.USUAL[knob]) for knob in knobs}


def names_of_options() -> dict[str, Names]:
    """What the options of scenes, cameras and pictures take."""
    of = Names.of_parameter
    return {
        "cameras": of(PARTS.names("camera"), make_camera, "projection"),
        "handedness": of(HANDEDNESS, ProjectiveCamera, "handedness"),
        "samplers": Names(tuple(PARTS.names("sampler")), (DEFAULT_SAMPLER,)),
        "AOVs": Names(tuple(AOVS)),
        "tones": of(PARTS.names("tone curve"), Display, "tone"),
        "scenes": Names(tuple(scene_names())),
        "environments": Names((*shipped_environments(), *PARTS.names("environment"), "none")),
        "up axes": of(tuple(UP_AXES), SceneData, "up_axis"),
        "lookups": of(LOOKUPS, Environment, "lookup"),
        "effects": of(MODES, SceneData, "effects"),
        "intersectors": of(PARTS.names("intersector"), SceneData, "intersector"),
        "triangle tests": of(PARTS.names("triangle test"), SceneData, "triangle_test"),
        "BRDFs": Names(tuple(PARTS.names("BRDF"))),
        "lights": Names(tuple(PARTS.names("light"))),
        "lamp choices": of(PARTS.names("lamp choice"), SceneData, "lamp_choice"),
        "archs": of(runtime.ARCHS, runtime.init, "arch"),
        "precisions": of(runtime.PRECISIONS, runtime.init, "precision"),
    }


# The lists that a command can ask for → the titles in them. ``names_in`` adds the names of views and of knobs.
RAYS, SURFACES = ("intersectors", "triangle tests"), ("BRDFs", "lights", "lamp choices")
FILES = ("scenes", "environments", "up axes")
LISTS: dict[str, tuple[str, ...]] = {
    "scenes": (*FILES, "lookups", "effects", *RAYS, *SURFACES, "archs", "precisions"),
    "files": FILES,
    "archs": ("archs",),
    "pictures": ("cameras", "handedness", "samplers"),
    "estimators": (),
    "cameras": ("cameras", "handedness"),
    "samplers": ("samplers",),
    "aovs": ("AOVs",),
    "tones": ("tones",),
    "rays": RAYS,
    "surfaces": SURFACES,
    "knobs": (),
}


def names_in(name: str) -> dict[str, Names]:
    """The names of one of ``LISTS``, by their titles."""
    views = names_of_views() if name in ("pictures", "estimators") else {}
    if name == "estimators":
        return {"estimators": views["estimators"]}
    known = names_of_options()
    return views | (names_of_knobs() if name == "knobs" else {title: known[title] for title in LISTS[name]})


def help_text(lists: Sequence[str]) -> str:
    """The end of a command's help: the names that can be given; ``lists`` says which of ``LISTS``."""
    found: dict[str, Names] = {}
    for name in lists:
        found |= names_in(name)
    return as_lists(found)


def as_lists(lists: dict[str, Names]) -> str:
    """Titles and names as lines of text; a star follows each name that counts when none is given."""
    lines, columns = [], shutil.get_terminal_size().columns
    for title, names in lists.items():
        words = ", ".join(f"{name}*" if name in names.usual else name for name in names.known)
        text = f"{title + ':':<{TITLE_WIDTH}}{words}"
        if words:
            lines += textwrap.wrap(text, columns, subsequent_indent=" " * TITLE_WIDTH, break_on_hyphens=False)
    if any("*" in line for line in lines):
        lines.append("* counts where nothing is said, neither here nor in the scene file.")
    return "\n" + "".join(f"{line}\n" for line in lines)
