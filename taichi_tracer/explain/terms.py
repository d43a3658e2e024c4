"""The steps on the way from a pixel to its colour, as a tree of what was noted; and its value as a sum of products.

What each direction of each surface of a path contributes:

    value = L_e + Σ throughput · weight · (f_r cos θ / pdf) · L

The factors are numbers that were noted while the sample ran. The difference to the value is shown as a remainder.
"""

import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from functools import reduce
from itertools import pairwise
from typing import Any

import numpy as np

from taichi_tracer.explain.recorded import Entry

# ── steps ──


DIGITS, SHORT = 7, 4  # of a number in the text, and in a product; the JSON has all of them
TRIED = ("a triangle is tried", "a sphere is tried")
WORDS = {"is_met", "is_hit", "is_backfacing", "is_blocked", "is_inside", "is_delta"}  # numbers that are yes or no
WHOLE = {"triangle_id", "material_id", "sphere_id", "node", "brdf", "boxes_met", "depth"}
OF_DIRECTION = ("f_r", "the BRDF's density", "the lights' density")  # which several methods ask for; each is shown once


@dataclass
class Step:
    """A step on the way to the value of a sample.

    Attributes:
        name: what is computed; the handout's name where there is one.
        values: name → number or (n,) array: what the step got, and what it gave.
        steps: the steps within it, in order.
        verdict: what follows from the numbers, in words; "" if nothing does.
        order: its number among all steps.
    """

    name: str
    values: dict[str, Any] = field(default_factory=dict)
    steps: list["Step"] = field(default_factory=list)
    verdict: str = ""
    order: int = 0

    def as_data(self) -> dict[str, Any]:
        """The step as JSON has it."""
        steps = [step.as_data() for step in self.steps]
        return {"step": self.name, "values": as_json(self.values), "verdict": self.verdict, "steps": steps}

    def find(self, name: str) -> list["Step"]:
        """All steps of this name within it, in order."""
        return [step for step in steps_within(self.steps) if step.name == name]


def steps_of(noted: list[tuple[Entry, dict[str, Any]]]) -> list[Step]:
    """The tree of what was noted."""
    root = Step("")
    open_steps, noted_before = [root], set()
    for entry, values in noted:
        if values.get("counts") == 1 or values.get("survival") == 1:
            continue  # nothing happens
        if entry.name == "surface":
            noted_before.clear()
        if entry.name in OF_DIRECTION:
            key = entry.name, *(np.asarray(value).tobytes() for value in values.values())
            if key in noted_before:
                continue
            noted_before.add(key)
        if entry.mark == "end":
            if values.get("is_hit") == 0:
                values = {"is_hit": 0.0}  # the other members of a miss say nothing
            if len(open_steps) > 1:
                open_steps.pop().values.update(values)
            continue
        step = Step(entry.name, dict(values))
        open_steps[-1].steps.append(step)
        if entry.mark == "begin":
            open_steps.append(step)
    judge(root)
    for k, step in enumerate(steps_within(root.steps)):
        step.order = k
    return root.steps


def judge(step: Step, t_min: float = 0.0, t_max: float = math.inf) -> None:
    """Say of every primitive that was tried why it was taken or not."""
    t_min, t_max = float(step.values.get("t_min", t_min)), float(step.values.get("t_max", t_max))
    nearest = t_max
    for inner in step.steps:
        if inner.name in TRIED:
            inner.verdict, nearest = verdict_of(inner.values, t_min, nearest)
        else:
            judge(inner, t_min, t_max)


