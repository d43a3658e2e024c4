"""The interactive window (A1-16): the picture between two panels. The only file that uses ``ti.ui``.

The panels stand in margins of their own and so hide nothing of the scene: on the left what is shown, the six views, the
estimators of light and the paths; on the right the settings, as far as they have an effect on the picture. ``ti.ui``
tells a program neither of the mouse wheel nor of F1: zooming is a drag with the right button, or the keys i and o; help
is the key h, or a button.
"""

import contextlib
import math
import os
import shlex
import sys
import tempfile
import time
from argparse import Namespace
from collections.abc import Callable, Iterable, Iterator, Sequence
from pathlib import Path

import taichi as ti

from taichi_tracer import camera_controller
from taichi_tracer.apps import pace
from taichi_tracer.apps.choices import Choices
from taichi_tracer.apps.display import can_open_window, screen_size
from taichi_tracer.apps.panels import Panels, wrap
from taichi_tracer.apps.preview import Preview, current
from taichi_tracer.apps.requests import scene_and_pictures_of
from taichi_tracer.apps.same_again import as_command, camera_words, name_of_light, position_of
from taichi_tracer.apps.screen import Screen, first_size
from taichi_tracer.apps.server import serve
from taichi_tracer.apps.session import Session
from taichi_tracer.apps.words import PICTURE_FOLDER, let_every_character_print
from taichi_tracer.camera_controller import Pose
from taichi_tracer.files.images import check_writable
from taichi_tracer.integrators.base import Integrator
from taichi_tracer.picture.progress import two_digits
from taichi_tracer.progressive import ProgressiveRenderer
from taichi_tracer.system.errors import InputError

TITLE = "Interactive Renderer"
FRAMES_PER_SECOND = 120  # no faster, to leave the machine to others
SMOOTHING = 0.1  # the share of the newest frame in the time that is shown, so that it can be read
BUSY = "One moment: compiling ..."
OFFLINE_SPP = 16  # of a picture that is noisy, where there is no window to watch it grow


def run(args: Namespace) -> int:
    """``taichi-tracer view``: the window of the renderer that offers the view asked for."""
    scene, (picture, *_) = scene_and_pictures_of(args)
    (renderer_class, integrator), *_ = picture.views
    renderer = picture.make_renderer(renderer_class, scene.load()).use(integrator.name)
    if args.browser:
        return serve(Session(renderer, scene.words()), forwarded=args.forwarded)
    asks_browser, all_views = sys.stdout.isatty(), not picture.names_view
    return show(renderer, scene_options=scene.words(), offers_browser=asks_browser, all_views=all_views)


def show(
    renderer: ProgressiveRenderer,
    folder: str | Path = PICTURE_FOLDER,
    scene_options: Sequence[str] = (),
    offers_browser: bool = False,
    all_views: bool = True,
) -> int:
    """Open the window, until it is closed; where none can open, write pictures into ``folder`` instead.

    Args:
        scene_options: words of the command line that make the scene, to be repeated in the command that makes a saved
            picture again.
        offers_browser: whether the picture is served to a browser where no window can open.
        all_views: whether everything that the renderer offers is written there, and not only what it shows.

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
    shown = asked_for(renderer) if all_views else (renderer.active,)
    paths = write_all(renderer, Path(folder), shown)
    print(f"What {type(renderer).__name__} shows is in {paths[0].parent.resolve()}:")
    for path in paths:
        print(f"  {path}")
    print(f"For a window: {verdict.remedy}")
    return 0


def asked_for(renderer: ProgressiveRenderer) -> Sequence[Integrator]:
    """What a renderer offers; of a ``shade_ray`` of somebody's own, what its assignment asks for."""
    asked = [one for one in renderer.offers if one.name in renderer.asked]
    return asked if asked and "shade_ray" in renderer.replaced else renderer.offers


