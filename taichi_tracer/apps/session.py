"""A picture that is watched from a browser or a notebook: it takes events, renders, and makes frames.

The session belongs to one thread, which calls ``step`` again and again: Taichi's kernels must not be launched from
several threads. Other threads ``post`` events and wait for frames. A frame is made only if somebody waits for one, so
that a slow connection gets fewer frames instead of a queue of old ones.
"""

import html
import io
import json
import threading
import time
import traceback
from collections import deque
from collections.abc import Callable, Sequence
from concurrent.futures import Future
from dataclasses import dataclass
from typing import Any

import numpy as np
from PIL import Image

from taichi_tracer.apps import camera_controller
from taichi_tracer.apps.camera_controller import Pose
from taichi_tracer.apps.choices import Choices
from taichi_tracer.apps.events import checked
from taichi_tracer.apps.same_again import DISTANCE, as_command, as_python, position_of
from taichi_tracer.files.images import encode_png, to_bytes
from taichi_tracer.integrators.controls import BouncesControl, NameControl
from taichi_tracer.renderer import ProgressiveRenderer
from taichi_tracer.system.errors import InputError, one_of
from taichi_tracer.system.registry import PARTS
from taichi_tracer.tones.display import Display

MOST_EVENTS = 2000  # that wait; when there are more, the oldest drags are dropped
MOVING = 0.15  # seconds after the last movement: until then the picture is sent as JPEG
QUALITY = 90  # of JPEG
REST_EVERY = 1.0  # seconds between two lossless pictures while samples are added
ERROR_EVERY = 0.5  # seconds between two looks at the error: each reads the whole film
FRAME_EVERY = 1 / 60  # seconds between two frames at least
WORK = 0.02  # seconds of rendering between two looks at the events
FORGOTTEN = 10.0  # seconds without anybody who waits for a frame: then nothing is rendered
MOST_POINTS = 200  # of a curve of the error
SLOW_FRAME = 0.06  # seconds: a moving picture stutters beyond it
LONGEST_STEP = 0.25  # seconds: a held key moves the camera no farther at once


@dataclass(frozen=True)
class Frame:
    """One picture with what is known about it.

    Attributes:
        number: counts the frames. kind: "jpeg" or "png". data: the file. state: what else the page shows, as JSON.
    """

    number: int
    kind: str
    data: bytes
    state: str


