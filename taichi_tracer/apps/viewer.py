"""The interactive window (A1-16): a panel, and the picture beside it. The only file that uses ``ti.ui``.

``ti.ui`` does not tell a program of the mouse wheel: zooming is a drag with the right button, or the keys i and o. The
page (``view --browser``) has more: comparing, explaining, all settings.
"""

import contextlib
import os
import tempfile
import time
from collections.abc import Callable, Iterator, Sequence
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import taichi as ti

from taichi_tracer import camera_controller
from taichi_tracer.apps.console import PICTURE_FOLDER, let_every_character_print
from taichi_tracer.apps.display import missing_for_window
from taichi_tracer.apps.page.channel import quick_pixels
from taichi_tracer.apps.page.compile_ahead import warm_up
from taichi_tracer.apps.page.renderer_state import Preview, RendererState, after, current
from taichi_tracer.apps.page.server import serve
from taichi_tracer.apps.page.session import Session
from taichi_tracer.apps.pictures import as_command, name_of_light, position_of
from taichi_tracer.camera_controller import Pose
from taichi_tracer.explain.maps import MapRenderer
from taichi_tracer.files.images import check_writable
from taichi_tracer.integrators.base import Integrator
from taichi_tracer.progressive import ProgressiveRenderer
from taichi_tracer.settings import RenderSettings
from taichi_tracer.system.errors import InputError

TITLE = "Interactive Renderer"
FRAMES_PER_SECOND = 120  # no faster, to leave the machine to others
SMOOTHING = 0.1  # the share of the newest frame in the time that is shown, so that it can be read
BUSY = "One moment: compiling ..."
TEXTS = ("'Eye' param uses 'wasdqe' keys", "'At' param uses arrow keys")
PANEL, BACKGROUND, FITS = 264, 31, 34  # pixels, of 255, letters in a line of the panel
SMALLEST = 384  # pixels: smaller pictures are shown enlarged, pixel by pixel
FACTORS = 0.1, 4.0  # of the slider of the speed: times what fits the scene
SECTIONS = ("light", "display", "estimator")  # of the settings that the panel has; the page has all
CHANGED = 1e-5  # relative: sliders return f32, so that a smaller change is only rounding
OFFLINE_SPP = 16  # of a picture that is noisy, where there is no window to watch it grow


def show(
    renderer: ProgressiveRenderer,
    folder: str | Path = PICTURE_FOLDER,
    settings: RenderSettings | None = None,
    offers_browser: bool = False,
    all_views: bool = True,
) -> int:
    """Open the window, until it is closed; where none can open, write pictures into ``folder`` instead.

    Args:
        settings: what the program was started with, for the command that makes a saved picture again.
        offers_browser: whether the picture is served to a browser where no window can open.
        all_views: whether everything that the renderer offers is written there, and not only what it shows.

    Returns:
        0, in both cases: the exit code of a program that shows pictures.
    """
    let_every_character_print()
    missing = missing_for_window()
    if missing is None:
        Viewer(renderer, Path(folder), settings).run()
        return 0
    reason, remedy = missing
    print(f"No window can open here: {reason}.")
    if offers_browser:
        return serve(Session(renderer, settings))
    shown = asked_for(renderer) if all_views else (renderer.active,)
    spp = OFFLINE_SPP if renderer.srgb else 1
    paths = [save(renderer.use(integrator.name).render(spp), Path(folder)) for integrator in shown]
    print(f"What {type(renderer).__name__} shows is in {paths[0].parent.resolve()}:")
    for path in paths:
        print(f"  {path}")
    print(f"For a window: {remedy}")
    return 0


def asked_for(renderer: ProgressiveRenderer) -> Sequence[Integrator]:
    """What its assignment asks for, of what a renderer offers; everything where it asks for nothing single."""
    return [one for one in renderer.offers if one.name in renderer.asked] or renderer.offers


def save(renderer: ProgressiveRenderer, folder: Path) -> Path:
    """Write what the renderer shows now to <folder>/<scene>_<view>.png; InputError where that cannot be."""
    folder.mkdir(parents=True, exist_ok=True)
    light = name_of_light(renderer)
    bounces = light and f"_bounce_{light}"
    path = folder / f"{Path(renderer.scene_data.source).stem}_{renderer.active.name}{bounces}.png"
    check_writable(path)
    renderer.save(path)
    return path


