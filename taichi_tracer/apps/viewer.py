"""The interactive window (A1-16): the picture between two panels. The only file that uses ``ti.ui``.

The panels stand in margins of their own and so hide nothing of the scene: on the left what is shown, the six views, the
estimators of light and the paths; on the right the settings, as far as they have an effect on the picture. ``ti.ui``
tells a program neither of the mouse wheel nor of F1: zooming is a drag with the right button, or the keys i and o; help
is the key h, or a button.
"""

import math
import shlex
import sys
import time
from argparse import Namespace
from collections.abc import Callable, Sequence
from functools import partial
from pathlib import Path

import numpy as np
import taichi as ti

from taichi_tracer.apps import camera_controller, clipboard, pace
from taichi_tracer.apps.camera_controller import Pose
from taichi_tracer.apps.choices import Choices, after
from taichi_tracer.apps.display import can_open_window, screen_size
from taichi_tracer.apps.plot import draw_curves
from taichi_tracer.apps.requests import scene_and_pictures_of
from taichi_tracer.apps.same_again import DISTANCE, as_command, bounce_words, camera_words, position_of
from taichi_tracer.apps.screen import PANEL_WIDTH, Screen, first_size
from taichi_tracer.apps.server import serve
from taichi_tracer.apps.session import Session
from taichi_tracer.apps.words import PICTURE_FOLDER, let_every_character_print
from taichi_tracer.files.images import check_writable
from taichi_tracer.integrators.controls import BouncesControl, Control, NameControl
from taichi_tracer.integrators.path_settings import name_of as name_of_bounces
from taichi_tracer.maps import MapRenderer
from taichi_tracer.picture.progress import two_digits
from taichi_tracer.renderer import ProgressiveRenderer
from taichi_tracer.system.errors import InputError
from taichi_tracer.system.registry import PARTS

TITLE = "Interactive Renderer"
HELP_WIDTH, HELP_HEIGHT = 316, 260  # pixels; they fit HELP
FRAMES_PER_SECOND = 120  # no faster, to leave the machine to others
PLOT_HEIGHT = 170  # pixels, of the drawing of errors against time under the settings
SMOOTHING = 0.1  # the share of the newest frame in the time that is shown, so that it can be read
ANGLES = 5.0, 150.0  # degrees, of the slider of the field of view
FACTORS = 0.1, 4.0  # of the sliders of the speed and of white: times what fits the scene
CHANGED = 1e-5  # relative: sliders return f32, so that a smaller change is only rounding
FOLDED = (MapRenderer.what,)  # lists that are not shown until somebody asks for them, by a button in the right panel
BUSY = "One moment: compiling ..."
OFFLINE_SPP = 16  # of a picture that is noisy, where there is no window to watch it grow
HELP_PLACE = 12  # pixels between the panel, or the top, and the help
MOST_EXPOSURE, EXPOSURE_STEP = 10.0, 0.125  # stops: the ends of the slider, and between two of its places
OTHER_LINES = 9  # of the panel beside texts and views: its title, frame, time, two buttons, and a message of four lines
TITLE_HEIGHT, TEXT_HEIGHT, BUTTON_HEIGHT = 31, 17, 23  # pixels in ti.ui: of a panel's title with its edges, of lines
MESSAGE_LINES = 4
TEXTS = ("'Eye' param uses 'wasdqe' keys", "'At' param uses arrow keys")
HELP_KEYS = (
    "a d         eye left, right (along x)",
    "w s         eye up, down (along {up})",
    "e q         eye to {front}, to {back}, or zoom",
    "arrows      move the point looked at",
    "drag        orbit about that point",
    "right drag  up: nearer, down: farther",
    "i o         nearer, farther",
    "p           save the picture",
    "c           copy the camera's position",
    "r           reset the camera",
    "m           hide or show the panels",
    "h           this help",
    "Esc         close",
)
AXES = {"y": {"up": "y", "front": "+z", "back": "-z"}, "z": {"up": "z", "front": "-y", "back": "+y"}}  # for HELP_KEYS


def run(args: Namespace) -> int:
    """``taichi-tracer view``: the window of the renderer that offers the view asked for."""
    scene, (picture, *_) = scene_and_pictures_of(args)
    (renderer_class, integrator), *_ = picture.views
    renderer = picture.make_renderer(renderer_class, scene.load()).use(integrator.name)
    if args.browser:
        return serve(Session(renderer, scene.words()))
    return show(renderer, scene_options=scene.words(), offers_browser=sys.stdout.isatty())


