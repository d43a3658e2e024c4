"""What a page says is checked: every kind of event, every member."""

import math

import pytest

from taichi_tracer.apps.events import EVENTS, checked
from taichi_tracer.system.errors import InputError

GOOD = {
    "key": {"key": "w", "down": True},
    "drag": {"dx": 0.1, "dy": -0.2},
    "zoom": {"by": 1},
    "pan": {"dx": 0.0, "dy": 0.5},
    "use": {"what": "view", "name": "normal"},
    "environment": {"name": "studio"},
    "triangle_test": {"name": "watertight"},
    "lamp_choice": {"name": "power"},
    "ground": {"name": "nothing"},
    "control": {"name": "max_bounces", "value": 3},
    "exposure": {"value": -2.5},
    "expose": {},
    "tone": {"name": "filmic"},
    "fov": {"value": 45},
    "white": {"value": 4.0},
    "point": {"column": 3, "row": 4},
    "explain": {"column": 3, "row": 4, "sample": 0},
    "split": {"mode": "sides"},
    "side": {"number": 1},
    "save": {"kind": "png"},
    "ack": {"id": 7},
}


@pytest.mark.parametrize("kind", EVENTS)
def test_every_kind_is_taken_and_nothing_else_of_it(kind):
    members = GOOD.get(kind, {})
    assert checked({"type": kind, **members, "more": "ignored"}) == (kind, members)


@pytest.mark.parametrize("kind", [kind for kind in EVENTS if EVENTS[kind]])
def test_every_member_must_be_there_and_right(kind):
    for name in EVENTS[kind]:
        members = {**GOOD[kind]}
        del members[name]
        with pytest.raises(InputError, match=f"the event {kind} lacks '{name}'"):
            checked({"type": kind, **members})
        for bad in (math.nan, math.inf, {"a": 1}, ["x"] * 3, "x" * 1000, b"x", -1e300):
            with pytest.raises(InputError):
                checked({"type": kind, **members, name: bad})


@pytest.mark.parametrize("event", [None, 3, [], "key", {}, {"type": None}, {"type": ["key"]}, {"type": "__init__"}])
def test_what_is_no_event_is_an_error_in_one_line(event):
    with pytest.raises(InputError) as error:
        checked(event)
    assert "\n" not in str(error.value)
    assert len(str(error.value)) < 500


def test_the_ends_of_a_range_belong_to_it():
    assert checked({"type": "fov", "value": 170})[1] == {"value": 170.0}
    with pytest.raises(InputError, match=r"fov: value must be from 1 to 170, not 170\.5"):
        checked({"type": "fov", "value": 170.5})
    with pytest.raises(InputError, match="must be a finite number, not True"):
        checked({"type": "exposure", "value": True})
    with pytest.raises(InputError, match="column must be a whole number"):
        checked({"type": "explain", "column": 1.5, "row": 0, "sample": 0})
