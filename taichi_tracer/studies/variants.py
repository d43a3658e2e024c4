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
from taichi_tracer.system.registry import PARTS

NO_ROULETTE, COURSE, BY_THROUGHPUT = "none", *path_settings.ROULETTES
MAX_BOUNCES, RR_START = 5, 3  # the defaults of ``PathSettings``
REFERENCE_LAMPS = "hierarchy"  # of the reference, where choices of lamps are compared: it has the least noise

ROULETTES: dict[Any, str] = {NO_ROULETTE: "no roulette", BY_THROUGHPUT: "roulette by throughput"}
# Attribute of ``Variant`` → what a value of it is called; values of others are names already.
WORDS: dict[str, Callable[[Any], str]] = {
    "fast_math": lambda is_on: "fast math" if is_on else "no fast math",
    "adaptive": lambda is_on: "adaptive" if is_on else "no adaptive",
    "scale": lambda scale: f"resolution x {scale:g}",
    "intersector": lambda name: name or "the scene's own intersector",
    "lamp_choice": lambda name: f"lamps by {name}" if name else "the scene's own choice of lamps",
    "max_bounces": lambda n: "1 bounce" if n == 1 else f"{n} bounces",
    "roulette": lambda q: ROULETTES.get(q) or f"roulette q = {q}",
    "rr_start_bounce": lambda n: f"after bounce {n}",
}


