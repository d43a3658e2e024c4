"""The interactive window (A1-16): a control panel beside the picture. The only file that uses ``ti.ui``.

The panel stands in a margin of its own and so hides nothing of the scene. ``ti.ui`` tells a program neither of the
mouse wheel nor of F1: zooming is a drag with the right button, or the keys i and o; help is the key h, or a button.
"""

import math
import shlex
import time
from argparse import Namespace
from collections.abc import Sequence
from pathlib import Path

import numpy as np
import taichi as ti
import taichi.math as tm

from taichi_tracer.apps import camera_controller
from taichi_tracer.apps.camera_controller import Pose
from taichi_tracer.apps.display import can_open_window
from taichi_tracer.apps.plot import draw_curve
from taichi_tracer.apps.requests import scene_and_pictures_of
from taichi_tracer.apps.words import PICTURE_FOLDER, let_every_character_print
from taichi_tracer.camera import OrthographicCamera, ProjectiveCamera
from taichi_tracer.files.images import check_writable
from taichi_tracer.renderer import ProgressiveRenderer
from taichi_tracer.scene_data_loader import name_of
from taichi_tracer.system.digits import digits
from taichi_tracer.system.errors import InputError
from taichi_tracer.system.registry import PARTS

TITLE = "Interactive Renderer"
PANEL_WIDTH, PANEL_LINE = 248, 24  # pixels; they fit 32 characters, and a button, in ti.ui's only font
HELP_WIDTH, HELP_HEIGHT = 300, 210  # pixels; they fit HELP
SMALLEST_PICTURE = 384  # pixels: smaller pictures are shown enlarged, pixel by pixel
FRAMES_PER_SECOND = 120  # no faster, to leave the machine to others
PLOT_HEIGHT = 150  # pixels, of the drawing of error against time under the panel
MOST_POINTS = 400  # of that drawing; then every other one is left out
SLOW_FRAME = 0.06  # seconds; a moving picture stutters beyond it
SMOOTHING = 0.1  # the share of the newest frame in the time that is shown, so that it can be read
ERROR_EVERY = 0.5  # seconds between two estimates of the error: each reads the whole film
BACKGROUND = 0.12
OFFLINE_SPP = 16  # of a picture that is noisy, where there is no window to watch it grow
HELP_PLACE = 0.02, 0.05  # fractions of the window between the panel, or the top, and the help
DISPLAY_LINES = 2  # of the panel, where light is shown: exposure and tone curve
MOST_EXPOSURE, EXPOSURE_STEP = 10.0, 0.125  # stops: the ends of the slider, and between two of its places
OTHER_LINES = 9  # of the panel beside texts and views: its title, frame, time, two buttons, and a message of four lines
TEXTS = ("'Eye' param uses 'wasdqe' keys", "'At' param uses arrow keys")
HELP = (
    "a d         eye left, right (along x)",
    "w s         eye up, down (along y)",
    "e q         eye to +z, to -z, or zoom",
    "arrows      move the point looked at",
    "drag        orbit about that point",
    "right drag  up: nearer, down: farther",
    "i o         nearer, farther",
    "p           save the picture",
    "h           this help",
    "Esc         close",
)


def run(args: Namespace) -> int:
    """``taichi-tracer view``: the window of the renderer that offers the view asked for."""
    scene, (picture, *_) = scene_and_pictures_of(args)
    (renderer_class, integrator), *_ = picture.views
    renderer = picture.make_renderer(renderer_class, scene.load()).use(integrator.name)
    return show(renderer, scene_options=scene.words())


def show(renderer: ProgressiveRenderer, folder: str | Path = PICTURE_FOLDER, scene_options: Sequence[str] = ()) -> int:
    """Open the window, until it is closed; where none can open, write every view into ``folder`` instead.

    Args:
        scene_options: words of the command line that make the scene, to be repeated in the command that makes a saved
            picture again.

    Returns:
        0, in both cases: the exit code of a program that shows pictures.
    """
    let_every_character_print()
    verdict = can_open_window()
    if verdict.can_open:
        Viewer(renderer, Path(folder), scene_options).run()
        return 0
    paths = write_all(renderer, Path(folder))
    print(f"No window can open here: {verdict.reason}.")
    print(f"What {type(renderer).__name__} shows is in {paths[0].parent.resolve()}:")
    for path in paths:
        print(f"  {path}")
    print(f"For a window: {verdict.remedy}")
    return 0


