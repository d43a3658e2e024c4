"""What is told of a pixel: a tree of steps with their numbers, as text, as JSON and in notebooks."""

import html
import json
import math
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from taichi_tracer.explain import drawing
from taichi_tracer.explain.log import Entry

BRDF = "BRDF"  # what a direction is called that the BRDF gave
MOST_ALIKE = 12  # steps of one name, one after the other, that the text shows; all are in the JSON
DIGITS = 7  # of a number in the text; the JSON has all of them
RAYS = ("query_segment", "query_ray", "is_occluded")
TRIED = ("a triangle is tried", "a sphere is tried")
COUNTED = {"a node is entered": "nodes entered", "a box is tried": "boxes tried"}
COUNTED |= {TRIED[0]: "triangles tried", TRIED[1]: "spheres tried"}
WORDS = {"is_met", "is_hit", "is_backfacing", "is_blocked", "is_inside"}  # numbers that are yes or no
WHOLE = {"triangle_id", "material_id", "sphere_id", "node", "brdf", "boxes_met"}


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
        data: dict[str, Any] = {"step": self.name}
        if self.values:
            data["values"] = {name: as_json(value) for name, value in self.values.items()}
        if self.verdict:
            data["verdict"] = self.verdict
        if self.steps:
            data["steps"] = [step.as_data() for step in self.steps]
        return data

    def find(self, name: str) -> list["Step"]:
        """All steps of this name within it, in order."""
        found = []
        for step in self.steps:
            found += ([step] if step.name == name else []) + step.find(name)
        return found


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
        triangles: (3, 3) vertices of each triangle that the path hit.
        lobe: f_r max(n·ω_i, 0) of the first surface, see ``drawing.lobe_drawing``; None if it is a mirror, or a miss.
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
    triangles: tuple[np.ndarray, ...] = ()
    lobe: np.ndarray | None = None

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
        lines.append(f"work           {self.work}")
        if not self.is_complete:
            lines.append("               the sample takes more steps than are kept: the last ones are missing")
        return lines

    @property
    def work(self) -> str:
        """How many rays were sent, nodes entered and primitives tried."""
        rays = sum(len(self.find(name)) for name in RAYS)
        words = [f"{rays} ray{'s' * (rays != 1)} traced"]
        for name, plural in COUNTED.items():
            if self.counts.get(name):
                words.append(f"{self.counts[name]:,} {plural}")
        return ", ".join(words)

    def find(self, name: str) -> list[Step]:
        """All steps of this name, in order."""
        return Step("", steps=self.steps).find(name)

    def to_dict(self) -> dict[str, Any]:
        """Everything, as JSON has it."""
        names = ("renderer", "integrator", "column", "row", "x", "y", "sample", "samples")
        data: dict[str, Any] = {name: getattr(self, name) for name in names}
        data |= {name: as_json(getattr(self, name)) for name in ("value", "mean", "error")}
        return data | {"counts": self.counts, "steps": [step.as_data() for step in self.steps]}

    def to_json(self) -> str:
        """JSON; infinite numbers and NaN are the words "inf", "-inf" and "nan"."""
        return json.dumps(self.to_dict(), indent=1)

    def drawings(self) -> list[str]:
        """SVG: the path, and the first surface with its lobe; nothing if the eye ray hits nothing."""
        surfaces = self.find("surface")
        rays = [step for name in RAYS for step in self.find(name) if "ray.origin" in step.values]
        if not surfaces or not rays:
            return []
        points = np.array([rays[0].values["ray.origin"], *(s.values["position"] for s in surfaces)])
        arrows = []
        for step in steps_within(self.steps):
            where = max((k for k, s in enumerate(surfaces) if s.order < step.order), default=0)
            for colour, what in sampled(step):
                arrows.append((surfaces[where].values["origin"], step.values["w_i"], colour, what))
        last = surfaces[-1].values["origin"]  # from the others, the path goes on along the direction of the BRDF
        shown = [arrow for arrow in arrows if arrow[3] != BRDF or arrow[0] is last]
        found = [drawing.path_drawing(points, self.triangles, shown)]
        if self.lobe is not None:
            first = surfaces[0].values
            own = [(d, colour, what) for o, d, colour, what in arrows if o is surfaces[0].values["origin"]]
            found.append(drawing.lobe_drawing(self.lobe, first["w_o"], first["normal"], own))
        return found

    def __str__(self) -> str:
        return "\n".join([self.title, *lines_of(self.steps, 1), *self.conclusion])

    __repr__ = __str__

    def _repr_html_(self) -> str:
        """The steps as a list that can be opened and closed, for notebooks and pages."""
        conclusion = "".join(f"<div>{html.escape(line)}</div>" for line in self.conclusion)
        body = "".join(as_html(step, 0) for step in grouped(self.steps))
        return f"<p>{html.escape(self.title)}</p>{''.join(self.drawings())}{body}<pre>{conclusion}</pre>"


def steps_within(steps: list[Step]) -> list[Step]:
    """All steps, those within others too, in order."""
    return [found for step in steps for found in (step, *steps_within(step.steps))]


def sampled(step: Step) -> list[tuple[str, str]]:
    """(colour, what it is) of the direction that a step sampled; nothing if it sampled none."""
    if step.name == "a direction from the BRDF":
        return [(drawing.LOBE, BRDF)]
    if step.name in ("a direction from the light", "a sample of the lights"):
        return [(drawing.LIGHT, "light")]
    return []


def steps_of(noted: list[tuple[Entry, dict[str, Any]]]) -> list[Step]:
    """The tree of what was noted."""
    root = Step("")
    open_steps = [root]
    for entry, values in noted:
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
    """The steps without the last of many that are alike, whose number is told instead."""
    shown: list[Step] = []
    run = 0
    for i, step in enumerate(steps):
        run = run + 1 if i > 0 and steps[i - 1].name == step.name else 1
        if run <= MOST_ALIKE or step.verdict.startswith("hit"):
            shown.append(step)
        elif i + 1 == len(steps) or steps[i + 1].name != step.name:
            shown.append(Step(f"… {run - MOST_ALIKE} more like these"))
    return shown


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


def number(value: Any) -> str:
    """A number with a few digits."""
    return f"{float(value):.{DIGITS}g}".replace("inf", "∞")


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


def as_json(value: Any) -> Any:
    """A number or an array, as JSON allows it."""
    if np.ndim(value) > 0:
        return [as_json(one) for one in value]
    one = float(value)
    if not math.isfinite(one):
        return str(one)
    return int(one) if one.is_integer() and abs(one) < 2**53 else one
