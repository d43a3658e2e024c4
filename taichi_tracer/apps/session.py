"""A picture that is watched from a browser or a notebook: it takes events, renders, and makes frames.

The session belongs to one thread, which calls ``step`` again and again: Taichi's kernels must not be launched from
several threads. Other threads ``post`` events and wait for frames. A frame is made only if somebody waits for one, so
that a slow connection gets fewer frames instead of a queue of old ones.
"""

import html
import json
import shlex
import time
import traceback
from collections.abc import Callable, Sequence
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np

from taichi_tracer import camera_controller
from taichi_tracer.apps import pace
from taichi_tracer.apps.cancelling import Cancelled, Cancelling, former
from taichi_tracer.apps.choices import Choices
from taichi_tracer.apps.events import OF_HOSTS
from taichi_tracer.apps.frames import Frame, encoded, exact_pixels, quick_pixels
from taichi_tracer.apps.mailbox import Mailbox
from taichi_tracer.apps.pointed import Pointed
from taichi_tracer.apps.preview import Preview, current
from taichi_tracer.apps.reproduce import as_command, as_python, camera_words, position_of
from taichi_tracer.apps.split import Split, Told, details_of, state_of
from taichi_tracer.camera_controller import Pose
from taichi_tracer.integrators.controls import BouncesControl, NameControl
from taichi_tracer.progressive import ProgressiveRenderer
from taichi_tracer.settings import RenderSettings
from taichi_tracer.system.errors import InputError, one_of

MOVING = 0.1  # seconds after the last movement: until then the picture is sent as JPEG
# Seconds between two lossless pictures at least, their share of the time, and seconds between them at most.
REST_EVERY, REST_SHARE, REST_MOST = 0.3, 0.025, 0.45
ERROR_SHARE = 0.025  # of the time that looks at the error take
FRAME_EVERY = 1 / 60  # seconds between two frames at least
WORK = 0.02  # seconds of rendering between two looks at the events
LONGEST_STEP = 0.25  # seconds: a held key moves the camera no farther at once
SIDES = ("left", "right")  # of two pictures
POINTING = ("point", "leave")  # events that change nothing of the picture, or of what is told of it
FILES = {"png": "image/png", "exr": "image/x-exr"}  # kinds of files that can be saved


