"""The ways to render one picture that a study of accuracy compares."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, fields, replace
from typing import Any

from taichi_tracer.environment import LOOKUPS
from taichi_tracer.integrators import path_settings
from taichi_tracer.progressive import ProgressiveRenderer
from taichi_tracer.renderer import A2Renderer, A4Renderer
from taichi_tracer.sampler import ADAPTIVE_SAMPLER, DEFAULT_SAMPLER
from taichi_tracer.system import runtime
from taichi_tracer.system.errors import InputError, one_of
from taichi_tracer.system.parts.registry import PARTS

NO_ROULETTE, COURSE, BY_THROUGHPUT = "none", *path_settings.ROULETTES
REFERENCE_LAMPS = "hierarchy"  # of the reference, where choices of lamps are compared: it has the least noise
# Attribute of ``Variant`` → what a value of it is called; values of others are names already.
WORDS: dict[str, Callable[[Any], str]] = {
    "fast_math": lambda is_on: "fast math" if is_on else "no fast math",
    "adaptive": lambda is_on: "adaptive" if is_on else "not adaptive",
    "scale": lambda scale: f"resolution × {scale:g}",
    "intersector": lambda name: name or "the scene's intersector",
    "lamp_choice": lambda name: f"lamps by {name}" if name else "the scene's choice of lamps",
    "max_bounces": lambda n: "1 bounce" if n == 1 else f"{n} bounces",
    "roulette": lambda q: {NO_ROULETTE: "no roulette", BY_THROUGHPUT: "roulette by throughput"}.get(q, f"roulette {q}"),
    "lookup": lambda name: f"{name} look-up",
}


@dataclass(frozen=True)
class Variant:
    """One value of every knob.

    Attributes:
        scale: of the resolution: 0.5 renders half as many pixels along each side.
        intersector, lamp_choice: None is the one that the scene has, or the default of ``SceneData``.
        max_bounces, rr_start_bounce: of paths, as for ``PathSettings``.
        roulette: of paths: "none", "throughput", or the constant q of the course as a number.
    """

    estimator: str = "mis"
    sampler: str = DEFAULT_SAMPLER
    triangle_test: str = "watertight"
    precision: str = "f32"
    fast_math: bool = False
    lookup: str = "nearest"
    adaptive: bool = False
    scale: float = 1.0
    intersector: str | None = None
    lamp_choice: str | None = None
    max_bounces: int = 5
    roulette: str | float = NO_ROULETTE
    rr_start_bounce: int = 3

    def difference(self, base: "Variant") -> str:
        """The name of the knob that has another value than in the first variant; "" for the first variant itself."""
        return next((f.name for f in fields(self) if getattr(self, f.name) != getattr(base, f.name)), "")

    def label(self, base: "Variant") -> str:
        """The estimator, and what differs from the first variant."""
        knob = self.difference(base)
        return self.estimator if knob in ("", "estimator") else f"{self.estimator}, {self.value_in_words(knob)}"

    def value_in_words(self, knob: str) -> str:
        """The value of one knob in words."""
        value = getattr(self, knob)
        return WORDS[knob](value) if knob in WORDS else str(value)

    @property
    def process(self) -> tuple:
        """Variants in which this is equal are rendered by one process: Taichi runs there in one way."""
        return self.precision, self.fast_math

    @property
    def scene(self) -> tuple:
        """Variants in which this is equal share a scene."""
        return self.lookup, self.triangle_test, self.intersector, self.lamp_choice

    @property
    def renderer(self) -> tuple:
        """Variants in which this is equal share a renderer, and with it a film."""
        return *self.scene, self.is_path, self.sampler, self.adaptive, self.scale

    @property
    def is_path(self) -> bool:
        """Whether light bounces."""
        return is_path(self.estimator)

    @property
    def paths(self) -> dict:
        """The arguments of ``PathSettings.set``."""
        values = {"max_bounces": self.max_bounces, "rr_start_bounce": self.rr_start_bounce}
        if self.roulette in (NO_ROULETTE, BY_THROUGHPUT):
            named = COURSE if self.roulette == NO_ROULETTE else BY_THROUGHPUT
            return values | {"roulette": named, "rr_termination_probability": 0.0}
        return values | {"roulette": COURSE, "rr_termination_probability": self.roulette}


PATHS = ("path", "explicit", "implicit")
# What a study compares if nothing is named: the arguments of ``plan``, each with the value of the first variant first.
USUAL: dict[str, tuple] = {
    "estimators": ("mis", "uniform", "brdf", "environment"),
    "samplers": (DEFAULT_SAMPLER, ADAPTIVE_SAMPLER, "independent"),
    "precisions": ("f32", "f64"),
    "triangle_tests": ("watertight", "moller_trumbore"),
    "lookups": ("nearest", "bilinear"),
    "fast_math": (False, True),
    "adaptive": (False, True),
    "scales": (1.0, 0.5),
    "intersectors": (None,),
    "lamp_choices": (None,),
    "max_bounces": (5,),
    "roulettes": (NO_ROULETTE,),
}
NAMED = ("estimators", "samplers", "precisions", "triangle_tests", "lookups", "intersectors", "lamp_choices")
OF_PATHS = ("max_bounces", "roulettes")  # what only paths have
ALL = ("all",)  # estimators: of direct light, or of paths where they are asked about


def known(knob: str) -> tuple[str, ...]:
    """The names that an argument of ``plan`` can hold, those of registered parts among them."""
    kinds = {"samplers": "sampler", "triangle_tests": "triangle test", "intersectors": "intersector"}
    kinds |= {"lamp_choices": "lamp choice"}
    if knob in kinds:
        return tuple(PARTS.names(kinds[knob]))
    if knob == "estimators":
        return tuple(PARTS.last_of("renderer", A2Renderer).names() + A4Renderer.names())
    if knob == "roulettes":
        return NO_ROULETTE, BY_THROUGHPUT
    return {"precisions": runtime.PRECISIONS, "lookups": LOOKUPS}[knob]


def plan(rr_start_bounce: int = 3, **knobs: Sequence | None) -> list[Variant]:
    """The first variant, and each knob turned alone from it.

    Args:
        knobs: the values of each of ``USUAL``, or ``ALL`` that are known; None is not given. If several values of a
            knob are given, only what is given is compared; otherwise what ``USUAL`` has. Roulettes are "none",
            "throughput", or numbers q between 0 and 1. The largest of ``max_bounces`` is that of the first variant,
            and of the reference.

    Raises:
        InputError: an unknown name, a number that is out of its range, or estimators that cannot be compared.
    """
    given = {name: tuple(values) for name, values in knobs.items() if values is not None}
    of_paths = any(name in given for name in OF_PATHS)
    every = {name: known(name) for name, values in given.items() if values == ALL}
    if "estimators" in every:
        every["estimators"] = tuple(name for name in known("estimators") if is_path(name) == of_paths)
    asked = given | every
    usual = USUAL | {"estimators": PATHS} if of_paths else USUAL
    if any(len(values) > 1 for values in asked.values()):
        usual = {name: values[:1] for name, values in usual.items()}
    chosen = usual | asked
    check(chosen, rr_start_bounce, [name for name in OF_PATHS if name in asked])
    chosen["max_bounces"] = tuple(sorted(chosen["max_bounces"], reverse=True))
    values = {knob if knob == "max_bounces" else knob.removesuffix("s"): found for knob, found in chosen.items()}
    first = Variant(**{name: found[0] for name, found in values.items()}, rr_start_bounce=rr_start_bounce)
    others = [replace(first, **{name: value}) for name, found in values.items() for value in found[1:]]
    return list(dict.fromkeys([first, *others]))


def reference_variant(variant: Variant, variants: Sequence[Variant]) -> Variant:
    """What the reference of a variant is rendered with: the package's own parts, whatever is compared with them."""
    choices = {v.lamp_choice for v in variants}
    own = Variant(
        estimator="path" if variant.is_path else "mis",
        lamp_choice=variant.lamp_choice if len(choices) == 1 else REFERENCE_LAMPS,
        max_bounces=max(v.max_bounces for v in variants),
    )
    of_scene = ("precision", "fast_math", "lookup", "triangle_test", "intersector")
    return replace(own, **{knob: getattr(variant, knob) for knob in of_scene})