def verdict_of(values: dict[str, Any], t_min: float, nearest: float) -> tuple[str, float]:
    """(why a primitive was taken or not, the nearest t so far)."""
    taken = float(values["taken"])
    if "det" in values and not values["is_inside"]:
        u, v = float(values["u"]), float(values["v"])
        if values["det"] == 0:
            return "missed: det = 0, the ray is parallel to the plane", nearest
        outside = [name for name, number in (("u", u), ("v", v), ("w", 1 - u - v)) if number < 0]
        return f"missed: {' and '.join(outside) or 'the ray passes beside it'}{' < 0' if outside else ''}", nearest
    if taken == -math.inf:
        return "missed: the ray comes from a side that it passes through, or it misses the box", nearest
    if not taken > t_min:
        return f"missed: t = {number(taken)} is not in front of the origin", nearest
    if taken > nearest:
        return f"hit at t = {number(taken)}, farther than the nearest so far", nearest
    return f"hit at t = {number(taken)}, the nearest so far", taken


def steps_within(steps: list[Step]) -> list[Step]:
    """All steps, those within others too, in order."""
    return [found for step in steps for found in (step, *steps_within(step.steps))]


# ── numbers as words ──


def text_of_value(name: str, value: Any) -> str:
    """ "name = value"."""
    short = name.rpartition(".")[2]
    if short in WORDS:
        return f"{name} = {'yes' if value else 'no'}"
    if short in WHOLE:
        return f"{name} = {int(value)}"
    if np.ndim(value) > 0:
        return f"{name} = ({', '.join(number(one) for one in value)})"
    return f"{name} = {number(value)}"


def number(value: Any, digits: int = DIGITS) -> str:
    """A number with a few digits."""
    return f"{float(value):.{digits}g}".replace("inf", "∞")


def short_text(value: Any) -> str:
    """A number, or three, with ``SHORT`` digits; three that are equal are shown as one."""
    numbers = [number(one, SHORT) for one in np.atleast_1d(value)]
    return numbers[0] if len(set(numbers)) == 1 else f"({', '.join(numbers)})"


def as_json(value: Any) -> Any:
    """A number, an array, or several of them by their names, as JSON allows it."""
    if isinstance(value, dict):
        return {name: as_json(one) for name, one in value.items()}
    if np.ndim(value) > 0:
        return [as_json(one) for one in value]
    one = float(value)
    if not math.isfinite(one):
        return str(one)
    return int(one) if one.is_integer() and abs(one) < 2**53 else one


# ── terms ──


ROUNDING = 1e-5  # of the largest term: a sum of single precision is as exact as that
OF_BRDF, OF_LIGHTS = "a direction from the BRDF", "a sample of the lights"
OF_ONE, AMBIENT, DIRECT, ARRIVES = (
    "a sample of one light",
    "ambient light",
    "light from a direction",
    "light that arrives",
)
NO_RAY = "no ray is sent: it could find no light"
MIRROR = "a mirror or glass: light comes from single directions, where only f_r cos / pdf is finite"
BEHIND = "the light comes from behind the surface"
DARK = "f_r cos is 0 there, or the light comes from behind the triangle"
APPLIED = "weight in reflected"  # what this method gave over the other factors
SEEN, OWN = "what the eye ray sees", "the estimator's own direction"
F_R, COS, PDF_BRDF, PDF_LIGHTS = "f_r", "cos θ", "BRDF's density per sr", "lights' density per sr"
PDF_ONE = "light's own density"  # per solid angle; 1 if it has one direction only
THROUGHPUT, WEIGHT, RATIO, SURVIVAL, L = "throughput", "MIS weight", "f_r cos / pdf", "1 / survival", "L"
Share = Callable[[float, float], float | None]  # (density of a sample, density of the other one) → its MIS weight


@dataclass
class Term:
    """A product that is added to the value of a sample.

    Attributes:
        surface: where it is reflected to the viewer: 1 is the first surface; 0 is the light that the eye ray sees.
        how: what gave the direction.
        numbers: f_r, the cosine and both densities of the direction, per solid angle, as far as they were asked for.
        factors: name → number or (3,): what is multiplied.
        why: what follows from the numbers, in words; "" if nothing does.
    """

    surface: int
    how: str
    numbers: dict[str, Any] = field(default_factory=dict)
    factors: dict[str, Any] = field(default_factory=dict)
    why: str = ""

    @property
    def value(self) -> np.ndarray:
        """(3,) the product of the factors."""
        return reduce(np.multiply, self.factors.values(), np.ones(3))

    @property
    def where(self) -> str:
        """The surface, in words."""
        return f"hit {self.surface}" if self.surface > 0 else "the eye"


