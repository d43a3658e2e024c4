"""Two pictures of one camera beside each other; and what a live page is told of its pictures and choices."""

import json
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from taichi_tracer.apps.choices import Choices
from taichi_tracer.integrators.controls import BouncesControl, Control, NameControl
from taichi_tracer.progressive import ProgressiveRenderer
from taichi_tracer.system.errors import one_of
from taichi_tracer.system.registry import PARTS
from taichi_tracer.tones.heat import Scale, heat, round_up

OFF, SIDES, DIFFERENCE = "off", "sides", "difference"
MODES = {OFF: "one picture", SIDES: "two pictures, one beside the other", DIFFERENCE: "how far the two differ"}
BRIGHTEST = 99.0  # percent of the pixels that the scale of the difference covers: a few are far off in noisy pictures
# Members of ``Choices`` that a page is told as they are.
CHOSEN = tuple(name + end for name in ("environment", "triangle_test", "lamp_choice", "ground") for end in ("", "s"))
SLIDER_STEPS = 200  # places of a slider of fractions


class Split:
    """Two sides, each with choices of its own, and one camera.

    Attributes:
        sides: the choices of the left and of the right picture. number: which of them the controls change, 0 or 1.
        mode: one of ``MODES``, except "off".
        scale: what the colours of the difference mean, for the page; None if it is not shown.
    """

    def __init__(self, choices: Choices, mode: str) -> None:
        self.sides, self.number, self.mode = (choices, choices.beside()), 1, mode
        self.scale: Scale | None = None

    @classmethod
    def begun(cls, former: "Split | None", choices: Choices, mode: str) -> "Split | None":
        """The split of a mode: the former one if there is one, else one that begins with the same choices twice.

        Raises:
            InputError: there is no such mode.
        """
        if mode not in MODES:
            raise one_of("split", mode, MODES)
        if mode == OFF:
            return None
        if former is None:
            return cls(choices, mode)
        former.mode, former.scale = mode, None
        return former

    @property
    def choices(self) -> Choices:
        """What the controls change."""
        return self.sides[self.number]

    def pixels(self, make: Callable[[ProgressiveRenderer], np.ndarray]) -> np.ndarray:
        """(h, 2 w, 3) bytes of both pictures, the left one first; or (h, w, 3) of their difference.

        Args:
            make: gives the (h, w, 3) bytes of one renderer's picture.
        """
        left, right = (one.renderer for one in self.sides)
        if self.mode == SIDES:
            return np.concatenate([make(left), make(right)], axis=1)
        values = np.abs(left.image().astype(np.float64) - right.image()).mean(axis=2)
        largest = round_up(float(np.percentile(values, BRIGHTEST)) or float(values.max()))
        text = f"difference of left and right, mean of red, green and blue; its mean is {values.mean():.3g}"
        self.scale = Scale(largest, text)
        return np.floor(255 * heat(values, largest) + 0.5).astype(np.uint8)


# ── what the page is told ──


MEASURING = "measuring …"


class Told(NamedTuple):
    """An error in words, and the samples per pixel of the picture that had it."""

    error: str
    samples: int

    def beside(self, samples: int) -> str:
        """The error beside a number of samples, with its own where they differ; not that of a much noisier picture."""
        if 2 * self.samples < samples:
            return MEASURING
        return self.error if self.samples == samples else f"{self.error} at {self.samples}"


def state_of(
    renderers: Sequence[ProgressiveRenderer],
    split: Split | None,
    errors: Mapping[int, Told],
    pointed: dict[str, Any] | None = None,
) -> str:
    """What changes with every picture, as JSON.

    Args:
        renderers: those that are shown, one or two. split: how two are shown; None for one.
        errors: id of a renderer → its error, as it was told last.
        pointed: what is known about the pixel under the pointer.
    """
    sides = []
    for r in renderers:
        told, samples = errors.get(id(r)), r.samples if r.is_random else 1
        error = "" if told is None or told.samples > samples else told.beside(samples)
        sides.append({"view": r.active.name, "samples": samples, "error": error})
    number = 0 if split is None else split.number
    scale = split.scale if split is not None and split.mode == DIFFERENCE else renderers[number].scale
    told = None if scale is None else {"low": "0", "high": f"{scale.high:.3g}", "text": scale.text}
    return json.dumps({**sides[number], "sides": sides, "scale": told, "pointed": pointed})


def details_of(choices: Choices, split: Split | None) -> dict[str, Any]:
    """What can be chosen, and what is chosen."""
    r = choices.renderer
    offered = [
        {"what": cls.what, "names": [[one.name, one.label or one.name] for one in offers]}
        for cls, offers in choices.offered
    ]
    return {
        **{name: getattr(r, name) for name in ("width", "height", "what")},
        **{name: getattr(choices, name) for name in CHOSEN},
        "scene": Path(r.scene_data.source).stem,
        "offered": offered,
        "controls": [described(control) for control in r.controls()],
        "exposure": r.display.exposure if r.srgb and not r.has_own_display else None,
        "tone": r.display.part.name if r.srgb else None,
        "tones": PARTS.names("tone curve"),
        "fov": None if r.camera.has_window else float(r.camera.fov),
        "white": choices.white if r.active.name == "distance" else None,
        "split": None if split is None else {"mode": split.mode, "side": split.number},
    }


def described(control: Control) -> dict[str, Any]:
    """A control as JSON."""
    if isinstance(control, BouncesControl):
        value = None if control.value is None else list(control.value)
        return {"kind": "bounces", "name": control.name, "value": value, "most": control.most}
    found: dict[str, Any] = {name: getattr(control, name) for name in ("name", "value", "label")}
    if isinstance(control, NameControl):
        return {**found, "kind": "name", "names": list(control.names)}
    low, high = control.low, control.high
    is_whole = isinstance(low, int) and isinstance(high, int)
    step = 1 if is_whole else (high - low) / SLIDER_STEPS
    return {**found, "kind": "slider", "low": low, "high": high, "step": step}
