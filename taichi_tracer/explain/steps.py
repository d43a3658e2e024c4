"""The steps on the way from a pixel to its colour: a tree of what was noted, and its numbers as words."""

import math
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from taichi_tracer.explain.log import Entry

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