def check(chosen: dict[str, tuple], rr_start_bounce: int, of_paths: list[str]) -> None:
    """Raise an InputError for an unknown name, a number out of its range, or estimators that cannot be compared.

    Args:
        chosen: the arguments of ``plan``. of_paths: those of ``OF_PATHS`` that the user named.
    """
    for knob in NAMED:
        for name in (name for name in chosen[knob] if name is not None):
            if name not in known(knob):
                raise one_of(knob.removesuffix("s").replace("_", " "), name, known(knob))
    paths = [name for name in chosen["estimators"] if is_path(name)]
    direct = [name for name in chosen["estimators"] if name not in paths]
    if paths and direct:
        raise InputError(
            f"accuracy: light bounces with {', '.join(paths)}, and not with {', '.join(direct)}: these pictures have "
            "different means, so that no reference fits both: compare one kind at a time"
        )
    if of_paths and direct:
        raise InputError(
            f"accuracy: {of_paths[0]} is of paths, and light does not bounce with {', '.join(direct)}: "
            f"use estimators among {', '.join(A4Renderer.names())}"
        )
    for roulette in chosen["roulettes"]:
        if isinstance(roulette, str) and roulette not in known("roulettes"):
            raise one_of("roulette", roulette, (*known("roulettes"), "or a number q with 0 < q < 1"))
        if not isinstance(roulette, str) and not 0 < roulette < 1:
            raise InputError(f"roulettes: q must be more than 0 and less than 1, not {roulette!r}")
    for bounces in chosen["max_bounces"]:
        path_settings.check(bounces, rr_start_bounce, 0.0, COURSE, None)


def is_path(estimator: str) -> bool:
    """Whether light bounces with an estimator."""
    return estimator in A4Renderer.names()


def renderer_of(estimator: str) -> type[ProgressiveRenderer]:
    """The renderer that offers an estimator, of direct light or of paths."""
    return A4Renderer if is_path(estimator) else PARTS.last_of("renderer", A2Renderer)
