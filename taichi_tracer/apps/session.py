"""A picture that is watched from a browser or a notebook: it takes events, renders, and makes frames.

The session belongs to one thread, which calls ``step`` again and again: Taichi's kernels must not be launched from
several threads. Other threads ``post`` events and wait for frames. A frame is made only if somebody waits for one, so
that a slow connection gets fewer frames instead of a queue of old ones.
"""

import html
import json
import threading
import time
import traceback
from collections import deque
from collections.abc import Callable, Sequence
from concurrent.futures import Future
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np

from taichi_tracer.apps import camera_controller, pace
from taichi_tracer.apps.camera_controller import Pose
from taichi_tracer.apps.choices import Choices
from taichi_tracer.apps.events import OF_HOSTS, checked
from taichi_tracer.apps.frames import Frame, encoded, exact_pixels, quick_pixels
from taichi_tracer.apps.in_python import as_python
from taichi_tracer.apps.same_again import DISTANCE, as_command, position_of
from taichi_tracer.apps.split import DIFFERENCE, Split
from taichi_tracer.integrators.controls import BouncesControl, Control, NameControl
from taichi_tracer.renderer import ProgressiveRenderer
from taichi_tracer.system.errors import InputError, one_of
from taichi_tracer.system.registry import PARTS

MOST_EVENTS = 2000  # that wait; when there are more, the oldest drags are dropped
MOVING = 0.15  # seconds after the last movement: until then the picture is sent as JPEG
REST_EVERY, REST_SHARE = 0.3, 0.025  # seconds between two lossless pictures at least, and their share of the time
ERROR_SHARE = 0.025  # of the time that looks at the error take
FRAME_EVERY = 1 / 60  # seconds between two frames at least
WORK = 0.02  # seconds of rendering between two looks at the events
FORGOTTEN = 10.0  # seconds without anybody who waits for a frame: then nothing is rendered
LONGEST_STEP = 0.25  # seconds: a held key moves the camera no farther at once
FILES = {"png": "image/png", "exr": "image/x-exr"}  # kinds of files that can be saved


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
        self.split: Split | None = None
        geometry = renderer.scene_data.geometry
        self.speed = camera_controller.speed_for(geometry.low, geometry.high)
        self.first_camera = position_of(renderer.camera)
        self.keys: set[str] = set()
        self.message, self.explanation = "", ""
        self.errors: dict[int, str] = {}
        self.curves: dict[str, list[list[float]]] = {}
        self._events: deque[tuple[str, dict[str, Any]]] = deque()
        self._tasks: deque[tuple[Callable[[], Any], Future]] = deque()
        self._lock = threading.Condition()
        self._frame: Frame | None = None
        self._waiting, self._polls = 0, False
        self._last_wait = self._last_step = self._moved_at = self.now()
        self._has_moved = False  # since the last frame
        self._pictures = 0  # counts the changes of what is rendered
        self._framed: tuple = ()  # the picture, the kind and the settings of the last frame
        self._framed_at, self._rest = -1e9, pace.Rarely(REST_EVERY, REST_SHARE)
        self._look = pace.Rarely(pace.ERROR_EVERY, ERROR_SHARE)
        self._details, self._details_of, self._details_number = "{}", (), 0
        self.is_over = False

    @property
    def renderer(self) -> ProgressiveRenderer:
        """The renderer that the controls change."""
        return self.choices.renderer

    @property
    def renderers(self) -> list[ProgressiveRenderer]:
        """All renderers that are shown: one, or those of both halves."""
        return [self.renderer] if self.split is None else [one.renderer for one in self.split.sides]

    def warm_up(self, tell: Callable[[str], None] = print) -> None:
        """Compile what a moving camera needs, before anybody waits for it."""
        pace.warm_up(self.renderer, lambda: quick_pixels(self.renderer.render()), tell)

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
                while not self.is_over:
                    self._last_wait = self.now()
                    if (found := self.newest(since)) is not None:
                        return found
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

    def ask(self) -> None:
        """Note that the next frame will be taken, without a thread that waits for it."""
        self._polls = True

    def send_again(self) -> None:
        """Make a frame for somebody who has none yet."""
        self._framed, self._details_of = (), ()

    def close(self) -> None:
        """Let every thread that waits go on."""
        with self._lock:
            self.is_over = True
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
            if not (self._events or self._tasks):
                wait = self.seconds_of_rest()
                if wait > 0:
                    self._lock.wait(min(wait, patience))
            events, tasks = list(self._events), list(self._tasks)
            self._events.clear()
            self._tasks.clear()
        for function, future in tasks:
            answer(function, future)
        orbit, zoom, pan, tapped = self.take(events)
        now = self.now()
        self.move(min(now - self._last_step, LONGEST_STEP), orbit, zoom, pan, tapped)
        self._last_step = now
        is_busy = self.seconds_of_rest() == 0
        if is_busy:
            self.render()
            self.make_frame()
        return bool(events or tasks or is_busy)

    @property
    def is_watched(self) -> bool:
        """Whether anybody has waited for a frame lately."""
        return self._waiting > 0 or self.now() - self._last_wait < FORGOTTEN

    @property
    def is_asked(self) -> bool:
        """Whether somebody takes a frame at once: otherwise none is made, so that no queue of old ones can arise."""
        return self._waiting > 0 or self._polls

    @property
    def is_moving(self) -> bool:
        """Whether something was moved or chosen since the last frame, or a moment ago."""
        return bool(self.keys) or self._has_moved or self.now() - self._moved_at < MOVING

    def seconds_of_rest(self) -> float:
        """Seconds until a sample or a frame is due; 0 if one is due, and infinite if nothing is missing."""
        if not self.is_watched:
            return np.inf
        is_growing = any(one.is_random for one in self.renderers) and not self.is_moving
        if not self.is_asked and not is_growing:
            return np.inf  # what nobody takes need not be rendered
        if self.keys or not all(is_final(one) for one in self.renderers):
            return 0.0
        return self.seconds_to_frame()

    def seconds_to_frame(self) -> float:
        """Seconds until a frame is to be made: 0 if it is due, and infinite if nobody asks or nothing is new."""
        if not self.is_asked:
            return np.inf
        now = self.now()
        picture, kind, settings = self._framed or (None, "", ())
        if picture == self._pictures and settings == self.settings_key():
            if kind == "png":
                return np.inf
            return max(0.0, self._moved_at + MOVING - now)  # then the lossless picture follows
        due = self._framed_at + FRAME_EVERY
        is_rest = kind == "png" and not self.is_moving and settings == self.settings_key()
        if is_rest and not all(is_final(one) for one in self.renderers):
            due = max(due, self._rest.next)
        return max(0.0, due - now)

    def render(self) -> None:
        """Add samples for a moment."""
        end = self.now() + WORK
        while True:
            for renderer in self.renderers:
                if is_final(renderer):
                    continue
                if not renderer.is_current():
                    self.errors.clear()
                    self._look.next = self._rest.next = 0.0
                renderer.render()
                self._pictures += 1
            if self.now() >= end or self.is_moving or all(is_final(one) for one in self.renderers):
                break

    def take(
        self, events: Sequence[tuple[str, dict[str, Any]]]
    ) -> tuple[tuple[float, float], float, tuple[float, float], set[str]]:
        """Do what events ask for. Returns how far the camera is turned, brought nearer and shifted; and pressed keys.

        A key that is pressed and released at once is pressed, too.
        """
        orbit, zoom, pan, tapped = [0.0, 0.0], 0.0, [0.0, 0.0], set()
        for kind, members in events:
            if kind == "drag":
                orbit = [orbit[0] + members["dx"], orbit[1] + members["dy"]]
            elif kind == "zoom":
                zoom += members["by"]
            elif kind == "pan":
                pan = [pan[0] + members["dx"], pan[1] + members["dy"]]
            elif kind == "key":
                (self.keys.add if members["down"] else self.keys.discard)(members["key"])
                tapped |= {members["key"]} if members["down"] else set()
            elif kind == "blur":
                self.keys.clear()
            elif kind not in OF_HOSTS:
                self.message = ""
                try:
                    getattr(self, f"on_{kind}")(**members)
                except Exception as error:  # nothing that a page asks for ends the picture
                    self.message = " ".join(str(error).split())
                    if not isinstance(error, InputError):
                        traceback.print_exc()
        return (orbit[0], orbit[1]), zoom, (pan[0], pan[1]), tapped

    def move(
        self,
        seconds: float,
        orbit: tuple[float, float],
        zoom: float,
        pan: tuple[float, float],
        tapped: set[str] = frozenset(),  # type: ignore[assignment]
    ) -> None:
        """Move the camera as keys, wheel and pointer say."""
        keys = self.keys | tapped
        if not (keys or zoom or any(orbit) or any(pan)):
            return
        camera = self.renderer.camera
        pose = camera_controller.step(
            Pose.of(camera), keys, seconds, orbit, zoom, self.speed, self.choices.scene.up_axis
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
        control = next((c for c in self.renderer.controls() if c.name == name), None)
        if control is None:
            raise InputError(f"{self.renderer.active.name} has no {name} that can be changed")
        if isinstance(control, BouncesControl):
            value = None if value is None else tuple(None if one is None else int(one) for one in value)
        elif not isinstance(control, NameControl) and isinstance(control.low, int) and isinstance(control.high, int):
            value = int(value)
        self.renderer.change(name, value)

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

    def on_split(self, mode: str) -> None:
        """Show two choices on one camera, or their difference, or one again."""
        self.split = Split.begun(self.split, self.choices, mode)
        if self.split is None:
            return
        self.choices = self.split.choices

    def on_side(self, number: int) -> None:
        """Choose which of the two the controls change."""
        if self.split is None:
            raise InputError("side: one picture is shown: choose to compare first")
        self.split.number = number
        self.choices = self.split.choices

    # ── frames ──

    def make_frame(self) -> None:
        """Make a frame if somebody takes it and the picture, or what is said about it, is new."""
        self.look_at_error()
        if self.seconds_to_frame() > 0:
            return
        begin = self.now()
        kind = "jpeg" if self.is_moving else "png"
        make = quick_pixels if kind == "jpeg" else exact_pixels
        self.bring_details_up_to_date()
        pixels = make(self.renderer) if self.split is None else self.split.pixels(make)
        state = self.state()
        data = encoded(pixels, kind)
        self._framed = self._pictures, kind, self.settings_key()
        self._framed_at, self._has_moved = self.now(), False
        if kind == "png":
            self._rest.done(begin, self._framed_at)
        number = 1 if self._frame is None else self._frame.number + 1
        with self._lock:
            self._frame = Frame(number, kind, data, state, self._details, self._details_number)
            self._polls = False
            self._lock.notify_all()

    def look_at_error(self) -> None:
        """Estimate the error from time to time, and go on with the curve of this estimator."""
        begin = self.now()
        random = [one for one in self.renderers if one.is_random and one.film.samples > 1]
        if not random or self.is_moving or begin < self._look.next:
            return
        self.errors = {id(one): str(one.error()) for one in random}
        self.curves = {}
        for renderer in random:
            for name, curve in renderer.error_curves.items():
                points = [[round(p.seconds, 4), float(p.error)] for p in curve if np.isfinite(p.error)]
                self.curves[name] = pace.thinned(points)
        self._look.done(begin, self.now())

    def state(self) -> str:
        """What changes with every picture, as JSON."""
        sides = [
            {"view": r.active.name, "samples": r.samples if r.is_random else 1, "error": self.errors.get(id(r), "")}
            for r in self.renderers
        ]
        state = sides[self.split.number if self.split is not None else 0] | {"sides": sides}
        scale = self.renderer.scale
        if self.split is not None and self.split.mode == DIFFERENCE:
            scale = self.split.scale
        told = None if scale is None else {"low": "0", "high": f"{scale.high:.3g}", "text": scale.text}
        return json.dumps(state | {"scale": told})

    def settings_key(self) -> tuple:
        """What is compared to find out whether something else was chosen or told: without the camera's place."""
        choices = self.choices
        of = [
            (one.active, one.scene_data, one.scene_data.environment, one.display, *one.controls())
            for one in self.renderers
        ]
        split = None if self.split is None else (self.split.mode, self.split.number)
        fov = None if self.renderer.camera.has_window else float(self.renderer.camera.fov)
        return (*of, split, fov, choices.white, self.message, self.explanation)

    def bring_details_up_to_date(self) -> None:
        """Make the details again if something of them has changed."""
        of = self.settings_key(), {name: len(curve) for name, curve in self.curves.items()}, self._look.next
        if of != self._details_of:
            self._details_of, self._details_number = of, self._details_number + 1
            self._details = json.dumps(self.details())

    def details(self) -> dict[str, Any]:
        """What can be chosen, what is chosen, and what is told; a change of it is sent at once."""
        r, choices, split = self.renderer, self.choices, self.split
        return {
            "width": r.width,
            "height": r.height,
            "what": r.what,
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
            "controls": [described(control) for control in r.controls()],
            "exposure": r.display.exposure if r.srgb and not r.has_own_display else None,
            "tone": r.display.part.name if r.srgb else None,
            "tones": PARTS.names("tone curve"),
            "fov": None if r.camera.has_window else float(r.camera.fov),
            "white": choices.white if r.active.name == DISTANCE else None,
            "split": None if split is None else {"mode": split.mode, "side": split.number},
            "curves": self.curves,
            "message": self.message,
            "explanation": self.explanation,
        }

    def file(self, kind: str) -> bytes:
        """The picture as a file, as ``renderer.save`` writes it: "png" or "exr".

        Raises:
            InputError: a file of another kind is asked for, or its library is not installed.
        """
        if kind not in FILES:
            raise one_of("file", kind, FILES)
        with TemporaryDirectory() as folder:
            path = Path(folder) / f"{self.renderer.active.name}.{kind}"
            try:
                self.renderer.save(path)
            except InputError as error:
                raise InputError(str(error).removeprefix(f"{path}: ")) from None
            return path.read_bytes()


def is_final(renderer: ProgressiveRenderer) -> bool:
    """Whether a picture is complete: a view without random samples."""
    return not renderer.is_random and renderer.film.samples > 0 and renderer.is_current()


def described(control: Control) -> dict[str, Any]:
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