def show(
    renderer: ProgressiveRenderer,
    folder: str | Path = PICTURE_FOLDER,
    scene_options: Sequence[str] = (),
    offers_browser: bool = False,
) -> int:
    """Open the window, until it is closed; where none can open, write every view into ``folder`` instead.

    Args:
        scene_options: words of the command line that make the scene, to be repeated in the command that makes a saved
            picture again.
        offers_browser: whether the picture is served to a browser where no window can open.

    Returns:
        0, in both cases: the exit code of a program that shows pictures.
    """
    let_every_character_print()
    verdict = can_open_window()
    if verdict.can_open:
        Viewer(renderer, Path(folder), scene_options).run()
        return 0
    print(f"No window can open here: {verdict.reason}.")
    if offers_browser:
        return serve(Session(renderer, scene_options))
    paths = write_all(renderer, Path(folder))
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
    bounces = "".join(f"_bounce_{name}" for name in bounce_words(renderer))
    path = folder / f"{Path(renderer.scene_data.source).stem}_{renderer.active.name}{bounces}.png"
    check_writable(path)
    renderer.save(path)
    return path


class Viewer:
    """The window's loop: read keys and mouse, move the camera, render one sample, show it between the panels."""

    def __init__(self, renderer: ProgressiveRenderer, folder: Path, scene_options: Sequence[str] = ()) -> None:
        self.choices, self.folder, self.scene_options = Choices(renderer), folder, tuple(scene_options)
        self.unfolded: str | None = None  # the kind whose list is unfolded if not all have room; None is what shows
        lists = self.buttons_of_lists()
        lines = sum(lists) + len(lists) + len(TEXTS) + OTHER_LINES
        picture = renderer.width, renderer.height
        self.first_size = first_size(picture, lines, screen_size())
        self.screen = Screen(self.first_size, picture)
        self.message: list[str] = []
        self.pending: Callable[[], None] | None = None  # what was chosen, and takes time, in the frame that shows BUSY
        self.shows_help = False
        self.frame_seconds = 0.0
        self.started, self.error, self.error_at, self.last_samples = 0.0, math.nan, 0.0, math.inf
        # The name of an estimator → (seconds, error) since its picture was begun; and which picture these are of.
        self.curves: dict[str, list[tuple[float, float]]] = {}
        self.curves_of: tuple = ()
        geometry = renderer.scene_data.geometry
        self.usual_speed = self.speed = camera_controller.speed_for(geometry.low, geometry.high)
        self.first_camera = position_of(renderer.camera)

    @property
    def renderer(self) -> ProgressiveRenderer:
        """The renderer that shows."""
        return self.choices.renderer

    def run(self) -> None:
        """Show the window until it is closed."""
        self.warm_up()
        size = self.first_size
        middle = [max(0, (of - own) // 2) for of, own in zip(screen_size() or size, size, strict=True)]
        self.window = ti.ui.Window(TITLE, size, fps_limit=FRAMES_PER_SECOND, pos=tuple(middle))
        self.cursor = self.window.get_cursor_pos()
        self.drags_picture = False
        last = time.perf_counter()
        while self.window.running:
            self.take_size()
            chosen = self.pending
            self.read_events()
            now = time.perf_counter()
            self.move_camera(now - last)
            last = now
            self.draw()
            self.window.get_canvas().set_image(self.screen.pixels)
            self.draw_panels(self.window.get_gui())
            self.window.show()
            if chosen is not None:
                self.take_choice()
                last = time.perf_counter()  # compiling is not time in which a held key moves the camera
        self.window.destroy()

    def warm_up(self) -> None:
        """Compile before the window opens what a moving camera needs; otherwise it would freeze at the first key."""
        pace.warm_up(self.renderer, self.draw)
        self.frame_seconds = 0.0

    def take_size(self) -> None:
        """Arrange the screen anew if the window was resized."""
        size = self.window.get_window_shape()
        if size != (self.screen.layout.width, self.screen.layout.height) and min(size) > 0:
            self.screen.resize(size)
            self.error_at = 0.0  # draw the curve again

    def take_choice(self) -> None:
        """Do what was chosen in the panels, and render the first sample, which compiles what it needs."""
        choice, self.pending = self.pending, None
        if choice is not None:
            self.message = []
            try:
                choice()
            except InputError as error:
                self.tell(str(error))
            self.last_samples = math.inf
            self.screen.resize((self.screen.layout.width, self.screen.layout.height))
            self.draw()
            self.frame_seconds = 0.0

    def draw(self) -> None:
        """Render a sample and bring it to the screen; measures the time, smoothed so that it can be read."""
        start = time.perf_counter()
        self.renderer.render()
        self.screen.update(self.renderer)
        ti.sync()
        seconds = time.perf_counter() - start
        self.frame_seconds += (seconds - self.frame_seconds) * (SMOOTHING if self.frame_seconds > 0 else 1.0)

    def read_events(self) -> None:
        """What was pressed once since the last frame."""
        for event in self.window.get_events(ti.ui.PRESS):
            if event.key == ti.ui.ESCAPE:
                self.window.running = False
            elif event.key in (ti.ui.LMB, ti.ui.RMB):
                self.cursor = self.window.get_cursor_pos()
                self.drags_picture = self.screen.layout.holds(self.cursor) and not self.shows_help
            else:
                self.press(event.key)

    def press(self, key: str) -> None:
        """What a key does that is pressed once; other keys do nothing."""
        if key == "p":
            self.save_picture()
        elif key == "c":
            self.copy_camera()
        elif key == "r":
            self.reset()
        elif key == "m":
            self.screen.has_panels = not self.screen.has_panels
            self.screen.resize((self.screen.layout.width, self.screen.layout.height))
        elif key == "h":
            self.shows_help = not self.shows_help

    def move_camera(self, seconds: float) -> None:
        """Let held keys and the mouse move the camera; a camera that stays put keeps its samples."""
        keys = {key for key in camera_controller.KEYS if self.window.is_pressed(key)}
        last, self.cursor = self.cursor, self.window.get_cursor_pos()
        orbit, zoom = (0.0, 0.0), 0.0
        if self.drags_picture:
            drag = self.screen.layout.as_drag(last, self.cursor)
            if self.window.is_pressed(ti.ui.LMB):
                orbit = drag
            elif self.window.is_pressed(ti.ui.RMB):
                zoom = drag[1]
        camera = self.renderer.camera
        if keys or zoom != 0 or orbit != (0, 0):
            up_axis = self.choices.scene.up_axis
            pose = camera_controller.step(Pose.of(camera), keys, seconds, orbit, zoom, self.speed, up_axis)
            camera.set_camera_parameters(**pose.parameters())

    def progress(self) -> str:
        """Seconds since the picture was begun, and its estimated error, measured twice a second."""
        now = time.perf_counter()
        if self.renderer.samples <= self.last_samples:  # begun anew since the last frame
            self.started, self.error = now, math.nan
            if self.curves_of != self.picture():
                self.curves, self.curves_of = {}, self.picture()
            self.curves[self.renderer.active.name] = []
        self.last_samples = self.renderer.samples
        if now - self.error_at > pace.ERROR_EVERY:
            self.error, self.error_at = self.renderer.error(), now
            name = self.renderer.active.name
            curve = self.curves.setdefault(name, [])
            curve.append((now - self.started, float(self.error)))
            curve[:] = pace.thinned(curve)
            self.screen.put_plot(draw_curves(self.curves, name, PANEL_WIDTH, PLOT_HEIGHT))
        error = "" if math.isnan(self.error) else f", error {two_digits(self.error)}"
        return f"Time: {now - self.started:.1f} s{error}"

    def picture(self) -> tuple:
        """What the curves of all estimators have in common: light, scene and camera, and nothing of the estimator."""
        scene, camera = self.choices.scene, position_of(self.renderer.camera)
        parts = scene.ray_intersector.triangle_test, scene.lamps.choice.name, self.choices.environment
        return (*parts, *bounce_words(self.renderer), *((name, repr(value)) for name, value in camera.items()))

    def tell(self, *texts: str) -> None:
        """Show texts in the panel."""
        self.message = [line for text in texts for line in wrap(text)]

    def save_picture(self) -> None:
        """Write the picture; say where, or why not, in the panel and on the terminal."""
        try:
            told = ("Saved", str(save(self.renderer, self.folder)))
            print(*told)
            print("The same again:", as_command(self.renderer, self.scene_options), flush=True)
        except (OSError, InputError) as error:
            told = ("Not saved:", str(error))
            print(*told, flush=True)
        self.tell(*told)

    def copy_camera(self) -> None:
        """Print the camera as options of the command line, and write them to the clipboard if there is one."""
        words = shlex.join(camera_words(self.renderer.camera))
        print("Camera:", words, flush=True)
        self.tell("Camera copied and printed" if clipboard.copy(words) else "Camera printed on the terminal")

    def reset(self) -> None:
        """The camera, the speed and the white of the beginning."""
        self.renderer.camera.set_camera_parameters(**self.first_camera)
        self.speed = self.usual_speed
        self.choices.set_white(self.choices.usual_white)

    # ── the panels ──

    def draw_panels(self, gui) -> None:
        """Both panels, as far as there is room, and the help over the picture while it is asked for.

        ``ti.ui`` places a panel only when its name is new: the name therefore contains the size of the window and the
        height of the panel, after two # signs, where they are not shown. It measures panels in fractions of the size
        that the window had at first.
        """
        layout, (width, height) = self.screen.layout, self.first_size
        size = f"##{layout.width}x{layout.height}"
        if layout.left > 0:
            place = 0.0, 0.0, layout.left / width, layout.height / height
            with gui.sub_window(f"Control Panel{size}", *place) as panel:
                self.draw_control_panel(panel)
        if layout.right > 0:
            counter = LineCounter()
            self.draw_settings(counter)
            self.screen.let_plot(layout.height - PLOT_HEIGHT >= counter.height)
            down = layout.height - PLOT_HEIGHT * self.screen.has_plot
            place = (layout.width - layout.right) / width, 0.0, layout.right / width, down / height
            with gui.sub_window(f"Settings{size}x{down}", *place) as panel:
                self.draw_settings(panel)
        if self.shows_help:
            x, y = layout.left + HELP_PLACE, HELP_PLACE
            across, down = min(HELP_WIDTH, layout.width - x), min(HELP_HEIGHT, layout.height - y)
            with gui.sub_window(f"Help{size}", x / width, y / height, across / width, down / height) as overlay:
                for line in HELP_KEYS:
                    overlay.text(line.format(**AXES[self.choices.scene.up_axis]))

    def draw_control_panel(self, panel) -> None:
        """What can be shown: a button per view, and per estimator."""
        for text in TEXTS:
            panel.text(text)
        folds = self.must_fold()
        for number, (renderer_class, offers) in enumerate(self.choices.offered):
            kind = renderer_class.what
            if kind in FOLDED and kind != self.kind_unfolded:
                continue
            if folds and kind != self.kind_unfolded:
                if panel.button(f"{kind.capitalize()}s ..."):
                    self.unfolded = kind
                continue
            if folds or number > 0:
                panel.text(f"-- {kind}s --")
            for integrator in offers:
                is_active = renderer_class is type(self.renderer) and integrator.name == self.renderer.active.name
                if panel.button((integrator.label or integrator.name) + (" [Active]" if is_active else "")):
                    self.choose(partial(self.choices.use, renderer_class, integrator.name))
        panel.text(f"Frame: {self.frame_seconds * 1e3:.1f} ms, {self.renderer.samples} spp")
        if self.renderer.needs_light:
            panel.text(self.progress())
        if panel.button("Save picture (p)"):
            self.save_picture()
        if panel.button("Help (h)"):
            self.shows_help = not self.shows_help
        for line in self.message:
            panel.text(line)

    @property
    def kind_unfolded(self) -> str:
        """The kind whose list is never folded: the one that was asked for, or of which something shows."""
        return self.unfolded or self.renderer.what

    def buttons_of_lists(self) -> list[int]:
        """How many buttons each list has that is shown if there is room."""
        offered = ((renderer_class.what, offers) for renderer_class, offers in self.choices.offered)
        return [len(offers) for kind, offers in offered if kind not in FOLDED or kind == self.kind_unfolded]

    def must_fold(self) -> bool:
        """Whether the window is too low for the buttons of all lists."""
        lists = self.buttons_of_lists()
        texts = len(TEXTS) + len(lists) + 2 + MESSAGE_LINES  # with the lines of time and error
        buttons = sum(lists) + 2
        return TITLE_HEIGHT + TEXT_HEIGHT * texts + BUTTON_HEIGHT * buttons > self.screen.layout.height

    def draw_settings(self, panel) -> None:
        """What changes the picture: light, triangle test, camera; and the speed of the keys."""
        choices, camera = self.choices, self.renderer.camera
        if panel.button(f"Environment: {Path(choices.environment).name}"):
            self.choose(choices.next_environment)
        if len(choices.triangle_tests) > 1 and panel.button(f"Triangles: {choices.triangle_test}"):
            self.choose(choices.next_triangle_test)
        if len(choices.lamp_choices) > 1 and panel.button(f"Choice of lamps: {choices.lamp_choice}"):
            self.choose(choices.next_lamp_choice)
        for kind in FOLDED:
            if panel.button(f"{kind.capitalize()}s ..."):
                self.unfolded = None if self.unfolded == kind else kind
        for control in self.renderer.controls():
            self.draw_control(panel, control)
        is_right = camera.handedness == "right"
        if panel.checkbox("Right-handed camera", is_right) != is_right:
            camera.set_camera_parameters(handedness="left" if is_right else "right")
        if not camera.has_window:
            angle = slide(panel, "fov", camera.fov, *ANGLES)
            if angle != camera.fov:
                camera.set_camera_parameters(fov=angle)
        panel.text(f"Speed of keys: {self.speed:.3g} units/s")
        self.speed = self.usual_speed * slide(panel, "x speed", self.speed / self.usual_speed, *FACTORS)
        if choices.white is not None and self.renderer.active.name == DISTANCE:
            panel.text(f"White: {choices.white:.4g} units away")
            factor = choices.white / choices.usual_white
            chosen = slide(panel, "x white", factor, *FACTORS)
            if chosen != factor:
                choices.set_white(chosen * choices.usual_white)
        if self.renderer.scale is not None:
            for line in wrap(f"White: {self.renderer.scale.high:.3g} {self.renderer.scale.text}"):
                panel.text(line)
        elif self.renderer.srgb:
            self.draw_display(panel)
        for name in ("eye", "at"):
            for line in wrap(f"{name:<3} " + " ".join(f"{x:.4g}" for x in getattr(camera, name))):
                panel.text(line)
        if panel.button("Copy camera (c)"):
            self.copy_camera()
        if panel.button("Reset camera (r)"):
            self.reset()

    def draw_control(self, panel, control: Control) -> None:
        """A value of the integrator: a slider or a button. The picture starts again if it changes."""
        value = control.value
        if isinstance(control, BouncesControl):
            value = draw_bounces(panel, control)
        elif isinstance(control, NameControl):
            if panel.button(f"{control.label}: {value}"):
                value = after(value, list(control.names))
        elif isinstance(control.low, int) and isinstance(control.high, int):
            value = panel.slider_int(control.label, value, control.low, control.high)
            value = min(max(value, control.low), control.high)  # a number that is typed may be outside
        else:
            value = slide(panel, control.label, value, control.low, control.high)
        if value != control.value:
            try:
                self.renderer.change(control.name, value)
            except InputError as error:
                self.tell(str(error))

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

    def choose(self, choice: Callable[[], None]) -> None:
        """Do something in the next frame: it may compile, and the panel has to say so before."""
        self.pending = choice
        self.tell(BUSY)


class LineCounter:
    """A panel that shows nothing, on which nothing is ever moved or pressed; it adds up the height of what is drawn."""

    def __init__(self) -> None:
        self.height = TITLE_HEIGHT

    def text(self, text: str) -> None:
        """A line of text."""
        self.height += TEXT_HEIGHT

    def button(self, label: str) -> bool:
        """A button."""
        self.height += BUTTON_HEIGHT
        return False

    def checkbox(self, label: str, value: bool) -> bool:
        """A checkbox."""
        self.height += BUTTON_HEIGHT
        return value

    def slider_int(self, label: str, value: int, low: int, high: int) -> int:
        """A slider of whole numbers."""
        self.height += BUTTON_HEIGHT
        return value

    def slider_float(self, label: str, value: float, low: float, high: float) -> float:
        """A slider; as that of ``ti.ui``, it returns f32."""
        self.height += BUTTON_HEIGHT
        return float(np.float32(value))


def draw_bounces(panel, control: BouncesControl) -> tuple[int, int | None] | None:
    """Which bounces count: all, or after a click those of one number, which a slider chooses."""
    value = control.value
    is_part = value is not None
    if panel.checkbox("Only light after k bounces", is_part) != is_part:
        return None if is_part else (min(1, control.most),) * 2
    if value is None:
        return None
    first, last = value
    if first != last:
        panel.text(f"Bounces that count: {name_of_bounces(value)}")
    chosen = min(first, control.most)
    if control.most > 0:
        chosen = min(max(panel.slider_int("k", chosen, 0, control.most), 0), control.most)
    return value if chosen == first else (chosen, chosen)


def slide(panel, label: str, value: float, low: float, high: float) -> float:
    """What a slider has been moved to; exactly ``value`` if it has not been moved."""
    shown = min(max(value, low), high)
    chosen = panel.slider_float(label, shown, low, high)
    return value if abs(chosen - shown) <= CHANGED * abs(shown) else min(max(float(chosen), low), high)


def wrap(text: str) -> list[str]:
    """``text`` in lines that fit into the panel; a path is broken where it must be."""
    fits = 32  # characters
    return [text[i : i + fits] for i in range(0, len(text), fits)]
