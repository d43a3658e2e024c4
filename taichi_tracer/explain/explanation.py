"""The explanation of a pixel: a tree of steps with their numbers, as text, as JSON and in notebooks, with drawings."""

import html
import json
import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field
from functools import reduce
from itertools import groupby, pairwise
from typing import Any

import numpy as np

from taichi_tracer.files import page
from taichi_tracer.files.images import to_bytes
from taichi_tracer.files.page import FONT, INK, svg_of
from taichi_tracer.tones.display import Display

# ── steps ──


DIGITS, SHORT = 7, 4  # of a number in the text, and in a product; the JSON has all of them
TRIED = ("a triangle is tried", "a sphere is tried")
OF_DIRECTION = ("f_r", "the BRDF's density", "the lights' density")  # which several methods ask for; each is shown once


@dataclass(frozen=True)
class Entry:
    """What one place in the code notes.

    Attributes:
        name: of the step. mark: "begin", "end" or "" for a step without steps within it.
        values: (name, how many numbers it has; 0 for a single one) of each value.
    """

    name: str
    mark: str
    values: tuple[tuple[str, int], ...]


@dataclass
class Step:
    """A step on the way to the value of a sample.

    Attributes:
        name: what is computed; the handout's name where there is one.
        values: name → number or (n,) array: what the step got, and what it gave.
        steps: the steps within it, in order.
        verdict: what follows from the numbers, in words; "" if nothing does.
    """

    name: str
    values: dict[str, Any] = field(default_factory=dict)
    steps: list["Step"] = field(default_factory=list)
    verdict: str = ""

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
    """ "name = value"; names such as is_hit are of numbers that are yes or no."""
    if name.rpartition(".")[2].startswith("is_"):
        return f"{name} = {'yes' if value else 'no'}"
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
            dark = "f_r cos is 0 there, or the light comes from behind the triangle"
            dark = "the light comes from behind the surface" if numbers[COS] <= 0 else dark
            why = MIRROR if self.surface["is_delta"] else dark
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


# ── drawings: the path from the side, and the pixel ──


RAY, OF_LIGHT, SURFACE, BOUNCE = "#2f7fc1", "#d9820b", "#8a97a5", "#2f9e5b"
SIZE = (6.0, 4.0)  # of a drawing, in inches
CAPTION = "the path from the eye, seen from the side"
STUB = 0.35  # of the extent of the path: the length of an arrow that leaves it; twice the length of a drawn surface
LEAST = 1e-3  # the weight of normals for the plane of a path: they decide only where the path is a straight line
FLAT = 1e-9  # a shorter vector has no direction
SIDE, RING = 160, 23  # of the small picture: its width in pixels; the radius of the ring is one part in so many


def path_drawing(points: np.ndarray, normals: np.ndarray, arrows: Sequence[tuple]) -> str:
    """The path on the plane that fits it best, as SVG whose letters have the colour of the text around it.

    Args:
        points: (n, 3): the eye, then the surfaces; the last one may be far away.
        normals: (n − 1, 3) of the surfaces.
        arrows: (from where, along which unit vector, its colour, what it is) of the directions that were sampled.
    """
    from matplotlib.figure import Figure

    axes = Figure(figsize=SIZE, facecolor="none", layout="constrained").add_subplot(aspect="equal")
    axes.margins(0.1)
    axes.axis("off")
    frame = plane_of(points, normals)
    flat = points @ frame.T
    length = STUB * max(float(np.ptp(flat, axis=0).max()), FLAT)
    for a, b in zip(flat[:-1], flat[1:], strict=True):
        draw_arrow(axes, a, b, RAY)
    for k, (place, (x, y)) in enumerate(zip(flat[1:], normals @ frame.T, strict=True), start=1):
        across = length / 2 * np.array([-y, x])
        axes.plot(*zip(place - across, place + across, strict=True), color=SURFACE, linewidth=4, alpha=0.5)
        write(axes, place, f"hit {k}")
    write(axes, flat[0], "eye")
    for origin, direction, colour, what in arrows:
        draw_arrow(axes, frame @ origin, frame @ origin + length * (frame @ direction), colour, what)
    drawn = svg_of(axes.figure, CAPTION).replace("var(--ink)", "currentColor")
    return f"<figure>{drawn}<figcaption>{CAPTION}</figcaption></figure>"


