"""The names that can be typed: what they lead to, and the list of them at the end of a command's help.

Names are read where they are defined: those of parts in the registry, what counts when none is given in the signature
of the function that takes it.
"""

import inspect
import shutil
import textwrap
from collections.abc import Callable, Sequence
from dataclasses import dataclass

from taichi_tracer.assignments import A2Renderer, A4Renderer
from taichi_tracer.camera import ProjectiveCamera, make_camera
from taichi_tracer.effects import MODES
from taichi_tracer.environment import LOOKUPS, Environment
from taichi_tracer.files.shipped import shipped_environments
from taichi_tracer.formulas.camera_frame import UP_AXES
from taichi_tracer.formulas.view import HANDEDNESS
from taichi_tracer.integrators.base import Integrator
from taichi_tracer.picture.aovs import AOVS
from taichi_tracer.renderer import ProgressiveRenderer
from taichi_tracer.scene_data import SceneData
from taichi_tracer.scene_data_loader import scene_names
from taichi_tracer.system import runtime
from taichi_tracer.system.errors import one_of
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
    known: dict[str, View] = {alias: (cls, one) for cls, one in offered for alias in one.aliases}
    known |= {one.name: (cls, one) for cls, one in offered}
    if text == ALL:
        renderer_class, _ = known[VIEW]
        return tuple((renderer_class, integrator) for integrator in renderer_class.offered())
    for name in text.split(","):
        if name not in known:
            raise one_of(kinds_of_views(), name, [*view_names(), ALL])
    return tuple(known[name] for name in text.split(","))


def kinds_of_views() -> str:
    """What the renderers call what they offer: "view, estimator or integrator"."""
    *rest, last = dict.fromkeys(c.what for c in renderers())
    return f"{', '.join(rest)} or {last}" if rest else last


def find_estimator(name: str) -> Integrator:
    """The way to sample light of that name.

    Raises:
        InputError: there is none, or it shows something for which no light is needed.
    """
    offered = [*PARTS.last_of("renderer", A2Renderer).offered(), *A4Renderer.offered()]
    known = {alias: one for one in offered for alias in (*one.aliases, one.name)}
    if name not in known:
        raise one_of("estimator", name, [one.name for one in offered])
    return known[name]


def view_names() -> list[str]:
    """Every name that some renderer offers, once."""
    return list(dict.fromkeys(name for c in renderers() for name in c.names()))


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


def names_of_pictures() -> dict[str, Names]:
    """What the options of a picture take."""
    return names_of_views() | names_of_cameras() | names_of_samplers()


def names_of_cameras() -> dict[str, Names]:
    """What the options of a camera take."""
    return {
        "cameras": Names.of_parameter(PARTS.names("camera"), make_camera, "projection"),
        "handedness": Names.of_parameter(HANDEDNESS, ProjectiveCamera, "handedness"),
    }


def names_of_samplers() -> dict[str, Names]:
    """Where random numbers come from."""
    return {"samplers": Names.of_parameter(PARTS.names("sampler"), ProgressiveRenderer, "sampler")}


def names_of_aovs() -> dict[str, Names]:
    """Which raw arrays a picture can have beside it."""
    return {"AOVs": Names(tuple(AOVS))}


def names_of_tones() -> dict[str, Names]:
    """The curves for the screen."""
    return {"tones": Names.of_parameter(PARTS.names("tone curve"), Display, "tone")}


def names_of_estimators() -> dict[str, Names]:
    """How light is sampled."""
    return {title: names for title, names in names_of_views().items() if title == "estimators"}


def names_of_rays() -> dict[str, Names]:
    """How rays are intersected."""
    return {
        "intersectors": Names.of_parameter(PARTS.names("intersector"), SceneData, "intersector"),
        "triangle tests": Names.of_parameter(PARTS.names("triangle test"), SceneData, "triangle_test"),
    }


def names_of_surfaces() -> dict[str, Names]:
    """What surfaces and lights are."""
    return {
        "BRDFs": Names(tuple(PARTS.names("BRDF"))),
        "lights": Names(tuple(PARTS.names("light"))),
        "lamp choices": Names.of_parameter(PARTS.names("lamp choice"), SceneData, "lamp_choice"),
    }


def names_of_files() -> dict[str, Names]:
    """The scenes and environments that come with the package."""
    return {
        "scenes": Names(tuple(scene_names())),
        "environments": Names((*shipped_environments(), "none")),
        "up axes": Names.of_parameter(tuple(UP_AXES), SceneData, "up_axis"),
    }


def names_of_archs() -> dict[str, Names]:
    """Where kernels run."""
    return {"archs": Names.of_parameter(runtime.ARCHS, runtime.init, "arch")}


def names_of_scenes() -> dict[str, Names]:
    """What the options of a scene take."""
    return {
        **names_of_files(),
        "lookups": Names.of_parameter(LOOKUPS, Environment, "lookup"),
        "effects": Names.of_parameter(MODES, SceneData, "effects"),
        **names_of_rays(),
        **names_of_surfaces(),
        **names_of_archs(),
        "precisions": Names.of_parameter(runtime.PRECISIONS, runtime.init, "precision"),
    }


def names_of_knobs() -> dict[str, Names]:
    """What a study of accuracy compares."""
    from taichi_tracer.studies import variants

    knobs = (*variants.NAMED, "roulettes")
    return {knob.replace("_", " "): Names(variants.known(knob), variants.USUAL[knob]) for knob in knobs}


LISTS = {
    "scenes": names_of_scenes,
    "files": names_of_files,
    "archs": names_of_archs,
    "pictures": names_of_pictures,
    "estimators": names_of_estimators,
    "cameras": names_of_cameras,
    "samplers": names_of_samplers,
    "aovs": names_of_aovs,
    "tones": names_of_tones,
    "rays": names_of_rays,
    "surfaces": names_of_surfaces,
    "knobs": names_of_knobs,
}


def help_text(lists: Sequence[str]) -> str:
    """The end of a command's help: the names that can be given; ``lists`` says which of ``LISTS``."""
    found: dict[str, Names] = {}
    for name in lists:
        found |= LISTS[name]()
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