def write_all(renderer: ProgressiveRenderer, folder: Path) -> list[Path]:
    """One picture per thing that the renderer offers; returns their paths."""
    spp = OFFLINE_SPP if renderer.srgb else 1
    return [save(renderer.use(integrator.name).render(spp), folder) for integrator in renderer.offers]


def save(renderer: ProgressiveRenderer, folder: Path) -> Path:
    """Write what the renderer shows now to <folder>/<scene>_<view>.png; InputError where that cannot be."""
    folder.mkdir(parents=True, exist_ok=True)
    path = folder / f"{Path(renderer.scene_data.source).stem}_{renderer.active.name}.png"
    check_writable(path)
    renderer.save(path)
    return path


@ti.data_oriented
class Screen:
    """What the window shows: the picture, enlarged where it is small, to the right of the panel's margin.

    Attributes:
        pixels: the field [x, y] for ``ti.ui``, y up.
        width, height: of the whole window, in pixels.
        panel, panel_height: the panel's size as fractions of the window's; a drawing may stand below.
    """

    def __init__(self, renderer: ProgressiveRenderer, panel_lines: int) -> None:
        self.renderer, self.source = renderer, renderer.canvas
        plot = PLOT_HEIGHT if renderer.needs_light else 0
        self.scale = max(1, SMALLEST_PICTURE // max(renderer.width, renderer.height))
        self.shown_width, self.shown_height = renderer.width * self.scale, renderer.height * self.scale
        self.width = PANEL_WIDTH + self.shown_width
        self.height = max(self.shown_height, PANEL_LINE * panel_lines + plot)
        self.below = (self.height - self.shown_height) // 2
        self.panel = PANEL_WIDTH / self.width
        self.panel_height = 1 - plot / self.height
        self.pixels = ti.Vector.field(3, ti.f32, shape=(self.width, self.height))
        self.pixels.fill(BACKGROUND)

    def update(self) -> None:
        """Copy the canvas into its place: data as it is, light as ``renderer.display`` says."""
        display = self.renderer.display
        self._copy(self.renderer.srgb, display.part, display.scale)

    @ti.kernel
    def _copy(self, srgb: ti.template(), tone: ti.template(), exposure: ti.f32):
        for x, y in ti.ndrange(self.shown_width, self.shown_height):
            color = ti.cast(self.source[x // self.scale, y // self.scale], ti.f32)
            if ti.static(srgb):
                color = encode_srgb(tone.curve(tm.clamp(color * exposure, 0.0, tone.white)))
            self.pixels[PANEL_WIDTH + x, self.below + y] = color

    @ti.kernel
    def put_plot(self, plot: ti.types.ndarray(dtype=ti.f32, ndim=3)):
        """Copy a drawing, top row first, under the panel."""
        for row, x in ti.ndrange(plot.shape[0], plot.shape[1]):
            for k in ti.static(range(3)):
                self.pixels[x, plot.shape[0] - 1 - row][k] = plot[row, x, k]

    def holds(self, cursor: tuple[float, float]) -> bool:
        """Whether a point of the window, in fractions, is beside the panel."""
        return cursor[0] >= self.panel

    def as_drag(self, start: tuple[float, float], end: tuple[float, float]) -> tuple[float, float]:
        """A way of the mouse, in fractions of the picture instead of the window."""
        across = (end[0] - start[0]) * self.width / self.shown_width
        return across, (end[1] - start[1]) * self.height / self.shown_height


@ti.func
def encode_srgb(linear):
    """The sRGB transfer function of IEC 61966-2-1, as files are written (C-14)."""
    c = tm.clamp(linear, 0.0, 1.0)
    return ti.select(c <= 0.0031308, 12.92 * c, 1.055 * tm.pow(c, tm.vec3(1 / 2.4)) - 0.055)


class Viewer:
    """The window's loop: read keys and mouse, move the camera, render one sample, show it with the panel."""

    def __init__(self, renderer: ProgressiveRenderer, folder: Path, scene_options: Sequence[str] = ()) -> None:
        self.renderer, self.folder, self.scene_options = renderer, folder, tuple(scene_options)
        self.shows_light = any(integrator.srgb for integrator in renderer.offers)
        lines = len(renderer.offers) + len(TEXTS) + OTHER_LINES + DISPLAY_LINES * self.shows_light
        self.screen = Screen(renderer, lines)
        self.message: list[str] = []
        self.shows_help = False
        self.frame_seconds = 0.0
        self.started, self.error, self.error_at, self.last_samples = 0.0, math.nan, 0.0, math.inf
        self.curve: list[tuple[float, float]] = []  # (seconds, error) since the picture was begun

    def run(self) -> None:
        """Show the window until it is closed."""
        self.warm_up()
        self.window = ti.ui.Window(TITLE, (self.screen.width, self.screen.height), fps_limit=FRAMES_PER_SECOND)
        self.cursor = self.window.get_cursor_pos()
        self.drags_picture = False
        last = time.perf_counter()
        while self.window.running:
            view = self.renderer.active
            self.read_events()
            now = time.perf_counter()
            self.move_camera(now - last)
            last = now
            self.draw()
            self.window.get_canvas().set_image(self.screen.pixels)
            self.draw_panel(self.window.get_gui())
            self.window.show()
            if self.renderer.active is not view:
                self.draw()  # compiles: not time in which a held key moves the camera, and not that of a frame
                self.frame_seconds = 0.0
                last = time.perf_counter()
        self.window.destroy()

    def warm_up(self) -> None:
        """Compile before the window opens what a moving camera needs; otherwise it would freeze at the first key.

        Packets (``PrimaryHits``) take seconds to compile: only pictures that are slow without are worth that.
        """
        self.renderer.eye_rays.use_packets = False
        self.draw()
        self.renderer.camera.set_camera_parameters()  # as if moved
        self.frame_seconds = 0.0
        self.draw()
        if self.frame_seconds > SLOW_FRAME and self.renderer.eye_rays.can_use_packets:
            print("compiling the fast form for a picture of this size ...", flush=True)
            self.renderer.eye_rays.use_packets = None  # let the renderer decide
            self.renderer.camera.set_camera_parameters()
            self.draw()
        self.frame_seconds = 0.0

    def draw(self) -> None:
        """Render a sample and bring it to the screen; measures the time, smoothed so that it can be read."""
        start = time.perf_counter()
        self.renderer.render()
        self.screen.update()
        ti.sync()
        seconds = time.perf_counter() - start
        self.frame_seconds += (seconds - self.frame_seconds) * (SMOOTHING if self.frame_seconds > 0 else 1.0)

    def read_events(self) -> None:
        """What was pressed once since the last frame."""
        for event in self.window.get_events(ti.ui.PRESS):
            if event.key == ti.ui.ESCAPE:
                self.window.running = False
            elif event.key == "p":
                self.save_picture()
            elif event.key == "h":
                self.shows_help = not self.shows_help
            elif event.key in (ti.ui.LMB, ti.ui.RMB):
                self.cursor = self.window.get_cursor_pos()
                self.drags_picture = self.screen.holds(self.cursor) and not self.shows_help

    def move_camera(self, seconds: float) -> None:
        """Let held keys and the mouse move the camera; a camera that stays put keeps its samples."""
        keys = {key for key in camera_controller.KEYS if self.window.is_pressed(key)}
        last, self.cursor = self.cursor, self.window.get_cursor_pos()
        orbit, zoom = (0.0, 0.0), 0.0
        if self.drags_picture:
            drag = self.screen.as_drag(last, self.cursor)
            if self.window.is_pressed(ti.ui.LMB):
                orbit = drag
            elif self.window.is_pressed(ti.ui.RMB):
                zoom = drag[1]
        camera = self.renderer.camera
        if keys or zoom != 0 or orbit != (0, 0):
            pose = camera_controller.step(Pose.of(camera), keys, seconds, orbit, zoom)
            camera.set_camera_parameters(**pose.parameters())

    def progress(self) -> str:
        """Seconds since the picture was begun, and its estimated error, measured twice a second."""
        now = time.perf_counter()
        if self.renderer.samples <= self.last_samples:  # begun anew since the last frame
            self.started, self.error, self.curve = now, math.nan, []
        self.last_samples = self.renderer.samples
        if now - self.error_at > ERROR_EVERY:
            self.error, self.error_at = self.renderer.error(), now
            self.curve.append((now - self.started, float(self.error)))
            if len(self.curve) > MOST_POINTS:
                del self.curve[1::2]
            self.screen.put_plot(draw_curve(self.curve, PANEL_WIDTH, PLOT_HEIGHT))
        error = "" if math.isnan(self.error) else f", error {100 * self.error:.2g} %"
        return f"Time: {now - self.started:.1f} s{error}"

    def save_picture(self) -> None:
        """Write the picture; say where, or why not, in the panel and on the terminal."""
        try:
            told = ("Saved", str(save(self.renderer, self.folder)))
            print(*told)
            print("The same again:", as_command(self.renderer, self.scene_options), flush=True)
        except (OSError, InputError) as error:
            told = ("Not saved:", str(error))
            print(*told, flush=True)
        self.message = [line for text in told for line in wrap(text)]

    def draw_panel(self, gui) -> None:
        """The control panel, and the help."""
        with gui.sub_window("Control Panel", 0.0, 0.0, self.screen.panel, self.screen.panel_height) as panel:
            for text in TEXTS:
                panel.text(text)
            for integrator in self.renderer.offers:
                is_active = integrator is self.renderer.active
                if panel.button((integrator.label or integrator.name) + (" [Active]" if is_active else "")):
                    self.renderer.use(integrator.name)
            if self.shows_light:
                self.draw_display(panel)
            panel.text(f"Frame: {self.frame_seconds * 1e3:.1f} ms, {self.renderer.samples} spp")
            if self.renderer.needs_light:
                panel.text(self.progress())
            if panel.button("Save picture (p)"):
                self.save_picture()
            if panel.button("Help (h)"):
                self.shows_help = not self.shows_help
            for line in self.message:
                panel.text(line)
        self.draw_help(gui)

    def draw_display(self, panel) -> None:
        """The slider of the exposure, and the button that takes the next tone curve; the samples stay."""
        display = self.renderer.display
        exposure = panel.slider_float("exposure", float(display.exposure), -MOST_EXPOSURE, MOST_EXPOSURE)
        tones = PARTS.all("tone curve")
        tone = display.part
        if panel.button(f"Tone curve: {tone.label or tone.name}"):
            tone = tones[(tones.index(tone) + 1) % len(tones)] if tone in tones else tones[0]
        if exposure != float(np.float32(display.exposure)):  # the slider has f32
            self.renderer.set_display(exposure=round(exposure / EXPOSURE_STEP) * EXPOSURE_STEP)
        if tone is not display.part:
            self.renderer.set_display(tone=tone)

    def draw_help(self, gui) -> None:
        """The help over the picture, while it is asked for."""
        if self.shows_help:
            width, height = HELP_WIDTH / self.screen.width, HELP_HEIGHT / self.screen.height
            right, down = HELP_PLACE
            with gui.sub_window("Help", self.screen.panel + right, down, width, height) as overlay:
                for line in HELP:
                    overlay.text(line)


def as_command(renderer: ProgressiveRenderer, scene_options: Sequence[str] = ()) -> str:
    """The command line that makes the picture that the renderer shows; arguments as for ``show``."""
    camera = renderer.camera
    scene = name_of(renderer.scene_data.source)
    words = ["taichi-tracer", "render", scene, *scene_options, "--view", renderer.active.name]
    if renderer.needs_light:
        environment = renderer.scene_data.environment
        words += ["--environment", "none" if environment is None else environment.name]
        words += ["--spp", str(renderer.samples), "--sampler", renderer.sampler.name]
    words += ["--seed", str(renderer.seed)] * (renderer.seed != 0)
    words += ["--jitter"] * (renderer.jitter and not renderer.jitters) + ["--adaptive"] * renderer.adaptive
    words += renderer.display.words() if renderer.srgb else []
    words += ["--size", f"{renderer.width}x{renderer.height}"]
    for name in ("eye", "at", "up"):
        words += [f"--{name}", *(digits(x, ".9g") for x in getattr(camera, name))]
    return shlex.join([*words, *projection_of(camera)])


def projection_of(camera: ProjectiveCamera) -> list[str]:
    """The options that make the projection of a camera, its window at distance 1 where it is perspective."""
    words = ["--camera", camera.name]
    if camera.has_window:
        scale = 1.0 if isinstance(camera, OrthographicCamera) else camera.focal_distance
        words += ["--window", *(digits(edge / scale, ".9g") for edge in camera.screen_window)]
    else:
        words += ["--fov", f"{camera.fov:.9g}"]
    return [*words, "--handedness", camera.handedness]


def wrap(text: str) -> list[str]:
    """``text`` in lines that fit into the panel; a path is broken where it must be."""
    fits = 32  # characters
    return [text[i : i + fits] for i in range(0, len(text), fits)]
