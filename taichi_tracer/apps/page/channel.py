"""What goes between a page and the session: events and frames.

Every value of an event is checked as strictly as an argument of the command line. Frames are quick pictures while the
camera moves, and lossless ones at rest.
"""

import io
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
import taichi as ti
from PIL import Image

from taichi_tracer.camera_controller import KEYS
from taichi_tracer.files.images import to_bytes
from taichi_tracer.formulas import vector_math as tm
from taichi_tracer.progressive import ProgressiveRenderer
from taichi_tracer.system.errors import InputError, one_of
from taichi_tracer.tones.display import Display

# ── events ──


MOST_TEXT = 200  # characters of a name
FAR = -10.0, 10.0  # pictures: farther than any pointer goes between two events
PIXEL = 0, 1 << 16
OFF, DIFFERENCE = "off", "difference"  # ways to show one picture, or two; the third one is "sides"
SIDES = ("left", "right")  # of two pictures

# Type of an event → its members, each with its rule, see ``fits``.
EVENTS: dict[str, dict[str, Any]] = {
    "key": {"key": KEYS, "down": bool},
    "move": dict.fromkeys(("orbit_x", "orbit_y", "pan_x", "pan_y", "nearer"), FAR),
    "blur": {},
    "set": {"name": str, "value": object},
    "expose": {},
    "reset": {},
    "explain": {"column": PIXEL, "row": PIXEL, "sample": (0, 1 << 30)},
    "same": {},
    "close": {},
    "cancel": {},
    "point": {"column": PIXEL, "row": PIXEL},
    "look": dict.fromkeys(("column", "row", "columns", "rows"), PIXEL),
    "size": {"width": (16, 1 << 13), "height": (16, 1 << 13)},
    "compare": {"mode": (OFF, "sides", DIFFERENCE), "side": SIDES, "equal": ("samples", "seconds")},
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


# ── frames ──


QUALITY = 90  # of JPEG
FASTEST = 1  # of the levels of PNG


@dataclass(frozen=True)
class Frame:
    """One picture with what is known about it.

    Attributes:
        number: counts the frames. kind: "jpeg" or "png". data: the file.
        state: what the page shows beside the picture. The file of the next frame is the same object until it changes.
    """

    number: int
    kind: str
    data: bytes
    state: dict[str, Any]

    def news_after(self, former: "Frame") -> tuple[dict[str, Any], bytes]:
        """What is new of the state and the file, for a page that has a former frame."""
        new = {k: value for k, value in self.state.items() if k not in former.state or former.state[k] != value}
        data = b"" if former.data is self.data else self.data
        return {**new, "id": self.number, "kind": self.kind, "lost": ""}, data


NO_FRAME = Frame(0, "", b"", {})  # before the first one


def exact_pixels(renderer: ProgressiveRenderer) -> np.ndarray:
    """(h, w, 3) bytes: those of the PNG that ``renderer.save`` writes."""
    return to_bytes(renderer.image(), renderer.srgb, renderer.display if renderer.srgb else Display())


def quick_pixels(renderer: ProgressiveRenderer) -> np.ndarray:
    """(h, w, 3) bytes of the picture for a moment; a byte may differ by one."""
    pixels = np.empty((renderer.height, renderer.width, 3), np.uint8)
    _copy_rows(renderer.canvas, pixels, renderer.srgb, renderer.display.part, renderer.display.scale)
    return pixels


@ti.kernel
def _copy_rows(
    canvas: ti.template(),
    pixels: ti.types.ndarray(dtype=ti.u8, ndim=3),
    srgb: ti.template(),
    tone: ti.template(),
    exposure: ti.f32,
):
    """Every pixel as bytes, the top row first."""
    for row in range(pixels.shape[0]):
        for column in range(pixels.shape[1]):
            color = canvas[column, canvas.shape[1] - 1 - row]
            if ti.static(srgb):
                color = encode_srgb(tone.curve(tm.clamp(color * exposure, 0.0, tone.white)))
            for k in ti.static(range(3)):
                pixels[row, column, k] = ti.cast(255 * tm.clamp(color[k], 0.0, 1.0) + 0.5, ti.u8)


@ti.func
def encode_srgb(linear):
    """The sRGB transfer function of IEC 61966-2-1, as files are written (C-14)."""
    c = tm.clamp(linear, 0.0, 1.0)
    return ti.select(c <= 0.0031308, 12.92 * c, 1.055 * tm.pow(c, tm.vec3(1 / 2.4)) - 0.055)


def encoded(pixels: np.ndarray, kind: str) -> bytes:
    """The file of a picture: "jpeg" or "png"."""
    options = {"quality": QUALITY} if kind == "jpeg" else {"compress_level": FASTEST}
    file = io.BytesIO()
    Image.fromarray(pixels).save(file, kind.upper(), **options)
    return file.getvalue()


# ── pages ──


IN_FLIGHT = 2  # frames that were sent and not yet shown: with more, a slow connection would fall behind


class Watcher:
    """A page that watches.

    Args:
        session: see ``session.Session``. send: sends a state and the bytes of a picture or a file.

    Attributes:
        last: the frame that was sent last. shown: the number of the last one that the page shows.
    """

    def __init__(self, session: Any, send: Callable[[dict[str, Any], bytes], None]) -> None:
        self.session, self.send = session, send
        self.last = NO_FRAME
        self.shown = 0

    @property
    def is_ready(self) -> bool:
        """Whether the page can take another frame."""
        return self.last.number - self.shown < IN_FLIGHT

    def show(self, frame: Frame) -> None:
        """Send what is new of a frame."""
        state, data = frame.news_after(self.last)
        self.last = frame  # before the page can say that it shows it
        self.send(state, data)

    def post(self, event: Any) -> None:
        """Give an event to the session.

        Raises:
            InputError: it is malformed; see ``checked``.
        """
        kind, members = checked(event)
        if kind in ("ack", "save"):
            members["watcher"] = self
        self.session.add(kind, members)