@dataclass(frozen=True)
class Variant:
    """One setting of every knob.

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
    max_bounces: int = MAX_BOUNCES
    roulette: str | float = NO_ROULETTE
    rr_start_bounce: int = RR_START

    def differences(self, other: "Variant") -> list[str]:
        """The names of the knobs that are set otherwise."""
        return [f.name for f in fields(self) if getattr(self, f.name) != getattr(other, f.name)]

    @property
    def label(self) -> str:
        """Estimator, sampler, the bounces of paths, and what differs from the defaults."""
        usual = Variant(self.estimator, self.sampler, max_bounces=self.max_bounces)
        bounces = [self.setting("max_bounces")] * self.is_path
        if self.roulette == NO_ROULETTE:
            usual = replace(usual, rr_start_bounce=self.rr_start_bounce)
        others = [self.setting(name) for name in self.differences(usual)]
        return ", ".join([self.estimator, self.sampler, *bounces, *others])

    def setting(self, knob: str) -> str:
        """One knob in words."""
        value = getattr(self, knob)
        return WORDS[knob](value) if knob in WORDS else str(value)

    @property
    def scene(self) -> tuple:
        """The knobs that belong to the scene: variants in which they are equal share one."""
        return self.lookup, self.triangle_test, self.intersector, self.lamp_choice

    @property
    def film(self) -> tuple:
        """What variants have in common that share a renderer, and with it one film."""
        return self.precision, self.fast_math, *self.scene, self.sampler, self.adaptive, self.scale

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


DIRECT, PATHS = ("uniform", "brdf", "environment", "mis"), ("implicit", "explicit", "path")
# What a study compares if nothing is named: the parameters of ``plan``.
USUAL: dict[str, tuple] = {
    "estimators": DIRECT,
    "samplers": (DEFAULT_SAMPLER, ADAPTIVE_SAMPLER, "independent"),
    "precisions": ("f32", "f64"),
    "triangle_tests": ("watertight", "moller_trumbore"),
    "lookups": ("nearest", "bilinear"),
    "fast_math": (False, True),
    "adaptive": (False, True),
    "scales": (1.0, 0.5),
    "intersectors": (None,),
    "lamp_choices": (None,),
    "max_bounces": (MAX_BOUNCES,),
    "roulettes": (NO_ROULETTE,),
}
NAMED = ("estimators", "samplers", "precisions", "triangle_tests", "lookups", "intersectors", "lamp_choices")
OF_PATHS = ("max_bounces", "roulettes")  # what only paths have
QUESTIONS = ("lamp_choices", *OF_PATHS)  # whoever asks one of these wants its answer alone
OF_QUESTIONS = "lamp_choice", "max_bounces", "roulette"  # their attributes of ``Variant``


def known(knob: str) -> tuple[str, ...]:
    """The names that a parameter of ``plan`` can hold, those of registered parts among them."""
    kinds = {"samplers": "sampler", "triangle_tests": "triangle test", "intersectors": "intersector"}
    kinds |= {"lamp_choices": "lamp choice"}
    if knob in kinds:
        return tuple(PARTS.names(kinds[knob]))
    if knob == "estimators":
        return tuple(PARTS.last_of("renderer", A2Renderer).names() + A4Renderer.names())
    if knob == "roulettes":
        return NO_ROULETTE, BY_THROUGHPUT
    return {"precisions": runtime.PRECISIONS, "lookups": LOOKUPS}[knob]


def attribute_of(knob: str) -> str:
    """The attribute of ``Variant`` that a parameter of ``plan`` sets."""
    return knob if knob == "max_bounces" else knob.removesuffix("s")


def plan(rr_start_bounce: int = RR_START, every: bool = False, **knobs: Sequence | None) -> list[Variant]:
    """Every estimator with every sampler, and each other knob turned alone, from the last estimator and first sampler.

    These two are those of the first variant.

    Args:
        every: every combination of all knobs instead.
        knobs: the values of each of ``USUAL``; what is not given, or None, is chosen by ``usual``. Roulettes are
            "none", "throughput", or numbers q between 0 and 1. The largest of ``max_bounces`` is that of all variants
            that turn another knob, and of the reference.

    Raises:
        InputError: an unknown name, a number that is out of its range, or estimators that cannot be compared.
    """
    asked = {name: tuple(values) for name, values in knobs.items() if values is not None}
    chosen = usual(asked) | asked
    check(chosen, rr_start_bounce, [name for name in OF_PATHS if name in asked])
    chosen["max_bounces"] = tuple(sorted(set(chosen["max_bounces"]), reverse=True))
    *others, last = chosen["estimators"]
    chosen["estimators"] = (last, *(name for name in others if name != last))
    values = {attribute_of(knob): settings for knob, settings in chosen.items()}
    first = Variant(**{name: settings[0] for name, settings in values.items()}, rr_start_bounce=rr_start_bounce)
    estimators, samplers = values.pop("estimator"), values.pop("sampler")
    variants = [replace(first, estimator=e, sampler=s) for e in estimators for s in samplers]
    for name, settings in values.items():
        from_these = list(variants) if every else variants[:1]
        variants += [replace(variant, **{name: value}) for variant in from_these for value in settings[1:]]
    return variants


def usual(asked: dict[str, tuple]) -> dict[str, tuple]:
    """The parameters of ``plan`` if nothing is named but ``asked``.

    If one of ``QUESTIONS`` has several values, every other parameter keeps one value, so that the budget is spent on
    this question. If one of ``OF_PATHS`` is given, estimators of paths are compared.
    """
    asks_one = any(len(asked.get(name, ())) > 1 for name in QUESTIONS)
    estimators = PATHS if any(name in asked for name in OF_PATHS) else DIRECT
    if asks_one:
        return {name: values[:1] for name, values in USUAL.items()} | {"estimators": estimators[-1:]}
    return USUAL | {"estimators": estimators}


def process_of(variant: Variant, base: Variant) -> tuple:
    """What the variants of one process have in common: how Taichi runs, and whether they share a film."""
    return variant.precision, variant.fast_math, variant.film == base.film


def is_of_the_chart(variant: Variant, base: Variant) -> bool:
    """Whether a variant differs from another one only in what the chart of curves compares."""
    return set(variant.differences(base)) <= {"estimator", "sampler", *OF_QUESTIONS}


def by_priority(variants: Sequence[Variant]) -> list[Variant]:
    """The variants, the ones that a short study keeps first: the base, estimators, then knobs, then all samplers."""
    groups = {(): 0, ("estimator",): 1, ("sampler",): 2, ("estimator", "sampler"): 4}

    def rank(variant: Variant) -> tuple[int, int]:
        return groups.get(tuple(variant.differences(variants[0])), 3), variants.index(variant)

    return sorted(variants, key=rank)


def reference_variant(variant: Variant, variants: list[Variant]) -> Variant:
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
        chosen: the parameters of ``plan``. of_paths: those of ``OF_PATHS`` that the user named.
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
