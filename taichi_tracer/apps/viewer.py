"""The interactive window (A1-16): a panel, and the picture beside it. The only file that uses ``ti.ui``.

``ti.ui`` does not tell a program of the mouse wheel: zooming is a drag with the right button, or the keys i and o. The
page (``view --browser``) has more: comparing, explaining, all settings.
"""

import contextlib
import os
import sys
import tempfile
import time
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import taichi as ti

from taichi_tracer import camera_controller
from taichi_tracer.apps.console import PICTURE_FOLDER, let_every_character_print
from taichi_tracer.apps.page.channel import quick_pixels
from taichi_tracer.apps.page.renderer_state import current
from taichi_tracer.apps.page.server import serve
from taichi_tracer.apps.page.session import Session
from taichi_tracer.apps.pictures import as_command
from taichi_tracer.explain.maps import MapRenderer
from taichi_tracer.files.images import check_writable
from taichi_tracer.integrators.base import Integrator
from taichi_tracer.progressive import ProgressiveRenderer
from taichi_tracer.settings import RenderSettings, name_of_bounces
from taichi_tracer.system import runtime
from taichi_tracer.system.errors import InputError

TITLE = "Interactive Renderer"
FRAMES_PER_SECOND = 120  # no faster, to leave the machine to others
SMOOTHING = 0.1  # the share of the newest frame in the time that is shown, so that it can be read
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
        all_views: whether everything that the renderer offers is written there, or else only what it shows; where an
            assignment asks for some of it, that is all.

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
    asked = [one for one in renderer.offers if one.name in renderer.asked] or renderer.offers
    shown = asked if all_views else (renderer.active,)
    spp = OFFLINE_SPP if renderer.srgb else 1
    paths = [save(renderer.use(integrator.name).render(spp), Path(folder)) for integrator in shown]
    print(f"What {type(renderer).__name__} shows is in {paths[0].parent.resolve()}:")
    for path in paths:
        print(f"  {path}")
    print(f"For a window: {remedy}")
    return 0


def missing_for_window() -> tuple[str, str] | None:
    """What is missing for a window, and what would mend it; None where one can open.

    It has to be known before: ``ti.ui`` ends the process where none can.
    """
    if not ti._lib.core.GGUI_AVAILABLE:
        return "this build of Taichi has no windows", "pip install --force-reinstall taichi"
    if sys.platform.startswith("linux"):
        name = os.environ.get("DISPLAY", "")
        if name == "":
            remedy = "run it on a desktop, or with: xvfb-run -s '-screen 0 1280x1024x24'"
            return "no display (DISPLAY is not set)", remedy
        socket = Path("/tmp/.X11-unix", f"X{name.rpartition(':')[2].partition('.')[0]}")  # /tmp/.X11-unix/X1 of ":1.0"
        if not socket.exists():
            return f"the display {name!r} is not on this machine", "view --browser serves the picture to a browser"
    if sys.platform != "darwin" and not runtime.vulkan_devices():
        remedy = "install the driver of your graphics card, or on Linux: sudo apt install mesa-vulkan-drivers"
        return "no Vulkan driver was found", remedy
    return None


def save(renderer: ProgressiveRenderer, folder: Path) -> Path:
    """Write what the renderer shows now to <folder>/<scene>_<view>.png; InputError where that cannot be."""
    folder.mkdir(parents=True, exist_ok=True)
    bounces = renderer.values().get("bounces")
    which = "" if bounces is None else f"_bounce_{name_of_bounces(bounces)}"
    path = folder / f"{Path(renderer.scene_data.source).stem}_{renderer.active.name}{which}.png"
    check_writable(path)
    renderer.save(path)
    return path


