"""A picture that is watched from a browser or a notebook: it takes events, renders, and makes frames.

The session belongs to one thread, which calls ``step`` again and again: Taichi's kernels must not be launched from
several threads. Other threads ``add`` events. A frame is made only if a page is ready for one, so that a slow
connection gets fewer frames instead of a queue of old ones.

While Taichi translates a kernel, nothing else of a process runs. Of what is chosen, another process therefore renders a
small picture first, while the old picture still moves; Taichi keeps its kernels in the cache of the user, from which
this process then reads them.
"""

import contextlib
import html
import shlex
import subprocess
import sys
import threading
import time
import traceback
from collections import deque
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np

from taichi_tracer import camera_controller
from taichi_tracer.apps.page.channel import (
    DIFFERENCE,
    EVENTS,
    NO_FRAME,
    OFF,
    SIDES,
    Frame,
    Watcher,
    encoded,
    exact_pixels,
    quick_pixels,
)
from taichi_tracer.apps.page.renderer_state import (
    OF_SCENE,
    Preview,
    RendererState,
    current,
    difference_of,
    linear_values,
    look_at,
    read,
)
from taichi_tracer.apps.pictures import as_command, as_python, camera_settings, first_renderer
from taichi_tracer.camera_controller import Pose
from taichi_tracer.picture.metrics import typical_error
from taichi_tracer.progressive import ProgressiveRenderer
from taichi_tracer.scene_data_loader import name_of, scene_names
from taichi_tracer.settings import NO_NAME, RenderSettings
from taichi_tracer.system.errors import InputError, one_of

MOVING = 0.1  # seconds after the last movement: until then the picture is sent as JPEG
REST_EVERY, ERROR_EVERY = 0.4, 0.4  # seconds between two lossless pictures, and between two estimates of the error
ERROR_REST = 3.0  # times as long as the last estimate took before the next one: pictures need the time more
ERROR_SHARE = 0.02  # more of the rendered seconds before the next estimate: the chart of an hour has 300 points
FRAME_EVERY = 1 / 60  # seconds between two frames at least
WORK = 0.02  # seconds of rendering between two looks at the events
TRIES = 5  # moving pictures that are tried, until their size is as coarse as they must be
LONGEST_STEP = 0.25  # seconds: a held key moves the camera no farther at once
MOST_PIXELS = 1920 * 1200  # of a picture that follows the size of the page
MOVING_BY = ("move", "key", "blur")
MOST_EVENTS = 2000  # that wait; when there are more, the oldest ones are dropped
FORGOTTEN = 10.0  # seconds without a page that is ready for a frame: then nothing is rendered
POINTING = ("point", "look")  # events that change nothing of the picture
COMPILES = ("view", "environment", *OF_SCENE)  # settings of which another value may compile kernels


# ── what takes time ──


SIDE, SPP = 64, 2  # of the picture of the other process: two samples have an error, too
START = 1.0  # seconds that the other process takes to start
NOTICE = 0.15  # seconds in which a page can show that something will take time, before nothing runs
# How long the first picture takes to compile, as a multiple of that of a view.
COSTS = {"view": 1.0, "map": 2.0, "estimator": 3.0, "path": 4.0}


@dataclass
class Choice:
    """Something that was chosen, and that takes time.

    Attributes:
        text: what happens, in words. about: seconds that it may take. take: shows what was chosen.
        began: when it was chosen, on the clock of ``time.monotonic``.
        process: the one that compiles; None if this one must.
    """

    text: str
    about: float
    take: Callable[[], None]
    process: "subprocess.Popen | None" = None
    began: float = field(default_factory=time.monotonic)

    @property
    def is_due(self) -> bool:
        """Whether it can be shown now."""
        if self.process is not None:
            return self.process.poll() is not None
        return time.monotonic() - self.began > NOTICE

    def cancel(self) -> None:
        """Give it up."""
        if self.process is not None:
            self.process.kill()
            self.process.wait()


def compiling_process(settings: RenderSettings, folder: str) -> subprocess.Popen:
    """A process that compiles what a picture with these settings needs; its picture is written into a folder."""
    small = replace(settings, size=(SIDE, SIDE), crop=None, bounces=(), spp=SPP, time=None, error=None, adaptive=None)
    place = str(Path(folder) / "compiled.png")
    words = [sys.executable, "-m", "taichi_tracer", "render", small.scene, *small.words(), "-o", place]
    return subprocess.Popen(words, stdin=subprocess.DEVNULL, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)