@dataclass
class Vertex:
    """A surface of a path, and what ran there.

    Attributes:
        number: 1 is the first surface. throughput: (3,) before it.
        surface: the numbers of its step.
        steps: those after it, up to the next surface.
    """

    number: int
    throughput: np.ndarray
    surface: dict[str, Any]
    steps: list[Step]

    def first(self, name: str, value: str, w_i: Any = None, usual: Any = None) -> Any:
        """A number of the first step of this name, and of this direction if one is given; else ``usual``."""
        for step in self.steps:
            is_asked = step.name == name and value in step.values
            if is_asked and (w_i is None or np.array_equal(step.values.get("w_i"), w_i)):
                return step.values[value]
        return usual

    def terms(self, share: Share) -> Iterator[Term]:
        """What each of its directions contributes."""
        given = [step.values["w_i"] for step in self.steps if step.name == OF_BRDF]
        for step in self.steps:
            if step.name in (OF_LIGHTS, OF_ONE):
                yield self.from_light(step, share)
            elif step.name == OF_BRDF:
                yield self.from_brdf(step, share)
            elif step.name == "sample" and "f_cos_over_pdf" in step.values:
                w_i = step.values["w_i"]
                if not any(np.array_equal(w_i, other) for other in given):
                    yield self.from_estimator(step)
            elif step.name == AMBIENT and np.max(step.values[L]) > 0:
                yield Term(self.number, AMBIENT, {}, {THROUGHPUT: self.throughput, L: step.values[L]})

    def from_light(self, step: Step, share: Share) -> Term:
        """The term of a sample of the lights, or of a light that is sampled by itself, such as a point light."""
        w_i, pdf, light = (step.values[name] for name in ("w_i", "pdf", "L_i"))
        numbers, f_cos, is_blocked = self.numbers(w_i), np.zeros(3), self.first("shadow ray", "is_blocked", w_i)
        if step.name == OF_ONE:
            f_cos, weight = numbers.get(F_R, f_cos) * max(0.0, numbers[COS]), None
        else:
            f_cos, weight = self.first("f_r cos", "f_cos", w_i, f_cos), share(pdf, numbers.get(PDF_BRDF, 0.0))
        why = ""
        if is_blocked:
            why = "something blocks the light"
        elif np.max(light) <= 0:
            why = "the light is dark there"
        elif np.max(f_cos) <= 0:
            why = MIRROR if self.surface["is_delta"] else BEHIND if numbers[COS] <= 0 else DARK
        factors = self.factors(weight, f_cos / pdf) | {L: np.zeros(3) if is_blocked else light}
        name = PDF_ONE if step.name == OF_ONE else PDF_LIGHTS
        return Term(self.number, step.name, numbers | {name: pdf}, factors, why)

    def from_brdf(self, step: Step, share: Share) -> Term:
        """The term of a direction from the BRDF."""
        w_i, survival = step.values["w_i"], self.first("Russian roulette", "survival")
        numbers = self.numbers(w_i)
        if self.surface["is_delta"]:
            numbers = {COS: numbers[COS]}  # the others are infinite
        weight = self.first("share_of_hit", "share_of_hit")
        if weight is None:
            weight = share(numbers.get(PDF_BRDF, 0.0), numbers.get(PDF_LIGHTS, 0.0))
            weight = 1.0 if weight is not None and self.surface["is_delta"] else weight
        light = self.first(DIRECT, "L_i", w_i, self.first(ARRIVES, "L_i"))
        factors = self.factors(weight, self.first("f_r cos / pdf", "f_cos_over_pdf", w_i, np.zeros(3)))
        if survival is not None:
            factors[SURVIVAL] = 1 / survival
        why = MIRROR if self.surface["is_delta"] else ""
        if light is None:
            light, why = np.zeros(3), NO_RAY if survival is None else "Russian roulette ends the path"
        elif np.max(light) <= 0:
            why = "no light arrives from there"
        return Term(self.number, OF_BRDF, numbers, factors | {L: light}, why)

    def from_estimator(self, step: Step) -> Term:
        """The term of a direction that the estimator drew itself."""
        w_i, ratio = step.values["w_i"], step.values["f_cos_over_pdf"]
        light = self.first(DIRECT, "L_i", w_i)
        why = "" if light is not None else "not taken: a mirror or glass"
        light = np.zeros(3) if light is None else light
        return Term(self.number, OWN, self.numbers(w_i), self.factors(None, ratio) | {L: light}, why)

    def numbers(self, w_i: np.ndarray) -> dict[str, Any]:
        """f_r, the cosine and both densities of a direction, as far as they were asked for."""
        found = {
            F_R: self.first("f_r", "f_r", w_i),
            COS: float(np.dot(self.surface["normal"], w_i)),
            PDF_BRDF: self.first("the BRDF's density", "pdf", w_i),
            PDF_LIGHTS: self.first("the lights' density", "pdf", w_i),
        }
        return {name: number for name, number in found.items() if number is not None}

    def factors(self, weight: float | None, ratio: np.ndarray) -> dict[str, Any]:
        """The factors before the light; without a weight there is none."""
        return {THROUGHPUT: self.throughput} | ({} if weight is None else {WEIGHT: weight}) | {RATIO: ratio}


