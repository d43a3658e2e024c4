"""The names that can be typed: what they lead to, and the list of them at the end of a command's help."""

import shutil
import textwrap
from collections.abc import Iterable, Sequence

from taichi_tracer.files.shipped import shipped_environments
from taichi_tracer.integrators.base import Integrator
from taichi_tracer.picture.aovs import AOVS
from taichi_tracer.progressive import ProgressiveRenderer
from taichi_tracer.renderer import A3Renderer
from taichi_tracer.scene_data_loader import scene_names
from taichi_tracer.settings import DEFAULTS, NO_NAME, OPTIONS
from taichi_tracer.system import runtime
from taichi_tracer.system.errors import one_of
from taichi_tracer.system.parts import PARTS, unfinished

VIEW = "normal"  # what a picture shows when nobody says it
ALL = "all"  # every view of the renderer that shows ``VIEW``
# Options of ``accuracy`` that take names, see ``studies.variants``.
STUDIED = ("estimators", "samplers", "precisions", "triangle_tests", "lookups", "intersectors", "lamp_choices")
STUDIED += ("roulettes",)
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


def view_names() -> list[str]:
    """Every name that some renderer offers, once."""
    return [*dict.fromkeys(name for c in renderers() for name in c.names())]


# ── the end of a help ──


def help_text(options: Sequence[str]) -> str:
    """The end of a command's help: the names that its options take; a star follows what counts when none is given."""
    lines, columns = [], shutil.get_terminal_size().columns
    for option in options:
        for title, (known, usual) in names_of(option).items():
            words = ", ".join(f"{name}*" if name in usual else name for name in known)
            text = f"{title + ':':<{TITLE_WIDTH}}{words}"
            lines += textwrap.wrap(text, columns, subsequent_indent=" " * TITLE_WIDTH, break_on_hyphens=False)
    if any("*" in line for line in lines):
        lines.append("* counts where nothing is said, neither here nor in the scene file.")
    return "\n" + "".join(f"{line}\n" for line in lines)


def names_of(option: str) -> dict[str, tuple[Iterable[str], tuple]]:
    """Title → the names that an option takes, and those that count when none is given; {} where it takes no names."""
    title = option.replace("_", " ")
    if option == "view":
        (first, _), *_ = find_views(VIEW)
        found: dict[str, tuple[Iterable[str], tuple]] = {}
        for renderer_class in renderers():
            known, _ = found.get(renderer_class.what, ((), ()))
            found[renderer_class.what] = dict.fromkeys([*known, *renderer_class.names()]), (VIEW,)
        found[first.what] = [*found[first.what][0], ALL], (VIEW,)
        return found
    if option in ("scene", "what"):
        return {"scene": (scene_names(), ())} | ({} if option == "scene" else names_of("environment"))
    if option == "environment":
        return {title: ((*shipped_environments(), *PARTS.names("environment"), NO_NAME), ())}
    single = {"aov": (AOVS, ()), "arch": (runtime.ARCHS, ("auto",)), "precision": (runtime.PRECISIONS, ("f32",))}
    if option in single:
        return {title: single[option]}
    if option in STUDIED:
        from taichi_tracer.studies import variants

        return {title: (variants.known(option), variants.USUAL[option])}
    known = OPTIONS.get(option)
    if known is None or not (known.part or known.choices):
        return {}
    return {title: (PARTS.names(known.part) if known.part else known.choices, (known.usual or DEFAULTS[option],))}