class Viewer:
    """The window: a panel, and the picture beside it.

    Args:
        folder: for pictures that are saved. settings: as for ``show``.
    """

    def __init__(self, renderer: ProgressiveRenderer, folder: Path, settings: RenderSettings | None = None) -> None:
        self.state, self.folder, self.settings = RendererState(renderer, settings), folder, settings
        self.zoom = max(1, SMALLEST // max(renderer.width, renderer.height))
        self.pixels = np.full((PANEL, 1, 3), BACKGROUND, np.uint8)
        self.message: list[str] = []
        self.pending: Callable[[], None] | None = None  # what was chosen, and takes time, in the frame that shows BUSY
        self.frame_seconds, self.moves = 0.0, False
        self.preview = Preview()
        geometry = renderer.scene_data.geometry
        self.usual_speed = self.speed = camera_controller.speed_for(geometry.low, geometry.high)
        self.first_camera = position_of(renderer.camera)

    @property
    def renderer(self) -> ProgressiveRenderer:
        """The renderer that shows."""
        return self.state.renderer

    def run(self) -> None:
        """Show the window until it is closed."""
        warm_up(self.renderer, self.draw)
        self.frame_seconds = 0.0
        self.window = ti.ui.Window(TITLE, self.pixels.shape[:2], fps_limit=FRAMES_PER_SECOND)
        self.cursor, self.drags_picture = self.window.get_cursor_pos(), False
        self.tapped: set[str] = set()  # what was pressed since the last frame, and may be released again
        with tempfile.TemporaryDirectory() as folder:
            last = time.perf_counter()
            while self.window.running:
                self.read_events()
                now = time.perf_counter()
                self.move_camera(now - last)
                last, chosen = now, self.pending
                self.draw()
                self.window.get_canvas().set_image(self.pixels)
                self.draw_panel(self.window.get_gui())
                with within(folder):  # where ti.ui writes its own file, imgui.ini
                    self.window.show()
                if chosen is not None:
                    self.take_choice()
                    last = time.perf_counter()  # compiling is not time in which a held key moves the camera
            with within(folder):
                self.window.destroy()

    def take_choice(self) -> None:
        """Do what was chosen in the panel, and render the first sample, which compiles what it needs."""
        choice, self.pending = self.pending, None
        if choice is not None:
            self.message = []
            try:
                choice()
            except InputError as error:
                self.tell(str(error))
            self.draw()
            self.frame_seconds = 0.0

    def choose(self, choice: Callable[[], None]) -> None:
        """Do something after the next frame, which says that it may compile."""
        self.pending = choice
        self.tell(BUSY)

    def draw(self) -> None:
        """Render a sample and bring it to the window; while the camera moves, of a coarse picture if need be."""
        start = time.perf_counter()
        shown = self.preview.of(self.renderer) if self.moves else self.renderer
        rows = quick_pixels(shown.render())
        picture = np.flipud(rows).swapaxes(0, 1)  # as ti.ui has it: x, y, with y up
        zoom = self.zoom * max(1, round(self.renderer.width / shown.width))
        picture = picture.repeat(zoom, axis=0).repeat(zoom, axis=1)
        panel = np.full((PANEL, picture.shape[1], 3), BACKGROUND, np.uint8)
        self.pixels = np.ascontiguousarray(np.concatenate([panel, picture]))
        seconds = time.perf_counter() - start
        if self.moves:
            self.preview.took(self.renderer, seconds)
        self.frame_seconds += (seconds - self.frame_seconds) * (SMOOTHING if self.frame_seconds > 0 else 1.0)

    # ── keys and mouse ──

    def read_events(self) -> None:
        """What was pressed once since the last frame.

        ``ti.ui`` does not say where the mouse was when it was pressed: where it was in the last frame counts.
        """
        self.tapped = set()
        for event in self.window.get_events(ti.ui.PRESS):
            self.tapped.add(event.key)
            if event.key == ti.ui.ESCAPE:
                self.window.running = False
            elif event.key in (ti.ui.LMB, ti.ui.RMB):
                self.drags_picture = self.window.get_cursor_pos()[0] * self.pixels.shape[0] >= PANEL
            elif event.key == "p":
                self.save_picture()
            elif event.key == "r":
                self.reset()

    def is_pressed(self, key: str) -> bool:
        """Whether a key or a button is held, or was pressed since the last frame."""
        return key in self.tapped or self.window.is_pressed(key)

    def move_camera(self, seconds: float) -> None:
        """Let held keys and the mouse move the camera; a camera that stays put keeps its samples."""
        keys = {key for key in camera_controller.KEYS if self.is_pressed(key)}
        last, self.cursor = self.cursor, self.window.get_cursor_pos()
        orbit, zoom = (0.0, 0.0), 0.0
        if self.drags_picture:
            width = self.pixels.shape[0]
            drag = (self.cursor[0] - last[0]) * width / (width - PANEL), self.cursor[1] - last[1]
            if self.is_pressed(ti.ui.LMB):
                orbit = drag
            elif self.is_pressed(ti.ui.RMB):
                zoom = drag[1]
        camera = self.renderer.camera
        self.moves = bool(keys) or zoom != 0 or orbit != (0, 0)
        if self.moves:
            up_axis = self.state.scene.up_axis
            pose = camera_controller.step(Pose.of(camera), keys, seconds, orbit, zoom, self.speed, up_axis)
            camera.set_camera_parameters(**pose.parameters())

    # ── the panel ──

    def draw_panel(self, gui) -> None:
        """What can be shown, the light, and what the estimator has to choose; it scrolls where the window is low."""
        with gui.sub_window("Control Panel", 0.0, 0.0, PANEL / self.pixels.shape[0], 1.0) as panel:
            for text in TEXTS:
                panel.text(text)
            panel.text(f"Frame: {self.frame_seconds * 1e3:.1f} ms")
            if self.renderer.is_random:
                panel.text(f"{self.renderer.samples} samples")
            for renderer_class, offers in self.state.offered:
                if renderer_class is not MapRenderer or isinstance(self.renderer, MapRenderer):
                    self.draw_buttons(panel, renderer_class, offers)
            for control in self.state.controls():
                if control["section"] in SECTIONS:
                    self.draw_control(panel, control)
            self.speed = self.usual_speed * slide(panel, "x speed", self.speed / self.usual_speed, *FACTORS)
            if panel.button("Save picture (p)"):
                self.save_picture()
            if panel.button("Reset camera (r)"):
                self.reset()
            for line in self.message:
                panel.text(line)

    def draw_buttons(self, panel, renderer_class: type[ProgressiveRenderer], offers: Sequence[Integrator]) -> None:
        """A button for each view, estimator or path."""
        panel.text(f"-- {renderer_class.what}s --")
        for integrator in offers:
            is_active = renderer_class is type(self.renderer) and integrator.name == self.renderer.active.name
            if panel.button((integrator.label or integrator.name) + (" [Active]" if is_active else "")):
                self.choose(partial(self.state.change, "view", integrator.name))

    def draw_control(self, panel, control: dict[str, Any]) -> None:
        """A setting or a value of the integrator: a slider or a button. See ``RendererState.controls``."""
        name, value, label = control["name"], control["value"], control["label"]
        if control["kind"] == "names":
            if panel.button(f"{label.capitalize()}: {Path(value).name}"):
                self.choose(partial(self.state.change, name, after(value, control["names"])))
            return
        low, high, step = control["low"], control["high"], control["step"]
        panel.text(label)  # there is little room beside a slider
        slider = f"##{label}"
        chosen = panel.slider_int(slider, value, low, high) if step == 1 else slide(panel, slider, value, low, high)
        if chosen != value:
            try:
                self.state.change(name, min(max(round(chosen / step) * step, low), high))
            except InputError as error:
                self.tell(str(error))

    def tell(self, *texts: str) -> None:
        """Show texts in the panel, in lines that fit into it."""
        self.message = [text[i : i + FITS] for text in texts for i in range(0, len(text), FITS)]

    def save_picture(self) -> None:
        """Write the picture; say where, or why not, in the panel and on the terminal."""
        try:
            words = ("Saved", str(save(current(self.renderer), self.folder)))
            print(*words)
            print("The same again:", as_command(self.renderer, self.settings), flush=True)
        except (OSError, InputError) as error:
            words = ("Not saved:", str(error))
            print(*words, flush=True)
        self.tell(*words)

    def reset(self) -> None:
        """The camera and the speed of the beginning."""
        self.renderer.camera.set_camera_parameters(**self.first_camera)
        self.speed = self.usual_speed


def slide(panel, label: str, value: float, low: float, high: float) -> float:
    """What a slider has been moved to; exactly ``value`` if it has not been moved."""
    shown = min(max(value, low), high)
    chosen = panel.slider_float(label, shown, low, high)
    return value if abs(chosen - shown) <= CHANGED * abs(shown) else min(max(float(chosen), low), high)


@contextlib.contextmanager
def within(folder: str) -> Iterator[None]:
    """The working directory is another one for a moment."""
    former = os.getcwd()
    os.chdir(folder)
    try:
        yield
    finally:
        os.chdir(former)
