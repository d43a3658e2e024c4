"""What a browser may say to a picture: every value is checked as strictly as an argument of the command line."""

from typing import Any

from taichi_tracer.camera_controller import KEYS
from taichi_tracer.system.errors import InputError, one_of

MOST_TEXT = 200  # characters of a name
FAR = -10.0, 10.0  # pictures: farther than any pointer goes between two events
PIXEL = 0, 1 << 16

OF_HOSTS = {"ack", "save"}  # what the host of the page answers, and not the session
# Type of an event → its members, each with its rule, see ``fits``.
EVENTS: dict[str, dict[str, Any]] = {
    "key": {"key": KEYS, "down": bool},
    "drag": {"dx": FAR, "dy": FAR},
    "zoom": {"by": FAR},
    "pan": {"dx": FAR, "dy": FAR},
    "blur": {},
    "set": {"name": str, "value": object},
    "expose": {},
    "reset": {},
    "explain": {"column": PIXEL, "row": PIXEL, "sample": (0, 1 << 30)},
    "same": {},
    "camera": {},
    "close": {},
    "cancel": {},
    "point": {"column": PIXEL, "row": PIXEL},
    "leave": {},
    "look": dict.fromkeys(("column", "row", "columns", "rows"), PIXEL),
    "size": {"width": (16, 1 << 13), "height": (16, 1 << 13)},
    "split": {"mode": str},
    "equal": {"by": str},
    "side": {"number": (0, 1)},
    "save": {"kind": ("png", "exr")},
    "ack": {"id": (0, 1 << 53)},
}


def fits(value: Any, rule: Any) -> bool:
    """Whether a value follows a rule.

    Args:
        rule: two ends of a number, which is whole if they are; ``str``, a short text; ``bool``; names; or ``object``,
            what a setting checks itself: a number, a short text, yes or no, or null.
    """
    if rule is object:
        return value is None or any(fits(value, one) for one in (bool, str, (-1e9, 1e9)))
    if isinstance(rule, type):
        return isinstance(value, rule) and len(str(value)) <= MOST_TEXT
    if isinstance(rule[0], str):
        return value in rule
    kinds = int if isinstance(rule[0], int) else int | float
    return isinstance(value, kinds) and not isinstance(value, bool) and rule[0] <= value <= rule[1]


def checked(event: Any) -> tuple[str, dict[str, Any]]:
    """(type, members) of an event.

    Raises:
        InputError: it is no event, lacks a member, or a value is not what it must be.
    """
    kind = event.get("type") if isinstance(event, dict) else None
    if not isinstance(kind, str) or kind not in EVENTS:
        raise one_of("event", f"{kind!r:.60}", EVENTS)
    for name, rule in EVENTS[kind].items():
        if name not in event or not fits(event[name], rule):
            raise InputError(f"{kind}: {name} cannot be {event.get(name)!r:.60}")
    return kind, {name: event[name] for name in EVENTS[kind]}