class Session(Mailbox):
    """One live picture: what is shown, what was chosen, and the newest frame; ``Mailbox`` has what other threads call.

    Args:
        renderer: what is shown first.
        settings: what the program was started with, for the command that makes the picture again.
        now: the clock, in seconds.
    """

    def __init__(
        self,
        renderer: ProgressiveRenderer,
        settings: RenderSettings | None = None,
        now: Callable[[], float] = time.monotonic,
    ) -> None:
        super().__init__(now)
        self.choices, self.settings = Choices(renderer), settings
        self.split: Split | None = None
        geometry = renderer.scene_data.geometry
        self.speed = camera_controller.speed_for(geometry.low, geometry.high)
        self.first_camera = position_of(renderer.camera)
        self.keys: set[str] = set()
        self.message, self.explanation = "", ""  # the second one as HTML
        self.pointed: Pointed | None = None
        self._answers = 0  # counts the choices, so that a page hears of each
        self._before: tuple[str, dict[str, Any]] | None = None  # the event that takes the last choice back
        self.errors: dict[int, Told] = {}
        self.curves: dict[str, list[list[float]]] = {}
        self._last_step = self._moved_at = self.now()
        self._has_moved = False  # since the last frame
        self.preview = Preview()
        self._began = self._moved_at  # when the last work on a frame began
        self._shown: ProgressiveRenderer | None = None  # a coarse picture that stands for that of the renderer
        self._pictures = 0  # counts the changes of what is rendered
        self._framed: tuple = ()  # the picture, the kind and the settings of the last frame
        self._file_of: tuple = ()  # what the bytes of its file depend on
        self._framed_at, self._rest = -1e9, pace.Rarely(REST_EVERY, REST_SHARE, REST_MOST)
        self._look = pace.Rarely(pace.ERROR_EVERY, ERROR_SHARE)
        self._details, self._details_of, self._details_number = "{}", (), 0

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
        begin = self.now()
        quick_pixels(self.renderer.render())
        self.preview.took(self.renderer, self.now() - begin)
        quick_pixels(self.preview.of(self.renderer).render())

    def send_again(self) -> None:
        """Make a frame for somebody who has none yet."""
        self._framed, self._details_of, self._file_of = (), (), ()

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
        events, answered = self.take_post()
        is_busy = True
        try:
            with Cancelling(self).while_compiling():
                moved = self.take(events)
                now = self.now()
                self.move(min(now - self._last_step, LONGEST_STEP), *moved)
                self._last_step = now
                is_busy = self.seconds_of_rest() == 0
                if is_busy:
                    self.render()
                    self.make_frame()
        except Cancelled:
            self.take_back()
        return bool(events or answered or is_busy)

    def take_back(self) -> None:
        """Show again what was shown before the last choice."""
        if self._before is not None:
            kind, members = self._before
            getattr(self, f"on_{kind}")(**members)
        self._before, self.message = None, "Cancelled."

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
        """Add samples for a moment; while the camera moves, of a coarse picture if the whole one is too slow."""
        self._began = begin = self.now()
        self._shown = self.preview.of(self.renderer) if self.is_moving and self.split is None else None
        if self._shown not in (None, self.renderer):
            self._shown.render()
            self._pictures += 1
            return
        end = begin + WORK
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
            elif kind in POINTING:
                self.pointed = Pointed(**members, renderer=self.renderer) if members else None
            elif kind not in OF_HOSTS:
                self.message, self.explanation = "", ""  # both were about what was shown before
                self._answers += 1
                self._before = former(self, kind, members)
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
        self._moved_at, self._has_moved, self.explanation = self.now(), True, ""

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

    def on_ground(self, name: str) -> None:
        """Choose what lies under everything."""
        self._step_to("ground", name)

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

    def on_expose(self) -> None:
        """Choose the exposure that shows the picture well."""
        self.renderer.expose()

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
        """Bring the camera, and the distance that is white, back to where they were at first."""
        self.renderer.camera.set_camera_parameters(**self.first_camera)
        self.choices.set_white(self.choices.usual_white)

    def on_explain(self, column: int, row: int, sample: int) -> None:
        """Explain a pixel."""
        most = max(0, self.renderer.film.samples - 1)
        self.explanation = self.renderer.explain(column, row, min(sample, most))._repr_html_()

    def on_same(self) -> None:
        """Tell what makes this picture again."""
        command, lines = as_command(self.renderer, self.settings), as_python(self.renderer)
        self.explanation = f"<pre>{html.escape(command)}</pre><pre>{html.escape(lines)}</pre>"

    def on_camera(self) -> None:
        """Tell the camera as options of the command line."""
        self.explanation = f"<pre>{html.escape(shlex.join(camera_words(self.renderer.camera)))}</pre>"

    def on_close(self) -> None:
        """Tell nothing any more: what was told is gone already."""

    def on_split(self, mode: str) -> None:
        """Show two choices on one camera, or their difference, or one again."""
        self.split = Split.begun(self.split, self.choices, mode)
        if self.split is None:
            return
        self.choices = self.split.choices

    def on_side(self, number: int) -> None:
        """Choose which of the two pictures the controls change."""
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
        shown = self.renderers if self._shown is None else [self._shown]
        number = 1 if self._frame is None else self._frame.number + 1
        file_of = self._pictures, kind, self.settings_key()[: -len(self.told)]
        if self._frame is not None and file_of == self._file_of:
            data, data_number = self._frame.data, self._frame.data_number
        else:
            pixels = make(shown[0]) if self.split is None else self.split.pixels(make)
            data, data_number = encoded(pixels, kind), number
        self._file_of = file_of
        pointed = None if self.pointed is None or self.is_moving else self.pointed.told(self.renderers)
        state = state_of(shown, self.split, self.errors, pointed)
        if kind == "jpeg" and self.split is None:
            self.preview.took(self.renderer, self.now() - self._began)
        self._framed = self._pictures, kind, self.settings_key()
        self._framed_at, self._has_moved = self.now(), False
        if kind == "png":
            self._rest.done(begin, self._framed_at)
        self.show(Frame(number, kind, data, state, self._details, self._details_number, data_number))

    def look_at_error(self) -> None:
        """Estimate the error from time to time, and go on with the curve of this estimator."""
        begin = self.now()
        random = [one for one in self.renderers if one.is_random and one.film.samples > 1]
        if not random or self.is_moving or begin < self._look.next:
            return
        self.errors = {id(one): Told(str(one.error()), one.samples) for one in random}
        self.curves = {}
        for side, renderer in zip(SIDES, self.renderers, strict=False):
            for name, curve in renderer.error_curves.items():
                points = [[round(p.seconds, 4), float(p.error)] for p in curve if np.isfinite(p.error)]
                self.curves[name if self.split is None else f"{side}: {name}"] = pace.thinned(points)
        self._look.done(begin, self.now())

    def settings_key(self) -> tuple:
        """What is compared to find out whether something else was chosen or told: without the camera's place."""
        choices = self.choices
        of = [
            (one.active, one.scene_data, one.scene_data.environment, one.display, *one.controls())
            for one in self.renderers
        ]
        split = None if self.split is None else (self.split.mode, self.split.number)
        fov = None if self.renderer.camera.has_window else float(self.renderer.camera.fov)
        return (*of, split, fov, choices.white, *self.told)

    @property
    def told(self) -> tuple:
        """What is told beside the picture, and changes nothing of it."""
        return self.message, self.explanation, self._answers, self.pointed

    def bring_details_up_to_date(self) -> None:
        """Make the details again if something of them has changed."""
        of = self.settings_key(), {name: len(curve) for name, curve in self.curves.items()}, self._look.next
        if of != self._details_of:
            self._details_of, self._details_number = of, self._details_number + 1
            told = {"curves": self.curves, "message": self.message, "explanation": self.explanation}
            self._details = json.dumps(details_of(self.choices, self.split) | told)

    def file(self, kind: str) -> bytes:
        """The picture as a file, as ``renderer.save`` writes it: "png" or "exr".

        Raises:
            InputError: a file of another kind is asked for, or its library is not installed.
        """
        if kind not in FILES:
            raise one_of("file", kind, FILES)
        with TemporaryDirectory() as folder:
            path = Path(folder) / f"{self.renderer.active.name}.{kind}"
            current(self.renderer)
            try:
                self.renderer.save(path)
            except InputError as error:
                raise InputError(str(error).removeprefix(f"{path}: ")) from None
            return path.read_bytes()


def is_final(renderer: ProgressiveRenderer) -> bool:
    """Whether a picture is complete: a view without random samples."""
    return not renderer.is_random and renderer.film.samples > 0 and renderer.is_current()