class Session:
    """See the module.

    Args:
        renderer: what is shown first.
        scene_options: words of the command line that make the scene, for the command that makes the picture again.
        now: the clock, in seconds.
    """

    def __init__(
        self,
        renderer: ProgressiveRenderer,
        scene_options: Sequence[str] = (),
        now: Callable[[], float] = time.monotonic,
    ) -> None:
        self.now = now
        self.choices, self.scene_options = Choices(renderer), tuple(scene_options)
        geometry = renderer.scene_data.geometry
        self.speed = camera_controller.speed_for(geometry.low, geometry.high)
        self.first_camera = position_of(renderer.camera)
        self.keys: set[str] = set()
        self.message, self.explanation = "", ""
        self.curves: dict[str, list[list[float]]] = {}
        self._events: deque[tuple[str, dict[str, Any]]] = deque()
        self._tasks: deque[tuple[Callable[[], Any], Future]] = deque()
        self._lock = threading.Condition()
        self._frame: Frame | None = None
        self._frames, self._waiting = 0, 0
        self._last_wait = self.now()
        self._last_step = self._moved_at = self.now()
        self._framed_at, self._framed_samples, self._framed_kind = 0.0, -1, ""
        self._error, self._error_at, self._begun = None, 0.0, self.now()
        self._sent_settings: dict[str, Any] = {}
        self._has_moved, self._is_over = False, False
        self.renderer.eye_rays.use_packets = False  # until the picture turns out to be slow

    @property
    def renderer(self) -> ProgressiveRenderer:
        """The renderer that shows."""
        return self.choices.renderer

    # ── for other threads ──

    def post(self, event: Any) -> None:
        """Take an event.

        Raises:
            InputError: it is malformed; see ``events.checked``.
        """
        kind, members = checked(event)
        with self._lock:
            if len(self._events) >= MOST_EVENTS:
                self._events.popleft()
            self._events.append((kind, members))
            self._lock.notify_all()

    def call(self, function: Callable[[], Any], patience: float = 30.0) -> Any:
        """What a function returns that the session's own thread calls; it may use the renderer."""
        future: Future = Future()
        with self._lock:
            self._tasks.append((function, future))
            self._lock.notify_all()
        return future.result(patience)

    def wait_for_frame(self, since: int, patience: float) -> Frame | None:
        """The newest frame if it is newer than ``since``; None if none comes in time, or the session is over."""
        end = time.monotonic() + patience
        with self._lock:
            self._waiting += 1
            self._lock.notify_all()
            try:
                while not self._is_over:
                    self._last_wait = self.now()
                    if self._frame is not None and self._frame.number > since:
                        return self._frame
                    left = end - time.monotonic()
                    if left <= 0:
                        return None
                    self._lock.wait(min(left, 1.0))
                return None
            finally:
                self._waiting -= 1
                self._last_wait = self.now()

    def newest(self, since: int) -> Frame | None:
        """The newest frame if it is newer than ``since``."""
        with self._lock:
            return self._frame if self._frame is not None and self._frame.number > since else None

    def watch(self) -> None:
        """Note that somebody watches, who does not wait for frames in a thread."""
        self._last_wait = self.now()

    def send_again(self) -> None:
        """Make a frame for somebody who has none yet."""
        self._framed_kind, self._sent_settings = "", {}

    def close(self) -> None:
        """Let every thread that waits go on."""
        with self._lock:
            self._is_over = True
            for _, future in self._tasks:
                future.cancel()
            self._tasks.clear()
            self._lock.notify_all()

    # ── for its own thread ──

    def step(self, patience: float = 0.05) -> bool:
        """Take the events, move the camera, render for a moment and make a frame if one is wanted.

        Args:
            patience: seconds to wait if there is nothing to do.

        Returns:
            Whether anything was done.
        """
        with self._lock:
            if not (self._events or self._tasks or self.keys or self._wants_work()):
                self._lock.wait(patience)
            events, tasks = list(self._events), list(self._tasks)
            self._events.clear()
            self._tasks.clear()
        for function, future in tasks:
            answer(function, future)
        orbit, zoom, pan = self.take(events)
        now = self.now()
        self.move(min(now - self._last_step, LONGEST_STEP), orbit, zoom, pan)
        self._last_step = now
        is_busy = self.is_watched and self._wants_work()
        if is_busy:
            self.render()
            self.make_frame()
        return bool(events or tasks or is_busy)

    @property
    def is_watched(self) -> bool:
        """Whether anybody has waited for a frame lately."""
        return self._waiting > 0 or self.now() - self._last_wait < FORGOTTEN

    @property
    def is_moving(self) -> bool:
        """Whether the picture has changed since the last frame, or a moment ago."""
        return self._has_moved or self.now() - self._moved_at < MOVING

    def _wants_work(self) -> bool:
        """Whether samples or frames are missing."""
        if not self.is_watched:
            return False
        is_final = self.is_final and self._framed_kind == "png" and self._framed_samples == self.renderer.film.samples
        return not is_final or not self.renderer.is_current() or self.settings() != self._sent_settings

    @property
    def is_final(self) -> bool:
        """Whether the picture is complete: a view without random samples."""
        return not self.renderer.is_random and self.renderer.is_current() and self.renderer.film.samples > 0

    def render(self) -> None:
        """Add samples for a moment."""
        if self.is_final:
            return
        if not self.renderer.is_current():
            self._begun, self._error, self._error_at = self.now(), None, 0.0
        begun = self.now()
        end = begun + WORK
        while True:
            self.renderer.render()
            if self.now() - begun > SLOW_FRAME and self.renderer.eye_rays.can_use_packets:
                self.renderer.eye_rays.use_packets = None  # it is worth compiling the fast form: the renderer decides
            if self.now() >= end or not self.renderer.is_random or self.is_moving:
                break

    def take(self, events: Sequence[tuple[str, dict[str, Any]]]) -> tuple[tuple[float, float], float, tuple]:
        """Do what events ask for. Returns how far the camera is turned, brought nearer and shifted."""
        orbit, zoom, pan = [0.0, 0.0], 0.0, [0.0, 0.0]
        for kind, members in events:
            if kind == "drag":
                orbit = [orbit[0] + members["dx"], orbit[1] + members["dy"]]
            elif kind == "zoom":
                zoom += members["by"]
            elif kind == "pan":
                pan = [pan[0] + members["dx"], pan[1] + members["dy"]]
            elif kind == "key":
                (self.keys.add if members["down"] else self.keys.discard)(members["key"])
            elif kind == "blur":
                self.keys.clear()
            elif kind != "ack":
                self.message = ""
                try:
                    getattr(self, f"on_{kind}")(**members)
                except Exception as error:  # nothing that a page asks for ends the picture
                    self.message = " ".join(str(error).split())
                    if not isinstance(error, InputError):
                        traceback.print_exc()
                self._moved_at, self._has_moved = self.now(), True
        return (orbit[0], orbit[1]), zoom, (pan[0], pan[1])

    def move(self, seconds: float, orbit: tuple[float, float], zoom: float, pan: tuple[float, float]) -> None:
        """Move the camera as keys, wheel and pointer say."""
        if not (self.keys or zoom or any(orbit) or any(pan)):
            return
        camera = self.renderer.camera
        pose = camera_controller.step(
            Pose.of(camera), self.keys, seconds, orbit, zoom, self.speed, self.choices.scene.up_axis
        )
        if any(pan):
            pose = camera_controller.shift(pose, *pan, camera)
        camera.set_camera_parameters(**pose.parameters())
        self._moved_at, self._has_moved = self.now(), True

    # ── what can be chosen ──

    def on_use(self, what: str, name: str) -> None:
        """Show another view or estimator."""
        found = [cls for cls, _ in self.choices.offered if cls.what == what]
        if not found:
            raise one_of("kind", what, [cls.what for cls, _ in self.choices.offered])
        self.choices.use(found[0], name)

    def on_environment(self, name: str) -> None:
        """Choose the light from far away."""
        if name not in self.choices.environments:
            raise one_of("environment", name, self.choices.environments)
        self.choices.set_environment(name)

    def on_triangle_test(self, name: str) -> None:
        """Choose the triangle test."""
        self._step_to("triangle_test", name)

    def on_lamp_choice(self, name: str) -> None:
        """Choose how samples choose among lamps."""
        self._step_to("lamp_choice", name)

    def _step_to(self, what: str, name: str) -> None:
        known = getattr(self.choices, f"{what}s")
        if name not in known:
            raise one_of(what.replace("_", " "), name, known)
        while getattr(self.choices, what) != name:
            getattr(self.choices, f"next_{what}")()

    def on_control(self, name: str, value: Any) -> None:
        """Change a value of the integrator."""
        control = next((c for c in self.renderer.active.controls() if c.name == name), None)
        if control is None:
            raise InputError(f"{self.renderer.active.name} has no {name} that can be changed")
        if isinstance(control, BouncesControl):
            value = None if value is None else tuple(None if one is None else int(one) for one in value)
        elif not isinstance(control, NameControl) and isinstance(control.low, int) and isinstance(control.high, int):
            value = int(value)
        self.renderer.active.change(name, value)

    def on_exposure(self, value: float) -> None:
        """Choose the exposure in stops."""
        self.renderer.set_display(exposure=value)

    def on_tone(self, name: str) -> None:
        """Choose the tone curve."""
        self.renderer.set_display(tone=name)

    def on_fov(self, value: float) -> None:
        """Choose the field of view."""
        if self.renderer.camera.has_window:
            raise InputError("this camera has a window, and no field of view")
        self.renderer.camera.set_camera_parameters(fov=value)

    def on_white(self, value: float) -> None:
        """Choose the distance that is white."""
        self.choices.set_white(value)

    def on_reset(self) -> None:
        """The camera of the beginning."""
        self.renderer.camera.set_camera_parameters(**self.first_camera)
        self.choices.set_white(self.choices.usual_white)

    def on_explain(self, column: int, row: int, sample: int) -> None:
        """Explain a pixel."""
        most = max(0, self.renderer.film.samples - 1)
        self.explanation = self.renderer.explain(column, row, min(sample, most))._repr_html_()

    def on_same(self) -> None:
        """Tell what makes this picture again."""
        command, lines = as_command(self.renderer, self.scene_options), as_python(self.renderer)
        self.explanation = f"<pre>{html.escape(command)}</pre><pre>{html.escape(lines)}</pre>"

    # ── frames ──

    def make_frame(self) -> None:
        """Make a frame if somebody waits for one and the picture, or what is said about it, is new."""
        now, samples = self.now(), self.renderer.film.samples
        if now - self._framed_at < FRAME_EVERY or not self.is_watched:
            return
        kind = "jpeg" if self.is_moving else "png"
        is_new = samples != self._framed_samples or kind != self._framed_kind
        is_due = self.is_moving or self._framed_kind != "png" or now - self._framed_at >= REST_EVERY or self.is_final
        self.look_at_error(now)
        settings = self.settings()
        if not (is_new and is_due) and settings == self._sent_settings:
            return
        state = self.state()
        image = self.renderer.image()
        display = self.renderer.display if self.renderer.srgb else Display()
        if kind == "jpeg":
            pixels = io.BytesIO()
            Image.fromarray(to_bytes(image, self.renderer.srgb, display)).save(pixels, "JPEG", quality=QUALITY)
            data = pixels.getvalue()
        else:
            pixels = io.BytesIO()
            shown = Image.fromarray(to_bytes(image, self.renderer.srgb, display))
            shown.save(pixels, "PNG", compress_level=1)
            data = pixels.getvalue()
        self._framed_at, self._framed_samples, self._framed_kind, self._sent_settings = now, samples, kind, settings
        self._has_moved = False
        with self._lock:
            self._frames += 1
            self._frame = Frame(self._frames, kind, data, state)
            self._lock.notify_all()

    def look_at_error(self, now: float) -> None:
        """Estimate the error from time to time, and go on with the curve of this estimator."""
        if not self.renderer.is_random or now - self._error_at < ERROR_EVERY or self.renderer.film.samples < 2:
            return
        self._error, self._error_at = self.renderer.error(), now
        curves = {
            name: [[round(p.seconds, 4), float(p.error)] for p in curve if np.isfinite(p.error)]
            for name, curve in self.renderer.error_curves.items()
        }
        self.curves = {name: curve[:: 1 + len(curve) // MOST_POINTS] for name, curve in curves.items()}

    def state(self) -> str:
        """What the page shows beside the picture, as JSON: the settings, and what changes with every sample."""
        r = self.renderer
        told = "" if self._error is None or not r.is_random else str(self._error)
        samples = r.samples if r.is_random else 1
        return json.dumps(self.settings() | {"samples": samples, "error": told, "curves": self.curves})

    def settings(self) -> dict[str, Any]:
        """What is shown and what can be chosen; a change of it is sent at once."""
        r, choices = self.renderer, self.choices
        camera = r.camera
        return {
            "width": r.width,
            "height": r.height,
            "what": r.what,
            "view": r.active.name,
            "offered": [
                {"what": cls.what, "names": [[one.name, one.label or one.name] for one in offers]}
                for cls, offers in choices.offered
            ],
            "environment": choices.environment,
            "environments": choices.environments,
            "triangle_test": choices.triangle_test,
            "triangle_tests": choices.triangle_tests,
            "lamp_choice": choices.lamp_choice,
            "lamp_choices": choices.lamp_choices,
            "controls": [described(control) for control in r.active.controls()],
            "exposure": r.display.exposure if r.srgb else None,
            "tone": str(getattr(r.display.tone, "name", r.display.tone)) if r.srgb else None,
            "tones": PARTS.names("tone curve"),
            "fov": None if camera.has_window else float(camera.fov),
            "white": choices.white if r.active.name == DISTANCE else None,
            "eye": [float(x) for x in camera.eye],
            "at": [float(x) for x in camera.at],
            "message": self.message,
            "explanation": self.explanation,
        }

    def file(self, kind: str) -> bytes:
        """The picture as a file: "png" or "exr"."""
        if kind == "png":
            r = self.renderer
            return encode_png(r.image(), r.srgb, r.display if r.srgb else Display())
        raise one_of("file", kind, ["png"])


def described(control: Any) -> dict[str, Any]:
    """A control as JSON."""
    if isinstance(control, BouncesControl):
        value = None if control.value is None else list(control.value)
        return {"kind": "bounces", "name": control.name, "value": value, "most": control.most}
    if isinstance(control, NameControl):
        return {
            "kind": "name",
            "name": control.name,
            "value": control.value,
            "names": list(control.names),
            "label": control.label,
        }
    is_whole = isinstance(control.low, int) and isinstance(control.high, int)
    return {
        "kind": "slider",
        "name": control.name,
        "value": control.value,
        "low": control.low,
        "high": control.high,
        "label": control.label,
        "step": 1 if is_whole else (control.high - control.low) / 200,
    }


def answer(function: Callable[[], Any], future: Future) -> None:
    """Call a function for another thread."""
    if not future.set_running_or_notify_cancel():
        return
    try:
        future.set_result(function())
    except Exception as error:
        future.set_exception(error)