def write_all(renderer: ProgressiveRenderer, folder: Path, shown: Iterable[Integrator]) -> list[Path]:
    """One picture for each integrator that is to be shown; returns their paths."""
    spp = OFFLINE_SPP if renderer.srgb else 1
    return [save(renderer.use(integrator.name).render(spp), folder) for integrator in shown]


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
    """The window's loop: read keys and mouse, move the camera, render one sample, show it between the panels."""

    def __init__(self, renderer: ProgressiveRenderer, folder: Path, scene_options: Sequence[str] = ()) -> None:
        self.choices, self.folder, self.scene_options = Choices(renderer), folder, tuple(scene_options)
        self.panels = Panels(self)
        picture = renderer.width, renderer.height
        self.first_size = first_size(picture, self.panels.lines, screen_size())
        self.screen = Screen(self.first_size, picture)
        self.message: list[str] = []
        self.pending: Callable[[], None] | None = None  # what was chosen, and takes time, in the frame that shows BUSY
        self.frame_seconds = 0.0
        self.started, self.error, self.error_at, self.last_samples = 0.0, math.nan, 0.0, math.inf
        self.preview, self.moves = Preview(), False
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
        self.tapped: set[str] = set()  # what was pressed since the last frame, and may be released again
        with tempfile.TemporaryDirectory() as folder:
            self.loop(folder)
            with within(folder):
                self.window.destroy()

    def loop(self, folder: str) -> None:
        """One frame after the other.

        Args:
            folder: where ``ti.ui`` may write its own file, imgui.ini.
        """
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
            self.panels.draw(self.window.get_gui())
            with within(folder):
                self.window.show()
            if chosen is not None:
                self.take_choice()
                last = time.perf_counter()  # compiling is not time in which a held key moves the camera

    def warm_up(self) -> None:
        """Compile before the window opens what a moving camera needs; otherwise it would freeze at the first key."""
        pace.warm_up(self.renderer, self.draw)
        self.frame_seconds = 0.0

    def take_size(self) -> None:
        """Arrange the screen anew if the window was resized."""
        size = self.window.get_window_shape()
        if size != (self.screen.layout.width, self.screen.layout.height) and min(size) > 0:
            self.screen.resize(size)

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
        """Render a sample and bring it to the screen; measures the time, smoothed so that it can be read.

        While the camera moves, the sample may be of a coarse picture.
        """
        start = time.perf_counter()
        shown = self.preview.of(self.renderer) if self.moves else self.renderer
        self.screen.update(shown.render())
        ti.sync()
        seconds = time.perf_counter() - start
        if self.moves:
            self.preview.took(self.renderer, seconds)
        self.frame_seconds += (seconds - self.frame_seconds) * (SMOOTHING if self.frame_seconds > 0 else 1.0)

    def read_events(self) -> None:
        """What was pressed once since the last frame.

        ``ti.ui`` does not tell where the mouse was when it was pressed. It is taken to have been where it was in the
        last frame, if that is in the picture: in a slow frame, a whole drag may lie between the two.
        """
        self.tapped = set()
        for event in self.window.get_events(ti.ui.PRESS):
            self.tapped.add(event.key)
            if event.key == ti.ui.ESCAPE:
                self.window.running = False
            elif event.key in (ti.ui.LMB, ti.ui.RMB):
                cursor, layout = self.window.get_cursor_pos(), self.screen.layout
                self.drags_picture = layout.holds(cursor) and not self.panels.shows_help
                self.cursor = self.cursor if layout.holds(self.cursor) else cursor
            else:
                self.press(event.key)

    def is_pressed(self, key: str) -> bool:
        """Whether a key or a button is held, or was pressed since the last frame."""
        return key in self.tapped or self.window.is_pressed(key)

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
            self.panels.shows_help = not self.panels.shows_help

    def move_camera(self, seconds: float) -> None:
        """Let held keys and the mouse move the camera; a camera that stays put keeps its samples."""
        keys = {key for key in camera_controller.KEYS if self.is_pressed(key)}
        last, self.cursor = self.cursor, self.window.get_cursor_pos()
        orbit, zoom = (0.0, 0.0), 0.0
        if self.drags_picture:
            drag = self.screen.layout.as_drag(last, self.cursor)
            if self.is_pressed(ti.ui.LMB):
                orbit = drag
            elif self.is_pressed(ti.ui.RMB):
                zoom = drag[1]
        camera = self.renderer.camera
        self.moves = bool(keys) or zoom != 0 or orbit != (0, 0)
        if self.moves:
            up_axis = self.choices.scene.up_axis
            pose = camera_controller.step(Pose.of(camera), keys, seconds, orbit, zoom, self.speed, up_axis)
            camera.set_camera_parameters(**pose.parameters())

    def progress(self) -> str:
        """Seconds since the picture was begun, and its estimated error, measured twice a second."""
        now = time.perf_counter()
        if self.renderer.samples <= self.last_samples:  # begun anew since the last frame
            self.started, self.error = now, math.nan
        self.last_samples = self.renderer.samples
        if now - self.error_at > pace.ERROR_EVERY and not self.moves:
            self.error, self.error_at = self.renderer.error(), now
        error = "" if math.isnan(self.error) else f", error {two_digits(self.error)}"
        return f"Time: {now - self.started:.1f} s{error}"

    def tell(self, *texts: str) -> None:
        """Show texts in the panel."""
        self.message = [line for text in texts for line in wrap(text)]

    def save_picture(self) -> None:
        """Write the picture; say where, or why not, in the panel and on the terminal."""
        try:
            told = ("Saved", str(save(current(self.renderer), self.folder)))
            print(*told)
            print("The same again:", as_command(self.renderer, self.scene_options), flush=True)
        except (OSError, InputError) as error:
            told = ("Not saved:", str(error))
            print(*told, flush=True)
        self.tell(*told)

    def copy_camera(self) -> None:
        """Print the camera as options of the command line."""
        words = shlex.join(camera_words(self.renderer.camera))
        print("Camera:", words, flush=True)
        self.tell("Camera printed on the terminal")

    def reset(self) -> None:
        """The camera, the speed and the white of the beginning."""
        self.renderer.camera.set_camera_parameters(**self.first_camera)
        self.speed = self.usual_speed
        self.choices.set_white(self.choices.usual_white)

    def choose(self, choice: Callable[[], None]) -> None:
        """Do something in the next frame: it may compile, and the panel has to say so before."""
        self.pending = choice
        self.tell(BUSY)


@contextlib.contextmanager
def within(folder: str) -> Iterator[None]:
    """The working directory is another one for a moment."""
    former = os.getcwd()
    os.chdir(folder)
    try:
        yield
    finally:
        os.chdir(former)
