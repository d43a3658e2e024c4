"""What a browser may say to a picture: every value is checked as strictly as an argument of the command line."""

import math
from collections.abc import Callable
from typing import Any

from taichi_tracer.camera_controller import KEYS
from taichi_tracer.system.errors import InputError, one_of

MOST_TEXT = 200  # characters of a name
MOST_DRAG = 10.0  # pictures: farther than any pointer goes between two events

Check = Callable[[str, Any], Any]


def number(low: float, high: float) -> Check:
    """A check for a finite number between two ends."""

    def check(name: str, value: Any) -> float:
        """The number, or an InputError that names the value."""
        # A whole number may be too large for math.isfinite.
        if isinstance(value, bool) or not isinstance(value, int | float) or value != value or abs(value) == math.inf:
            raise InputError(f"{name} must be a finite number, not {shown(value)}")
        if not low <= value <= high:
            raise InputError(f"{name} must be from {low:g} to {high:g}, not {shown(value)}")
        return float(value)

    return check


def whole(low: int, high: int) -> Check:
    """A check for a whole number between two ends."""

    def check(name: str, value: Any) -> int:
        """The number, or an InputError that names the value."""
        if isinstance(value, bool) or not isinstance(value, int) or not low <= value <= high:
            raise InputError(f"{name} must be a whole number from {low} to {high}, not {shown(value)}")
        return value

    return check


def text(name: str, value: Any) -> str:
    """A check for a short text."""
    if not isinstance(value, str) or len(value) > MOST_TEXT:
        raise InputError(f"{name} must be a text of at most {MOST_TEXT} characters, not {shown(value)}")
    return value


def key(name: str, value: Any) -> str:
    """A check for a key that moves the camera."""
    if value not in KEYS:
        raise one_of(name, shown(value), KEYS)
    return value


def flag(name: str, value: Any) -> bool:
    """A check for yes or no."""
    if not isinstance(value, bool):
        raise InputError(f"{name} must be true or false, not {shown(value)}")
    return value


def anything(name: str, value: Any) -> Any:
    """A check for a value that the setting checks itself: a number, a short text, yes or no, or null."""
    if value is None or isinstance(value, bool):
        return value
    return text(name, value) if isinstance(value, str) else number(-1e9, 1e9)(name, value)


OF_HOSTS = {"ack", "save"}  # what the host of the page answers, and not the session
# Type of an event → its members, each with its check.
EVENTS: dict[str, dict[str, Check]] = {
    "key": {"key": key, "down": flag},
    "drag": {"dx": number(-MOST_DRAG, MOST_DRAG), "dy": number(-MOST_DRAG, MOST_DRAG)},
    "zoom": {"by": number(-MOST_DRAG, MOST_DRAG)},
    "pan": {"dx": number(-MOST_DRAG, MOST_DRAG), "dy": number(-MOST_DRAG, MOST_DRAG)},
    "blur": {},
    "set": {"name": text, "value": anything},
    "expose": {},
    "reset": {},
    "explain": {"column": whole(0, 1 << 16), "row": whole(0, 1 << 16), "sample": whole(0, 1 << 30)},
    "same": {},
    "camera": {},
    "close": {},
    "cancel": {},
    "point": {"column": whole(0, 1 << 16), "row": whole(0, 1 << 16)},
    "leave": {},
    "look": {name: whole(0, 1 << 16) for name in ("column", "row", "columns", "rows")},
    "size": {"width": whole(16, 1 << 13), "height": whole(16, 1 << 13)},
    "split": {"mode": text},
    "equal": {"by": text},
    "side": {"number": whole(0, 1)},
    "save": {"kind": text},
    "ack": {"id": whole(0, 1 << 53)},
}


def checked(event: Any) -> tuple[str, dict[str, Any]]:
    """(type, members) of an event.

    Raises:
        InputError: it is no event, lacks a member, or a value is not what it must be.
    """
    if not isinstance(event, dict):
        raise InputError(f"an event must be an object, not {shown(event)}")
    kind = event.get("type")
    if not isinstance(kind, str) or kind not in EVENTS:
        raise one_of("event", shown(kind), EVENTS)
    members = {}
    for name, check in EVENTS[kind].items():
        if name not in event:
            raise InputError(f"the event {kind} lacks {name!r}")
        members[name] = check(f"{kind}: {name}", event[name])
    return kind, members


def shown(value: Any) -> str:
    """A value in a message, cut where it is long."""
    text_of_value = repr(value)
    return text_of_value if len(text_of_value) <= 60 else text_of_value[:57] + "..."
