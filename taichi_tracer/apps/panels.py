"""The panels of the window: on the left what can be shown, on the right the settings, and the help over the picture."""

from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from taichi_tracer.apps.choices import Choices, after
from taichi_tracer.apps.same_again import DISTANCE
from taichi_tracer.integrators.controls import BouncesControl, Control, NameControl
from taichi_tracer.integrators.path_settings import name_of as name_of_bounces
from taichi_tracer.maps import MapRenderer
from taichi_tracer.progressive import ProgressiveRenderer
from taichi_tracer.system.errors import InputError
from taichi_tracer.system.registry import PARTS

HELP_WIDTH, HELP_HEIGHT = 316, 260  # pixels; they fit HELP_KEYS
ANGLES = 5.0, 150.0  # degrees, of the slider of the field of view
FACTORS = 0.1, 4.0  # of the sliders of the speed and of white: times what fits the scene
CHANGED = 1e-5  # relative: sliders return f32, so that a smaller change is only rounding
FOLDED = (MapRenderer.what,)  # lists that are not shown until somebody asks for them, by a button in the right panel
HELP_PLACE = 12  # pixels between the panel, or the top, and the help
MOST_EXPOSURE, EXPOSURE_STEP = 10.0, 0.125  # stops: the ends of the slider, and between two of its places
OTHER_LINES = 9  # of the panel beside texts and views: its title, frame, time, two buttons, and a message of four lines
TITLE_HEIGHT, TEXT_HEIGHT, BUTTON_HEIGHT = 31, 17, 23  # pixels in ti.ui: of a panel's title with its edges, of lines
MESSAGE_LINES = 4  # of the last message; more would push the buttons out of the window
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


class Panels:
    """What stands in the margins of the window.

    Args:
        viewer: the ``Viewer`` whose choices are shown, and whose methods the buttons call.

    Attributes:
        unfolded: the kind whose list is unfolded if not all have room; None is the kind of what shows.
        shows_help: whether the help lies over the picture.
    """

    def __init__(self, viewer: Any) -> None:
        self.viewer = viewer
        self.unfolded: str | None = None
        self.shows_help = False

    @property
    def choices(self) -> Choices:
        """What can be shown, and what shows."""
        return self.viewer.choices

    @property
    def renderer(self) -> ProgressiveRenderer:
        """The renderer that shows."""
        return self.viewer.choices.renderer

    @property
    def lines(self) -> int:
        """How many lines the longer panel has."""
        lists = self.buttons_of_lists()
        return sum(lists) + len(lists) + len(TEXTS) + OTHER_LINES

    def draw(self, gui) -> None:
        """Both panels, as far as there is room, and the help over the picture while it is asked for.

        ``ti.ui`` places a panel only when its name is new: the name therefore contains the size of the window and the
        height of the panel, after two # signs, where they are not shown. It measures panels in fractions of the size
        that the window had at first.
        """
        layout, (width, height) = self.viewer.screen.layout, self.viewer.first_size
        size = f"##{layout.width}x{layout.height}"
        if layout.left > 0:
            place = 0.0, 0.0, layout.left / width, layout.height / height
            with gui.sub_window(f"Control Panel{size}", *place) as panel:
                self.draw_control_panel(panel)
        if layout.right > 0:
            place = (layout.width - layout.right) / width, 0.0, layout.right / width, layout.height / height
            with gui.sub_window(f"Settings{size}", *place) as panel:
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
                    self.viewer.choose(partial(self.choices.use, renderer_class, integrator.name))
        panel.text(f"Frame: {self.viewer.frame_seconds * 1e3:.1f} ms, {self.renderer.samples} spp")
        if self.renderer.needs_light:
            panel.text(self.viewer.progress())
        if panel.button("Save picture (p)"):
            self.viewer.save_picture()
        if panel.button("Help (h)"):
            self.shows_help = not self.shows_help
        for line in self.viewer.message:
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
        return TITLE_HEIGHT + TEXT_HEIGHT * texts + BUTTON_HEIGHT * buttons > self.viewer.screen.layout.height

    def draw_settings(self, panel) -> None:
        """What changes the picture: light, triangle test, camera; and the speed of the keys."""
        choices, camera = self.choices, self.renderer.camera
        if panel.button(f"Environment: {Path(choices.environment).name}"):
            self.viewer.choose(choices.next_environment)
        if len(choices.triangle_tests) > 1 and panel.button(f"Triangles: {choices.triangle_test}"):
            self.viewer.choose(choices.next_triangle_test)
        if panel.button(f"Ground: {choices.ground}"):
            self.viewer.choose(choices.next_ground)
        if len(choices.lamp_choices) > 1 and panel.button(f"Choice of lamps: {choices.lamp_choice}"):
            self.viewer.choose(choices.next_lamp_choice)
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
        panel.text(f"Speed of keys: {self.viewer.speed:.3g} units/s")
        usual = self.viewer.usual_speed
        self.viewer.speed = usual * slide(panel, "x speed", self.viewer.speed / usual, *FACTORS)
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
            self.viewer.copy_camera()
        if panel.button("Reset camera (r)"):
            self.viewer.reset()

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
                self.viewer.tell(str(error))

    def draw_display(self, panel) -> None:
        """The slider of the exposure, and the buttons that fit it and take the next tone curve; the samples stay."""
        display = self.renderer.display
        exposure = panel.slider_float("exposure", float(display.exposure), -MOST_EXPOSURE, MOST_EXPOSURE)
        if panel.button("Expose to fit"):
            self.renderer.expose()
            return
        tones = PARTS.all("tone curve")
        tone = display.part
        if panel.button(f"Tone curve: {tone.label or tone.name}"):
            tone = tones[(tones.index(tone) + 1) % len(tones)] if tone in tones else tones[0]
        if exposure != float(np.float32(display.exposure)):  # the slider has f32
            self.renderer.set_display(exposure=round(exposure / EXPOSURE_STEP) * EXPOSURE_STEP)
        if tone is not display.part:
            self.renderer.set_display(tone=tone)


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