class Viewer:
    """The window: a panel, and beside it the picture of a ``Session``, which chooses, moves and renders.

    Args:
        folder: for pictures that are saved. settings: as for ``show``.
    """

    def __init__(self, renderer: ProgressiveRenderer, folder: Path, settings: RenderSettings | None = None) -> None:
        self.session, self.folder = Session(renderer, settings), folder
        self.usual_speed = self.session.speed
        self.zoom = max(1, SMALLEST // max(renderer.width, renderer.height))
        self.pixels = np.full((PANEL, 1, 3), BACKGROUND, np.uint8)
        self.frame_seconds = 0.0

    @property
    def renderer(self) -> ProgressiveRenderer:
        """The renderer that shows."""
        return self.session.renderer

    def run(self) -> None:
        """Show the window until it is closed."""
        self.session.warm_up()
        self.draw()
        self.window = ti.ui.Window(TITLE, self.pixels.shape[:2], fps_limit=FRAMES_PER_SECOND)
        self.cursor, self.drags_picture = self.window.get_cursor_pos(), False
        with tempfile.TemporaryDirectory() as folder:
            while self.window.running:
                self.read_input()
                self.session.take_choice()
                self.draw()
                self.window.get_canvas().set_image(self.pixels)
                self.draw_panel(self.window.get_gui())
                with within(folder):  # where ti.ui writes its own file, imgui.ini
                    self.window.show()
            with within(folder):
                self.window.destroy()

    def draw(self) -> None:
        """Render for a moment, and bring the picture to the window."""
        start = time.perf_counter()
        self.session.render()
        shown = self.session.coarse or self.renderer
        picture = np.flipud(quick_pixels(shown)).swapaxes(0, 1)  # as ti.ui has it: x, y, with y up
        zoom = self.zoom * max(1, round(self.renderer.width / shown.width))
        picture = picture.repeat(zoom, axis=0).repeat(zoom, axis=1)
        panel = np.full((PANEL, picture.shape[1], 3), BACKGROUND, np.uint8)
        self.pixels = np.ascontiguousarray(np.concatenate([panel, picture]))
        seconds = time.perf_counter() - start
        self.session.took(seconds)
        self.frame_seconds += (seconds - self.frame_seconds) * (SMOOTHING if self.frame_seconds > 0 else 1.0)

    # ── keys and mouse ──

    def read_input(self) -> None:
        """Let keys and the mouse do what they were pressed for, if only for a moment since the last frame.

        ``ti.ui`` does not say where the mouse was when it was pressed: where it was in the last frame counts.
        """
        tapped = {event.key for event in self.window.get_events(ti.ui.PRESS)}
        if ti.ui.ESCAPE in tapped:
            self.window.running = False
        if tapped & {ti.ui.LMB, ti.ui.RMB}:
            self.drags_picture = self.window.get_cursor_pos()[0] * self.pixels.shape[0] >= PANEL
        if "p" in tapped:
            self.save_picture()
        if "r" in tapped:
            self.reset()
        pressed = {
            k for k in (*camera_controller.KEYS, ti.ui.LMB, ti.ui.RMB) if k in tapped or self.window.is_pressed(k)
        }
        self.session.keys = pressed & set(camera_controller.KEYS)
        last, self.cursor = self.cursor, self.window.get_cursor_pos()
        if self.drags_picture:
            width = self.pixels.shape[0]
            dx, dy = (self.cursor[0] - last[0]) * width / (width - PANEL), self.cursor[1] - last[1]
            if ti.ui.LMB in pressed:
                self.session.on_move(orbit_x=dx, orbit_y=dy)
            elif ti.ui.RMB in pressed:
                self.session.on_move(nearer=dy)

    # ── the panel ──

    def draw_panel(self, gui) -> None:
        """What can be shown, the light, and what the estimator has to choose; it scrolls where the window is low."""
        with gui.sub_window("Control Panel", 0.0, 0.0, PANEL / self.pixels.shape[0], 1.0) as panel:
            for text in TEXTS:
                panel.text(text)
            panel.text(f"Frame: {self.frame_seconds * 1e3:.1f} ms")
            if self.renderer.is_random:
                panel.text(f"{self.renderer.samples} samples")
            choice = self.session.choice
            text = self.session.message if choice is None else f"One moment: {choice.text} ..."
            for first in range(0, len(text), FITS):
                panel.text(text[first : first + FITS])
            for renderer_class, offers in self.session.state.offered:
                if renderer_class is not MapRenderer or isinstance(self.renderer, MapRenderer):
                    self.draw_buttons(panel, renderer_class, offers)
            for control in self.session.state.controls():
                if control["section"] in SECTIONS:
                    self.draw_control(panel, control)
            faster = slide(panel, "x speed", self.session.speed / self.usual_speed, *FACTORS)
            self.session.speed = self.usual_speed * faster
            if panel.button("Save picture (p)"):
                self.save_picture()
            if panel.button("Reset camera (r)"):
                self.reset()

    def draw_buttons(self, panel, renderer_class: type[ProgressiveRenderer], offers: Sequence[Integrator]) -> None:
        """A button for each view, estimator or path."""
        panel.text(f"-- {renderer_class.what}s --")
        for integrator in offers:
            is_active = renderer_class is type(self.renderer) and integrator.name == self.renderer.active.name
            if panel.button((integrator.label or integrator.name) + (" [Active]" if is_active else "")):
                self.set("view", integrator.name)

    def draw_control(self, panel, control: dict[str, Any]) -> None:
        """A setting or a value of the integrator: a slider or a button. See ``RendererState.controls``."""
        name, value, label = control["name"], control["value"], control["label"]
        if "names" in control:
            if panel.button(f"{label.capitalize()}: {Path(value).name}"):
                names = control["names"]
                self.set(name, names[(names.index(value) + 1) % len(names)])
            return
        low, high, step = control["low"], control["high"], control["step"]
        panel.text(label)  # there is little room beside a slider
        slider = f"##{label}"
        chosen = panel.slider_int(slider, value, low, high) if step == 1 else slide(panel, slider, value, low, high)
        if chosen != value:
            self.set(name, min(max(round(chosen / step) * step, low), high))

    def set(self, name: str, value: Any) -> None:
        """Change a setting."""
        self.session.take([("set", {"name": name, "value": value})])

    def save_picture(self) -> None:
        """Write the picture; say where, or why not, in the panel and on the terminal."""
        try:
            path = save(current(self.renderer), self.folder)
            self.session.message = f"Saved {path}"
            print("The same again:", as_command(self.renderer, self.session.settings))
        except (OSError, InputError) as error:
            self.session.message = f"Not saved: {error}"
        print(self.session.message, flush=True)

    def reset(self) -> None:
        """The camera and the speed of the beginning."""
        self.session.on_reset()
        self.session.speed = self.usual_speed


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
