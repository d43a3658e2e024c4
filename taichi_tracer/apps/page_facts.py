"""What a live page is told about its picture: its state, with every frame; and the choices, when they change."""

import json
from collections.abc import Mapping, Sequence
from typing import Any

from taichi_tracer.apps.choices import Choices
from taichi_tracer.apps.same_again import DISTANCE
from taichi_tracer.apps.split import DIFFERENCE, Split
from taichi_tracer.integrators.controls import BouncesControl, Control, NameControl
from taichi_tracer.renderer import ProgressiveRenderer
from taichi_tracer.system.registry import PARTS

# Members of ``Choices`` that a page is told as they are.
CHOSEN = ("environment", "environments", "triangle_test", "triangle_tests", "lamp_choice", "lamp_choices")
SLIDER_STEPS = 200  # places of a slider of fractions


def state_of(renderers: Sequence[ProgressiveRenderer], split: Split | None, errors: Mapping[int, str]) -> str:
    """What changes with every picture, as JSON.

    Args:
        renderers: those that are shown, one or two. split: how two are shown; None for one.
        errors: id of a renderer → its error in words.
    """
    sides = [
        {"view": r.active.name, "samples": r.samples if r.is_random else 1, "error": errors.get(id(r), "")}
        for r in renderers
    ]
    number = 0 if split is None else split.number
    scale = split.scale if split is not None and split.mode == DIFFERENCE else renderers[number].scale
    told = None if scale is None else {"low": "0", "high": f"{scale.high:.3g}", "text": scale.text}
    return json.dumps({**sides[number], "sides": sides, "scale": told})


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
        "offered": offered,
        "controls": [described(control) for control in r.controls()],
        "exposure": r.display.exposure if r.srgb and not r.has_own_display else None,
        "tone": r.display.part.name if r.srgb else None,
        "tones": PARTS.names("tone curve"),
        "fov": None if r.camera.has_window else float(r.camera.fov),
        "white": choices.white if r.active.name == DISTANCE else None,
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