def terms_of(steps: list[Step], share: Share) -> list[Term]:
    """The terms of a sample; none if it is not made of light.

    Args:
        steps: of the sample.
        share: the MIS weight of a sample; it gives None if the estimator has none.
    """
    seen = [step for step in steps if step.name == "emitted"]
    if not seen:
        return []
    flat, throughput = steps_within(steps), np.ones(3)
    terms = [Term(0, SEEN, {}, {"L_e": seen[0].values["L_e"]})]
    starts = [k for k, step in enumerate(flat) if step.name == "surface"]
    for k, (begin, end) in enumerate(pairwise([*starts, len(flat)]), start=1):
        vertex = Vertex(k, throughput, flat[begin].values, flat[begin + 1 : end])
        own = list(vertex.terms(share))
        terms += own
        for term in own:
            if term.how == OF_BRDF:
                throughput = term.factors[THROUGHPUT] * term.factors[RATIO] * term.factors.get(SURVIVAL, 1.0)
    for step in flat:
        if step.name == "bounces that count":
            for term in terms:
                if term.surface == step.values["depth"]:
                    term.factors["counts"], term.why = 0.0, "light after so many bounces does not count"
    weigh(terms, [step.values["reflected"] for step in flat if "reflected" in step.values])
    return terms


def weigh(terms: list[Term], reflected: list[np.ndarray]) -> None:
    """Give the only term with light the weight that ``reflected`` applied, if it has none: see ``one_sample``."""
    lit = [term for term in terms if RATIO in term.factors and term.value.max() > 0]
    if len(lit) == len(reflected) == 1 and WEIGHT not in lit[0].factors:
        value, given = lit[0].value, reflected[0]
        weight = float(given.sum() / value.sum())
        if abs(weight - 1) > ROUNDING and np.allclose(value * weight, given, rtol=ROUNDING, atol=0):
            lit[0].factors[APPLIED] = weight


def remainder(value: np.ndarray, terms: list[Term]) -> np.ndarray:
    """(3,) what the terms do not explain of the value of a sample; 0 if it is as small as rounding."""
    values = np.array([term.value for term in terms])
    rest = value - values.sum(axis=0)
    return np.zeros(3) if abs(rest).max() <= ROUNDING * abs(values).max() else rest