def plane_of(points: np.ndarray, normals: np.ndarray) -> np.ndarray:
    """(2, 3) two unit vectors that span the plane that fits the path best, the second one as far upwards as it can."""
    spread = points - points[0]
    frame = np.linalg.svd(np.vstack([spread, LEAST * np.abs(spread).max() * normals]))[2][:2]
    turn = np.arctan2(*frame[:, 1])
    cos, sin = np.cos(turn), np.sin(turn)
    return np.array([[cos, -sin], [sin, cos]]) @ frame


def draw_arrow(axes: Any, start: np.ndarray, end: np.ndarray, colour: str, label: str = "") -> None:
    """An arrow between two points of the plane, with a label at its end."""
    axes.plot(*zip(start, end, strict=True), color=colour, linewidth=0)  # an annotation does not widen the axes
    axes.annotate("", end, start, arrowprops={"arrowstyle": "-|>", "color": colour, "shrinkA": 0, "shrinkB": 0})
    way = end - start
    write(axes, end, label, 14 * way / max(float(np.linalg.norm(way)), FLAT))


def write(axes: Any, place: np.ndarray, text: str, offset: Any = (14, 10)) -> None:
    """Words beside a point of the plane, so many points away from it."""
    axes.annotate(text, place, offset, textcoords="offset points", ha="center", va="center", fontsize=FONT, color=INK)