# ── the picture ──


class Session:
    """One live picture: what is shown, what was chosen, and the newest frame.

    Args:
        renderer: what is shown first.
        settings: what the program was started with; None in a notebook. With them, kernels are compiled ahead by
            another process, and the picture gets the size of the page, unless they have a size.
        now: the clock, in seconds.

    Attributes:
        watchers: the pages that get frames.
    """

    def __init__(
        self,
        renderer: ProgressiveRenderer,
        settings: RenderSettings | None = None,
        now: Callable[[], float] = time.monotonic,
    ) -> None:
        self.now, self.settings = now, settings
        self._events: deque[tuple[str, dict[str, Any]]] = deque(maxlen=MOST_EVENTS)
        self._lock = threading.Condition()
        self.frame, self.watchers = NO_FRAME, list[Watcher]()
        self._last_asked = self.now()
        self.follows_size = settings is not None and settings.size is None and settings.crop is None
        self.keys: set[str] = set()
        self.stay()
        self.message = ""
        self.choice: Choice | None = None  # what was chosen, and is not shown yet
        self._compiled: set[tuple] = set()  # what needs no compiling any more
        self._folder = TemporaryDirectory()  # for pictures of processes that compile
        self._unit = START  # seconds that a view takes to compile
        self._last_step = self.now()
        self.region: tuple[int, ...] | None = None  # column, row, columns and rows whose numbers a page shows
        self.coarse: ProgressiveRenderer | None = None  # a coarse picture in place of that of the renderer
        self.framed_at = self._moved_at = -1e9
        self._next_error = 0.0
        self._begin_with(renderer)

    def _begin_with(self, renderer: ProgressiveRenderer) -> None:
        """Show a renderer, of another scene than the one before."""
        self.sides = [RendererState(renderer, self.settings)]  # of one picture, or of the left and the right one
        self.number = 0  # which of them the controls change
        self.mode, self.equal = OFF, "samples"  # how two are shown, and what both have the same number of
        geometry = renderer.scene_data.geometry
        self.speed = camera_controller.speed_for(geometry.low, geometry.high)
        self.first_camera = {name: v for name, v in renderer.camera.parameters().items() if name != "projection"}
        self.explanation = ""  # as HTML
        self.explained: tuple[int, int] | None = None  # the pixel
        self.pointed: tuple[int, int] | None = None  # the pixel under the pointer
        self.errors: dict[int, dict[str, Any]] = {}  # id of a renderer → what is known of its error
        self.curves: dict[str, list[list[float]]] = {}
        self.preview = Preview()
        self._is_cold = True  # whether the picture of a moving camera is still to be compiled
        self._note_change()

    @property
    def state(self) -> RendererState:
        """What the controls change."""
        return self.sides[self.number]

    @property
    def renderer(self) -> ProgressiveRenderer:
        """The renderer that the controls change."""
        return self.state.renderer

    @property
    def renderers(self) -> list[ProgressiveRenderer]:
        """All renderers that are shown: one, or those of both halves."""
        return [one.renderer for one in self.sides]

    def warm_up(self) -> None:
        """Compile the first picture, before anybody waits for it."""
        start = time.monotonic()
        quick_pixels(self.renderer.render())
        self._compiled.add(self._kernels_of(self.state.settings))
        self._expose_at_first()
        self._unit = (time.monotonic() - start) / COSTS.get(self.renderer.what, 1.0)

    def _expose_at_first(self) -> None:
        """Expose the first picture of light to fit, where nobody says how."""
        nobody_says = self.settings is not None and self.settings.view is None and self.settings.exposure == 0
        if nobody_says and self.renderer.needs_light:
            self.renderer.expose()

    def _warm_moving(self) -> None:
        """Compile the picture that a moving camera shows, so that the first drag does not wait."""
        for _ in range(TRIES):
            begin = self.now()
            quick_pixels(self.preview.of(self.renderer).render())
            self.preview.took(self.renderer, self.now() - begin)
        look_at(0, 0, self.renderers)
        self._compiled.add(self._kernels_of(self.state.settings))

    @staticmethod
    def _kernels_of(settings: RenderSettings) -> tuple:
        """What the kernels of a picture depend on, of what can be chosen."""
        return (*(getattr(settings, name) for name in ("view", *OF_SCENE)), settings.environment == NO_NAME)

    def add(self, kind: str, members: dict[str, Any]) -> None:
        """Let an event wait, see ``channel.checked``."""
        with self._lock:
            self._events.append((kind, members))
            self._lock.notify_all()

    def take_events(self, patience: float) -> list[tuple[str, dict[str, Any]]]:
        """The events that have come since the last time; it waits for the first one."""
        with self._lock:
            self._lock.wait_for(lambda: self._events, patience)
            events = list(self._events)
            self._events.clear()
        return events

    def step(self, patience: float = 0.05) -> bool:
        """Take the events, move the camera, render for a moment and make a frame if one is wanted.

        Args:
            patience: seconds to wait if there is nothing to do.

        Returns:
            Whether anything was done.
        """
        events = self.take_events(min(self.seconds_of_rest(), patience))
        self.take(events)
        if any(kind in POINTING for kind, _ in events):
            self.make_frame()  # at once: the next sample may take long
        self.send_frame()
        self.take_choice()
        is_busy = self.seconds_of_rest() == 0
        if is_busy:
            begin = self.now()
            self.render()
            if self.make_frame():
                self.took(self.now() - begin)
                if self._is_cold and self.choice is None and self.mode == OFF:
                    self._is_cold = False
                    about = COSTS.get(self.renderer.what, 1.0) * self._unit
                    self.choose("preparing the moving picture", about, self._warm_moving)
        return bool(events or is_busy)

    def take_choice(self) -> None:
        """Show what was chosen if it is due, and move the camera."""
        if self.choice is not None and self.choice.is_due:
            choice, self.choice = self.choice, None
            self._note_change()
            with self.errors_as_message():
                choice.take()
        now = self.now()
        self.move(min(now - self._last_step, LONGEST_STEP))
        self._last_step = now

    def took(self, seconds: float) -> None:
        """Note how long the frame took that was just shown: one of a moving camera may become coarser, or finer."""
        self.framed_at = self.now()
        if self.coarse is not None:
            self.preview.took(self.renderer, seconds)

    @property
    def is_moving(self) -> bool:
        """Whether something was moved or chosen since the last frame, or a moment ago."""
        return bool(self.keys) or self._moved_at > self.framed_at or self.now() - self._moved_at < MOVING

    @property
    def is_asked(self) -> bool:
        """Whether a page can take a frame."""
        return any(one.is_ready for one in self.watchers)

    def seconds_of_rest(self) -> float:
        """Seconds until a sample or a frame is due; 0 if one is due, and infinite if nothing is missing."""
        if self.is_asked:
            self._last_asked = self.now()
        if self.now() - self._last_asked > FORGOTTEN:
            return np.inf
        is_growing = any(one.is_random for one in self.renderers) and not self.is_moving
        if not self.is_asked and not is_growing:
            return np.inf  # what nobody takes need not be rendered
        is_compiling = self.choice is not None and not self.is_moving  # which takes half as long if it is left alone
        if self.keys or not all(is_final(one, is_compiling) for one in self.renderers):
            return 0.0
        return self.seconds_to_frame()

    def seconds_to_frame(self) -> float:
        """Seconds until a frame is to be made: 0 if it is due, and infinite if nobody asks or nothing is new."""
        if not self.is_asked:
            return np.inf
        return max(0.0, self._due - self.now(), self.framed_at + FRAME_EVERY - self.now())

    def _note_change(self, about_picture: bool = True) -> None:
        """Let a frame be made soon, because something was chosen; if only beside the picture, with the same file."""
        self._due = 0.0
        self._has_new_picture = about_picture or self._has_new_picture

    def render(self) -> None:
        """Add samples for a moment; while the camera moves, of a coarse picture if the whole one is too slow."""
        self.coarse = self.preview.of(self.renderer) if self.is_moving and self.mode == OFF else None
        if self.coarse not in (None, self.renderer):
            self.coarse.render()
            self._note_change()
            return
        end = self.now() + WORK
        while unfinished := [one for one in self.renderers if not is_final(one)]:
            renderer = min(unfinished, key=self.progress_of)
            if not renderer.is_current():
                self.errors.clear()
                self._note_change()
            renderer.render()
            self._has_new_picture, self._due = True, min(self._due, self.framed_at + REST_EVERY)
            has_all = all(one.is_current() and one.film.samples > 0 for one in self.renderers)
            if has_all and (self.now() >= end or self.is_moving):
                break

    def progress_of(self, renderer: ProgressiveRenderer) -> tuple[bool, float]:
        """How far a picture is; of two, the one that is behind takes the next sample."""
        return renderer.is_current(), renderer.samples if self.equal == "samples" else renderer.rendered_seconds

    def take(self, events: Sequence[tuple[str, dict[str, Any]]]) -> None:
        """Do what events ask for."""
        for kind, members in events:
            if kind not in (*MOVING_BY, *POINTING, "ack"):
                self.message = ""
            if kind != "ack":
                self._note_change(kind not in POINTING)
            with self.errors_as_message():
                getattr(self, f"on_{kind}")(**members)

    @contextlib.contextmanager
    def errors_as_message(self) -> Iterator[None]:
        """An error within becomes the message of the page: nothing that a page asks for ends the picture."""
        try:
            yield
        except Exception as error:
            self.message = " ".join(str(error).split())
            if not isinstance(error, InputError):
                traceback.print_exc()

    def move(self, seconds: float) -> None:
        """Move the camera as keys, wheel and pointer have said since the last time."""
        motion, keys = self.motion, self.keys | self.tapped
        self.stay()
        if not (keys or motion.any()):
            return
        orbit, pan, nearer = motion[:2], motion[2:4], motion[4]
        camera, up_axis = self.renderer.camera, self.state.scene.up_axis
        pose = camera_controller.step(Pose.of(camera), keys, seconds, tuple(orbit), nearer, self.speed, up_axis)
        if pan.any():
            pose = camera_controller.shift(pose, *pan, camera)
        camera.set_camera_parameters(**pose.parameters())
        self._moved_at = self.now()

    def stay(self) -> None:
        """Begin to count how far the pointer and the wheel move the camera, and which keys were pressed."""
        self.motion = np.zeros(5)  # orbit and pan, both to the right and upwards, and how much nearer
        self.tapped: set[str] = set()  # those that were pressed, and may be released again

    def on_move(self, **motion: float) -> None:
        """Move the camera, as ``EVENTS`` of a channel name it: turn it, shift it, or bring it nearer."""
        self.motion += [motion.get(name, 0.0) for name in EVENTS["move"]]

    def on_key(self, key: str, down: bool) -> None:
        """Note that a key is pressed or released."""
        (self.keys.add if down else self.keys.discard)(key)
        self.tapped |= {key} if down else set()

    def on_blur(self) -> None:
        """Note that no key is pressed any more."""
        self.keys.clear()

    # ── what takes time ──

    def choose(self, text: str, about: float, take: Callable[[], None], process: Any = None) -> None:
        """Do something soon, after the page has shown that it takes time; what was chosen before is given up."""
        if self.choice is not None:
            self.choice.cancel()
        self.choice = Choice(text, about, take, process)
        self._note_change(about_picture=False)

    # ── what can be chosen ──

    def on_set(self, name: str, value: Any) -> None:
        """Change a setting, or a value of the integrator."""
        state = self.state
        if name == "scene":
            self._choose_scene(str(value))
            return
        if name not in COMPILES:
            state.change(name, value)
            return
        wanted = replace(state.settings, **{name: read(name, value)})

        def take() -> None:
            """Show it, and compile what is still missing."""
            state.show(wanted)
            quick_pixels(self.renderer.render())
            self._warm_moving()

        wanted = state.checked(wanted)
        what, _ = state.find(wanted.view)
        if self._kernels_of(wanted) in self._compiled:
            state.show(wanted)
            return
        about, process = COSTS.get(what.what, 1.0) * self._unit, None
        if self.settings is not None and Path(state.settings.scene).suffix != ".xml":
            process, about = compiling_process(wanted, self._folder.name), about + START
        self.choose(f"compiling {wanted.view if name == 'view' else name.replace('_', ' ')}", about, take, process)

    def _choose_scene(self, name: str) -> None:
        """Show another shipped scene, in its own view."""
        if self.settings is None or name not in scene_names():
            raise one_of("scene", name, [] if self.settings is None else scene_names())
        place = dict.fromkeys(("eye", "at", "up", "fov", "window", "up_axis"))
        size = (self.renderer.width, self.renderer.height) if self.follows_size else self.settings.size
        wanted = replace(self.settings, scene=name, view=None, size=size, **place)

        def take() -> None:
            """Load it, and free the memory of the one before."""
            former = self.sides
            renderer = first_renderer(wanted, begins_lit=True)
            quick_pixels(renderer.render())
            self._begin_with(renderer)
            self._expose_at_first()
            for state in former:
                state.destroy()

        self.choose(f"loading {name}", COSTS["estimator"] * self._unit, take)

    def on_ack(self, id: int, watcher: Watcher) -> None:
        """Note which frame a page shows: 0 is a page that has opened again."""
        watcher.shown = max(watcher.shown, min(id, watcher.last.number))
        if id == 0:
            watcher.last = NO_FRAME

    def on_save(self, kind: str, watcher: Watcher) -> None:
        """Send a page the picture as a file, as ``renderer.save`` writes it: "png" or "exr"."""
        with TemporaryDirectory() as folder:
            path = Path(folder) / f"picture.{kind}"
            current(self.renderer).save(path)
            watcher.send({"file": path.name}, path.read_bytes())

    def on_expose(self) -> None:
        """Choose the exposure that shows the picture well."""
        self.renderer.expose()

    def on_cancel(self) -> None:
        """Give up what was chosen, while another process compiles it."""
        if self.choice is not None:
            self.choice.cancel()
            self.choice, self.message = None, "Cancelled."

    def on_reset(self) -> None:
        """Bring the camera back to where it was at first."""
        self.renderer.camera.set_camera_parameters(**self.first_camera)

    def on_explain(self, column: int, row: int, sample: int) -> None:
        """Explain a pixel."""
        most = max(0, self.renderer.film.samples - 1)

        def explain() -> None:
            """Find every number on the way to the pixel."""
            self.explanation = self.renderer.explain(column, row, min(sample, most))._repr_html_()
            self.explained = column, row

        self.choose(f"explaining column {column}, row {row}", self._unit, explain)

    def on_same(self) -> None:
        """Show what makes this picture again: the command, the options of its camera, and Python."""
        camera = RenderSettings(**camera_settings(self.renderer.camera)).words()
        texts = as_command(self.renderer, self.settings), shlex.join(camera), as_python(self.renderer)
        self.explanation, self.explained = "".join(f"<pre>{html.escape(text)}</pre>" for text in texts), None

    def on_close(self) -> None:
        """Close the explanation."""
        self.explanation, self.explained = "", None

    def on_point(self, column: int, row: int) -> None:
        """Show the numbers of a pixel."""
        self.pointed = column, row

    def on_look(self, column: int, row: int, columns: int, rows: int) -> None:
        """Show the numbers of a region of pixels; of none where it has no columns."""
        self.region = (column, row, columns, rows) if columns > 0 else None

    def on_size(self, width: int, height: int) -> None:
        """Give the picture the size of the page."""
        size = width, height
        if not self.follows_size or self.mode != OFF or size == (self.renderer.width, self.renderer.height):
            return
        scale = min(1.0, (MOST_PIXELS / (width * height)) ** 0.5)
        self.state.resize(int(width * scale), int(height * scale))
        self.preview, self.pointed, self.explained = Preview(), None, None
        self._is_cold = self.choice is None  # a choice prepares the moving picture, too

    def on_compare(self, mode: str, side: str, equal: str) -> None:
        """Choose how one picture is shown, or two.

        Args:
            mode: one of the ways of ``channel``. side: which of two the controls change.
            equal: what both have the same number of, "samples" or "seconds"; if it is another one, both begin again.
        """

        def begin() -> None:
            """Make the second picture, and compile it."""
            self.sides, self.number, self.mode = [self.state, self.state.beside()], 1, mode
            for one in self.renderers:
                quick_pixels(one.render())
                one.reset()

        if equal != self.equal:
            self.equal = equal
            for one in self.renderers:
                one.reset()
        if mode == OFF:
            self.sides, self.number, self.mode = [self.state], 0, OFF
        elif self.mode == OFF:
            self.choose("preparing the second picture", self._unit, begin)
        else:
            self.number, self.mode = SIDES.index(side), mode

    # ── frames ──

    def make_frame(self) -> bool:
        """Make and send a frame if a page takes one and anything is new of the picture or beside it; whether it was."""
        self.look_at_error()
        if self.seconds_to_frame() > 0:
            return False
        kind = "jpeg" if self.is_moving else "png"
        make = quick_pixels if self.is_moving else exact_pixels
        shown = self.renderers if self.coarse is None else [self.coarse]
        data = self.frame.data
        if self._has_new_picture or kind != self.frame.kind:
            if self.mode == DIFFERENCE:
                pixels, self.scale = difference_of(*self.renderers)
            else:
                pixels = np.concatenate([make(one) for one in shown], axis=1)
            data = encoded(pixels, kind)
        self._has_new_picture, self.framed_at = False, self.now()
        self._due = np.inf if kind == "png" else self._moved_at + MOVING  # then the lossless picture follows
        self.frame = Frame(self.frame.number + 1, kind, data, self.page_state(shown))
        self.send_frame()
        return True

    def send_frame(self) -> None:
        """Send the newest frame to the pages that do not have it and can take it."""
        for one in [*self.watchers]:
            if one.is_ready and one.last.number < self.frame.number:
                one.show(self.frame)

    def look_at_error(self) -> None:
        """Estimate the error from time to time, and go on with the curve of this estimator."""
        random = [one for one in self.renderers if one.is_random and one.film.samples > 1]
        is_known = self.now() < self._next_error and all(id(one) in self.errors for one in random)
        if not random or self.is_moving or is_known:
            return
        begin = self.now()
        self.errors = {id(one): error_of(one) for one in random}
        rest = ERROR_REST * (self.now() - begin)
        self.curves = {}
        for side, renderer in zip(SIDES, self.renderers, strict=False):
            for name, curve in renderer.error_curves.items():
                points = [[p.seconds, float(p.error)] for p in curve if np.isfinite(p.error) and p.error > 0]
                self.curves[name if self.mode == OFF else f"{side}: {name}"] = points
        self._next_error = self.now() + max(ERROR_EVERY, rest, ERROR_SHARE * self.renderer.rendered_seconds)

    def page_state(self, shown: Sequence[ProgressiveRenderer]) -> dict[str, Any]:
        """What a page shows beside the pictures: what is chosen, what can be chosen, and what is known of them."""
        renderer, choice = self.renderer, self.choice
        sides = [
            {
                "view": one.active.name,
                "samples": one.samples if one.is_random else 0,
                "seconds": one.rendered_seconds,
                "error": self.errors.get(id(one)),
            }
            for one in shown
        ]
        offered = [
            {"what": cls.what, "names": [[one.name, one.label or one.name] for one in offers]}
            for cls, offers in self.state.offered
        ]
        scale = self.scale if self.mode == DIFFERENCE else shown[self.number].scale
        is_still = not self.is_moving
        return {
            "width": renderer.width,
            "height": renderer.height,
            "follows": self.follows_size,
            "what": renderer.what,
            "view": renderer.active.name,
            "scene": name_of(renderer.scene_data.source),
            "scenes": [] if self.settings is None else scene_names(),
            "offered": offered,
            "controls": self.state.controls(),
            "compare": {"mode": self.mode, "side": SIDES[self.number], "equal": self.equal},
            "sides": sides,
            "curves": self.curves,
            "scale": scale and {"high": f"{scale.high:.3g}", "text": scale.text},
            "pointed": look_at(*self.pointed, self.renderers) if self.pointed and is_still else None,
            "values": linear_values(renderer, *self.region) if self.region and is_still else None,
            "busy": choice and {"text": choice.text, "about": choice.about, "began": choice.began},
            "message": self.message,
            "explanation": self.explanation,
            "explained": self.explained,
        }


def error_of(renderer: ProgressiveRenderer) -> dict[str, Any]:
    """What is known of the error of a picture, in per cent; None where a number is unknown."""
    error, typical = renderer.error(), typical_error(renderer.film)
    numbers = {"rmse": float(error), "low": error.low, "high": error.high, "typical": typical}
    finite = {name: 100 * value if np.isfinite(value) else None for name, value in numbers.items()}
    return {**finite, "text": str(error)}


def is_final(renderer: ProgressiveRenderer, has_time: bool = False) -> bool:
    """Whether a picture needs no more samples: that of a view without random ones; or any, where more ``has_time``."""
    return (has_time or not renderer.is_random) and renderer.film.samples > 0 and renderer.is_current()