def thumbnail(image: np.ndarray, column: int, row: int, display: Display, srgb: bool) -> str:
    """The picture, small, with a ring around a pixel.

    Args:
        image: (height, width, 3) linear. column, row: the pixel, from the left and from the top.
        display, srgb: how the picture is shown, see ``images.to_bytes``.
    """
    step = max(1, max(image.shape) // SIDE)
    small = to_bytes(image[::step, ::step], srgb, display)
    rows, columns = np.indices(small.shape[:2])
    distance = np.hypot(rows - row / step, columns - column / step)
    off = abs(distance - max(2, max(small.shape) // RING))
    small[off < 2] = 0  # a white ring with black edges is seen on bright and on dark ground
    small[off < 1] = 255
    return page.picture(small, f"the picture so far: the ring is around column {column}, row {row}", SIDE)


# ── the explanation ──


# Step that samples a direction → its colour, and what it is.
SAMPLED = {OF_LIGHTS: (OF_LIGHT, "light"), OF_BRDF: (BOUNCE, "BRDF")}
NUMBERS = F_R, COS, PDF_BRDF, PDF_LIGHTS, PDF_ONE, THROUGHPUT, WEIGHT, RATIO, SURVIVAL, L, APPLIED
MOST_ALIKE = 12  # steps of one name, one after the other, that the text shows; all are in the JSON
RAYS = ("query_segment", "query_ray", "is_occluded")
COUNTED = {
    "a node is entered": "nodes entered",
    "a box is tried": "boxes tried",
    TRIED[0]: "triangles tried",
    TRIED[1]: "spheres tried",
}


@dataclass
class Explanation:
    """Every number on the way from a pixel to its colour, for one of its samples.

    ``print`` shows it as text; ``to_json`` and ``to_html`` have the same. The numbers are those of the picture:
    ``mean`` is the pixel of ``renderer.image()``, to the last bit.

    Attributes:
        renderer, integrator: what makes the picture.
        column, row: the pixel, counted from the left and from the top, as in ``image()[row, column]``.
        x, y: the same pixel as the handouts count, from the left and from the bottom.
        sample: the index of the sample. samples: how many the pixel has.
        value: (3,) what this sample gives. mean: (3,) the mean of all samples. error: (3,) its standard error.
        steps: what was computed, in order.
        counts: how often nodes were entered and primitives were tried; the steps show only the first ones.
        is_complete: False if the sample takes so many steps that the last ones are missing.
        terms: what is added up to ``value``; empty if the sample is not made of light.
        thumbnail: HTML of the picture with a mark at the pixel; "" if nothing was rendered.
    """

    renderer: str
    integrator: str
    column: int
    row: int
    x: int
    y: int
    sample: int
    samples: int
    value: np.ndarray
    mean: np.ndarray
    error: np.ndarray
    steps: list[Step]
    counts: dict[str, int]
    is_complete: bool = True
    terms: tuple[Term, ...] = ()
    thumbnail: str = ""

    @property
    def title(self) -> str:
        """One line that says which pixel and which sample it is."""
        return (
            f"pixel in column {self.column}, row {self.row} from the top (x = {self.x}, y = {self.y}), "
            f"sample {self.sample}: {self.renderer}, {self.integrator}"
        )

    @property
    def conclusion(self) -> list[str]:
        """What the sample and the pixel come to, a line each."""
        lines = [f"this sample    {text_of_value('value', self.value)}"]
        if self.samples > 1:
            lines.append(f"the pixel      {text_of_value('mean', self.mean)} of {self.samples} samples")
            lines.append(f"               {text_of_value('standard error', self.error)}")
        rays = sum(len(self.find(name)) for name in RAYS)
        words = [f"{rays} ray{'s' * (rays != 1)} traced"]
        words += [f"{self.counts[name]:,} {plural}" for name, plural in COUNTED.items() if self.counts.get(name)]
        lines.append(f"work           {', '.join(words)}")
        if not self.is_complete:
            lines.append("               the sample takes more steps than are kept: the last ones are missing")
        return lines

    def find(self, name: str) -> list[Step]:
        """All steps of this name, in order."""
        return Step("", steps=self.steps).find(name)

    def to_json(self) -> str:
        """JSON of everything; infinite numbers and NaN are the words "inf", "-inf" and "nan"."""
        names = ("renderer", "integrator", "column", "row", "x", "y", "sample", "samples")
        data: dict[str, Any] = {name: getattr(self, name) for name in names}
        data |= {name: as_json(getattr(self, name)) for name in ("value", "mean", "error")}
        data |= {"counts": self.counts, "steps": [step.as_data() for step in self.steps]}
        if self.terms:
            data |= {"terms": [term_as_data(term) for term in self.terms], "remainder": as_json(self.remainder)}
        return json.dumps(data, indent=1)

    @property
    def remainder(self) -> np.ndarray:
        """(3,) what the terms leave unexplained of the value; 0 if nothing but rounding."""
        values = np.array([np.zeros(3), *(term.value for term in self.terms)])
        rest = self.value - values.sum(axis=0)
        return np.zeros(3) if abs(rest).max() <= ROUNDING * abs(values).max() else rest

    @property
    def equation(self) -> list[str]:
        """The value as a sum, a line each; nothing if there are no terms."""
        if not self.terms:
            return []
        lines = [f"value = {' + '.join(short_text(term.value) for term in self.terms)}"]
        lines.append(f"      = {short_text(sum(term.value for term in self.terms))}")
        if self.remainder.any():
            lines.append(f"{short_text(self.remainder)} of the value is not explained by these terms")
        return lines

    def drawing(self) -> str:
        """SVG of the path; "" if the eye ray hits nothing."""
        surfaces = [step.values for step in self.find("surface")]
        rays = [step for name in RAYS for step in self.find(name) if "ray.origin" in step.values]
        if not surfaces or not rays:
            return ""
        points = np.array([rays[0].values["ray.origin"], *(surface["position"] for surface in surfaces)])
        arrows, number = [], 0  # of the surface
        for step in steps_within(self.steps):
            number += step.name == "surface"
            goes_on = step.name == OF_BRDF and number < len(surfaces)  # the path itself shows this direction
            if step.name in SAMPLED and not goes_on:
                colour, what = SAMPLED[step.name]
                arrows.append((surfaces[number - 1]["origin"], step.values["w_i"], colour, f"{what} {number}"))
        return path_drawing(points, np.array([surface["normal"] for surface in surfaces]), arrows)

    def __str__(self) -> str:
        lines = [self.title, *lines_of(self.steps, 1)]
        if self.terms:
            lines.append("what adds up to the value of this sample")
            lines += [f"  {line}" for term in self.terms for line in lines_of_term(term)]
            lines += [f"  {line}" for line in self.equation]
        return "\n".join([*lines, *self.conclusion])

    __repr__ = __str__

    def _repr_html_(self) -> str:
        """The steps as a list that can be opened and closed, for notebooks and pages."""
        conclusion = "\n".join(html.escape(line) for line in [*self.equation, *self.conclusion])
        body = "".join(as_html(step, 0) for step in grouped(self.steps))
        table = terms_as_html(self.terms) if self.terms else ""
        figures = self.thumbnail + self.drawing()
        return f"<p>{html.escape(self.title)}</p>{figures}{table}<pre style='overflow-x: auto'>{conclusion}</pre>{body}"


# ── text ──


def lines_of(steps: list[Step], depth: int) -> list[str]:
    """The steps as lines, indented by their depth."""
    lines = []
    for step in grouped(steps):
        indent = "  " * depth
        values = "  ".join(text_of_value(name, value) for name, value in step.values.items())
        verdict = f"  → {step.verdict}" if step.verdict else ""
        lines.append(f"{indent}{step.name:<{max(1, 30 - len(indent))}} {values}{verdict}".rstrip())
        lines += lines_of(step.steps, depth + 1)
    return lines


def grouped(steps: list[Step]) -> list[Step]:
    """The steps without the last of many that are alike, whose number stands instead."""
    shown: list[Step] = []
    for _, alike in groupby(steps, lambda step: step.name):
        run = list(alike)
        hits = [step for step in run[MOST_ALIKE:] if step.verdict.startswith("hit")]
        left = len(run) - MOST_ALIKE - len(hits)
        shown += [*run[:MOST_ALIKE], *hits, *([Step(f"… {left} more like these")] if left > 0 else [])]
    return shown


def as_html(step: Step, depth: int) -> str:
    """A step, with what is within it."""
    values = " &ensp; ".join(html.escape(text_of_value(name, value)) for name, value in step.values.items())
    verdict = f" <em>{html.escape(step.verdict)}</em>" if step.verdict else ""
    head = f"<b>{html.escape(step.name)}</b> &ensp; <code>{values}</code>{verdict}"
    if not step.steps:
        return f"<div style='margin-left: 1.2em'>{head}</div>"
    inner = "".join(as_html(one, depth + 1) for one in grouped(step.steps))
    is_open = " open" if depth < 1 else ""
    return f"<details style='margin-left: 1.2em'{is_open}><summary>{head}</summary>{inner}</details>"


# ── terms ──


def lines_of_term(term: Term) -> list[str]:
    """The product, and the numbers of its direction."""
    product = " × ".join(f"{name} {short_text(value)}" for name, value in term.factors.items())
    why = f"  → {term.why}" if term.why else ""
    lines = [f"{term.where}, {term.how}: {product} = {short_text(term.value)}{why}"]
    if term.numbers:
        lines.append("  " + "  ".join(f"{name} = {short_text(value)}" for name, value in term.numbers.items()))
    return lines


def term_as_data(term: Term) -> dict[str, Any]:
    """The term as JSON has it."""
    numbers = {"value": term.value, "numbers": term.numbers, "factors": term.factors}
    return {"surface": term.surface, "how": term.how, "verdict": term.why} | as_json(numbers)


def terms_as_html(terms: Sequence[Term]) -> str:
    """A table with a row for each term; the reason of a zero stands below its direction."""
    rows = [
        {
            "where": term.where,
            "direction": html.escape(term.how) + f"<br><em>{html.escape(term.why)}</em>" * bool(term.why),
            "contributes": f"<b>{short_text(term.value)}</b>",
        }
        | {name: short_text(value) for name, value in (term.numbers | term.factors).items()}
        for term in terms
    ]
    columns = [name for name in ("where", "direction", "contributes", *NUMBERS) if any(name in row for row in rows)]
    style = "<style>.terms td:nth-child(2) { text-align: left; white-space: normal; min-width: 13em }</style>"
    table = page.cards([{name: row.get(name, "") for name in columns} for row in rows], columns)
    return f"<div class='terms' style='overflow-x: auto; font-size: 0.85em'>{style}{table}</div>"
