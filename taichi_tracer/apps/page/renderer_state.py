"""What one window or page shows: settings, and the scene and the renderer that they make.

A change is ``state.show(replace(state.settings, environment="sunny"))``; the settings of before take it back. While the
camera moves, a picture of a half or a quarter of the width and height is shown where the whole one is too slow. Two
pictures of one camera can be compared: side by side, or as their difference.
"""

import copy
from argparse import ArgumentTypeError
from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from taichi_tracer.apps.pictures import OF_LIGHT, environment_name, renderers, settings_of
from taichi_tracer.environment import Environment, load_environment
from taichi_tracer.explain.maps import MapRenderer
from taichi_tracer.files.disk import shipped_environments
from taichi_tracer.integrators.base import Integrator
from taichi_tracer.progressive import ProgressiveRenderer
from taichi_tracer.renderer import A1Renderer, A3Renderer, A4Renderer
from taichi_tracer.scene_data import SceneData, again
from taichi_tracer.settings import DEFAULTS, NO_NAME, OPTIONS, USUAL_LIGHT, RenderSettings
from taichi_tracer.system.errors import InputError, one_of
from taichi_tracer.system.parts import PARTS
from taichi_tracer.tones.heat import Scale, heat, round_up

# Settings that can be changed while a picture is shown, beside the values of its integrator.
OF_SCENE = ("triangle_test", "lamp_choice", "ground")  # another one makes another scene
LIVE = ("view", "environment", *OF_SCENE, "exposure", "tone", "fov", "max_distance")


class RendererState:
    """The renderers of one window, and which of them shows. All have one camera.

    A renderer is made when something that it offers is shown for the first time. The renderer that is given, and its
    scene, stay as they are, except for the environment; another triangle test or lamp choice makes another scene.

    Args:
        base: the settings that the program was started with.

    Attributes:
        renderer: the one that shows.
        environments: the names of the environments that can be chosen.
    """

    def __init__(self, renderer: ProgressiveRenderer, base: RenderSettings | None = None) -> None:
        self.renderer, self.base = renderer, base or RenderSettings()
        scene, environment = renderer.scene_data, renderer.scene_data.environment
        shown = A1Renderer.what, A3Renderer.what, A4Renderer.what, MapRenderer.what, renderer.what
        # In one order, whichever renderer is given.
        self._classes = {c.what: c for c in renderers() if c.what in shown} | {renderer.what: type(renderer)}
        self._scenes = {key_of(scene): scene}
        self._made = {(*key_of(scene), type(renderer)): renderer}
        self._last = {type(renderer): renderer}  # the renderer of each class that was shown last
        self._environments = {} if environment is None else {environment.name: environment}
        shipped = [*shipped_environments(), *PARTS.names("environment")]
        self.environments = list(dict.fromkeys([*self._environments, *shipped, NO_NAME]))
        self._light_options = {} if environment is None else {name: getattr(environment, name) for name in OF_LIGHT}
        self._has_chosen_light = environment is not None
        fix_white(renderer)

    @property
    def scene(self) -> SceneData:
        """The scene that is shown."""
        return self.renderer.scene_data

    @property
    def settings(self) -> RenderSettings:
        """The settings of the picture that shows."""
        return settings_of(self.renderer, self.base)

    @property
    def offered(self) -> list[tuple[type[ProgressiveRenderer], list[Integrator]]]:
        """What each renderer offers: views, estimators, paths and maps, and what the given one alone offers."""
        known = {type(one): one for one in self._made.values() if one.scene_data is self.scene}
        return [(c, list(known[c].offers if c in known else c.offered())) for c in self._classes.values()]

    # ── changes ──

    def change(self, name: str, value: Any) -> None:
        """Change one setting, or a value of the integrator, to what a page or a window says.

        Raises:
            InputError: there is no such setting, or the value is not what it must be.
        """
        values = [one.name for one in self.renderer.controls()]
        if name in LIVE or (name in values and name in OPTIONS):
            self.show(replace(self.settings, **{name: read(name, value)}))
        elif name in values:
            self.renderer.change(name, value)
        else:
            raise one_of("setting", name, [*LIVE, *values])

    def show(self, settings: RenderSettings) -> None:
        """Show what settings ask for. For the first picture of light, a scene without light gets one.

        Raises:
            InputError: a name is unknown, or a value is out of its range.
        """
        former = self.settings
        settings = self.checked(settings)
        renderer_class, _ = self.find(settings.view)
        scene = self._scene_for(settings)
        environment = self._environment(settings.environment or NO_NAME)
        if environment is not scene.environment:
            scene.set_environment(environment)
            self._has_chosen_light = True
        if scene is not self.scene or settings.view != former.view:
            renderer, display = self._renderer(renderer_class, scene).use(settings.view), self.renderer.display
            if not (self.renderer.has_own_display or renderer.has_own_display):
                renderer.set_display(display.exposure, display.tone)
            self.renderer = self._last[renderer_class] = renderer
        for name, option in OPTIONS.items():
            value = getattr(settings, name)
            if option.value in self.renderer.values() and value != getattr(former, name):
                usual = option.usual if value in (None, ()) else value
                self.renderer.change(option.value, usual[0] if name == "bounces" and usual else usual)
        if (settings.exposure, settings.tone) != (former.exposure, former.tone):
            self.renderer.set_display(settings.exposure, settings.tone)
        if settings.fov != former.fov and settings.fov is not None:
            self.renderer.camera.set_camera_parameters(fov=settings.fov)

    def checked(self, settings: RenderSettings) -> RenderSettings:
        """The settings, with light where something is to be shown that needs it, and nobody has chosen any.

        Raises:
            InputError: a name is unknown; no name of a file is known.
        """
        _, chosen = self.find(settings.view)
        if settings.environment not in (None, *self.environments):
            raise one_of("environment", settings.environment, self.environments)
        for kind, name in (("triangle test", settings.triangle_test), ("lamp choice", settings.lamp_choice)):
            if name is not None:
                PARTS.find(kind, name)
        needs = chosen.needs_light and not self.scene.effects.is_lit and not self._has_chosen_light
        return replace(settings, environment=USUAL_LIGHT) if needs else settings

    def find(self, name: str | None) -> tuple[type[ProgressiveRenderer], Integrator]:
        """The renderer class that offers something of this name, that of the present renderer first."""
        offered = [*reversed(self.offered), (type(self.renderer), self.renderer.offers)]  # the later ones count
        known = {one.name: (cls, one) for cls, offers in offered for one in offers}
        if name not in known:
            raise one_of("view or estimator", name, known)
        return known[name]

    def _scene_for(self, settings: RenderSettings) -> SceneData:
        """The scene with the triangle test, the lamp choice and the ground that settings ask for."""
        test, choice, _ = key_of(self.scene)
        usual = "watertight" if test in PARTS.names("triangle test") else test  # one that is no part stays
        wanted = settings.triangle_test or usual, settings.lamp_choice or choice, settings.ground
        if wanted not in self._scenes:
            self._scenes[wanted] = again(self.scene, **dict(zip(OF_SCENE, wanted, strict=True)))
        return self._scenes[wanted]

    def _environment(self, name: str) -> Environment | None:
        """The light from far away of a name; it has intensity, rotation and look-up of the scene's own."""
        if name != NO_NAME and name not in self._environments:
            self._environments[name] = load_environment(name, **self._light_options)
        return self._environments.get(name)

    def _renderer(self, renderer_class: type[ProgressiveRenderer], scene: SceneData) -> ProgressiveRenderer:
        """The renderer of this class for a scene; it is made if there is none, like the one that shows."""
        key = *key_of(scene), renderer_class
        if key not in self._made:
            self._made[key] = fix_white(made_like(self.renderer, renderer_class, scene))
        copy_values(self._last.get(renderer_class, self._made[key]), self._made[key])
        return self._made[key]

    def beside(self) -> "RendererState":
        """Another state for the same camera, which begins as this one, with a scene and so with light of its own."""
        return RendererState(copy_of(self.renderer, again(self.scene)), self.base)

    def resize(self, width: int, height: int) -> None:
        """Give the picture another number of pixels."""
        self.renderer = copy_of(self.renderer, self.scene, width, height)
        self._made = {(*key_of(self.scene), type(self.renderer)): self.renderer}
        self._last = {type(self.renderer): self.renderer}

    def destroy(self) -> None:
        """Free the memory of all scenes; nothing of them can be shown any more."""
        for scene in self._scenes.values():
            scene.destroy()

    # ── what can be changed ──

    def controls(self) -> list[dict[str, Any]]:
        """What can be changed now, for a page: section, name, label, help, and the values that it may have."""
        renderer, scene = self.renderer, self.scene
        test, choice, ground = key_of(scene)
        found = [
            described("light", "environment", environment_name(scene), names=self.environments),
            described("scene", "triangle_test", test, names=PARTS.names("triangle test")),
            described("scene", "ground", ground),
        ]
        if scene.lamps.count > 1 and renderer.needs_light and renderer.active.samples_lights:
            found.append(described("light", "lamp_choice", choice, names=PARTS.names("lamp choice")))
        if renderer.srgb:
            found.append(described("display", "tone", renderer.display.part.name, names=PARTS.names("tone curve")))
        if renderer.srgb and not renderer.has_own_display:
            exposure = float(renderer.display.exposure)
            found.append(described("display", "exposure", exposure, low=-10, high=10, step=0.125))
        if not renderer.camera.has_window:
            found.append(described("camera", "fov", float(renderer.camera.fov), low=5, high=150, step=0.5))
        if renderer.active.name == "distance" and (white := renderer.values().get("max_distance")) is not None:
            found.append(described("display", "max_distance", white, low=white / 10, high=white * 4, step=white / 50))
        for one in renderer.controls():
            if one.names:
                found.append(described("estimator", one.name, one.value, names=list(one.names)))
            else:
                step = 1 if isinstance(one.low, int) and isinstance(one.high, int) else (one.high - one.low) / 200
                found.append(described("estimator", one.name, one.value, low=one.low, high=one.high, step=step))
        return [one for one in found if "names" not in one or (len(one["names"]) > 1 and one["value"] in one["names"])]


def read(name: str, value: Any) -> Any:
    """The value of a setting, checked as a word of the command line is.

    Raises:
        InputError: it is not what the setting must be.
    """
    if isinstance(DEFAULTS[name], bool):
        return bool(value)
    try:
        return () if (name, value) == ("bounces", "all") else OPTIONS[name].read(str(value))
    except ArgumentTypeError as error:
        raise InputError(f"{name}: {error}") from None


def described(section: str, name: str, value: Any, **ends: Any) -> dict[str, Any]:
    """What a page says of a setting: one of ``names``; a number from ``low`` to ``high`` in steps; or yes or no."""
    option = next((one for one, known in OPTIONS.items() if name in (one, known.value)), name)
    help = OPTIONS[option].help.replace("%%", "%") if option in OPTIONS else ""
    return {"section": section, "name": name, "label": option.replace("_", " "), "help": help, "value": value, **ends}


def key_of(scene: SceneData) -> tuple[str, str, bool]:
    """What a ``RendererState`` can change of a scene, in the order of ``OF_SCENE``."""
    return scene.ray_intersector.triangle_test, scene.lamps.choice.name, scene.ground


def made_like(
    like: ProgressiveRenderer, renderer_class: type[ProgressiveRenderer], scene: SceneData, camera: Any = None
) -> ProgressiveRenderer:
    """A renderer of a class for a scene, with the camera and the samples of another one."""
    return renderer_class(
        scene_data=scene,
        camera=camera or like.camera,
        crop=like.film.crop if camera is None else None,
        sampler=like.sampler,
        seed=like.seed,
        first_sample=like.first_sample,
        jitter=(like.jitter and not like.jitters) or None,
        adaptive=like.adaptive and renderer_class.jitters,
    )


def view_of(renderer: ProgressiveRenderer) -> dict[str, Any]:
    """Where a renderer's camera is and what it sees, as a camera takes it."""
    return {name: value for name, value in vars(renderer.camera.view).items() if value is not None}


def copy_of(renderer: ProgressiveRenderer, scene: SceneData, *size: int) -> ProgressiveRenderer:
    """Another renderer that shows the same of a scene, by the same camera or by one with a size of its own."""
    camera = type(renderer.camera)(*size, **view_of(renderer)) if size else None
    copied = made_like(renderer, type(renderer), scene, camera)
    copy_values(renderer, copied)
    return copied.use(copy.copy(renderer.active)).set_display(renderer.display.exposure, renderer.display.tone)


def fix_white(renderer: ProgressiveRenderer) -> ProgressiveRenderer:
    """Keep what the view of the distance shows white, so that greys stay the same while the camera moves."""
    if "max_distance" in renderer.values():
        renderer.change("max_distance", renderer.values()["max_distance"])
    return renderer


def copy_values(former: ProgressiveRenderer, renderer: ProgressiveRenderer) -> None:
    """Give a renderer the values of a former one that it has, too."""
    known = renderer.values()
    for name, value in former.values().items():
        if name in known and value != known[name]:
            renderer.change(name, value)


# ── while the camera moves ──


WANTED = {False: 1 / 42, True: 1 / 25}  # seconds of a frame at most: of a view, and of random samples
COARSEST = 4  # pixels of the whole picture that one of the coarse picture stands for, along each side
ROOM = 1.5  # how much faster a finer picture must be than what is wanted, before it is tried
SMALLEST = 64  # pixels of a side: no coarse picture is smaller


class Preview:
    """What is rendered of a renderer's picture while the camera moves. It learns from how long frames take.

    Attributes:
        step: so many pixels of the whole picture, along each side, are one of what is rendered.
    """

    def __init__(self) -> None:
        self.step = 1
        self._made: dict[tuple, ProgressiveRenderer] = {}
        self._is_new = False  # whether the next frame compiles something

    def of(self, renderer: ProgressiveRenderer) -> ProgressiveRenderer:
        """The renderer whose picture is to be shown now: the given one, or a coarse one that shows the same."""
        self._is_new = False
        if self.step == 1 or not may_be_coarse(renderer):
            return renderer
        key = renderer, renderer.active.name, self.step
        if key not in self._made:
            size = renderer.width // self.step, renderer.height // self.step
            self._made[key] = copy_of(renderer, renderer.scene_data, *size)
            self._is_new = True
        coarse = self._made[key]
        coarse.camera.set_camera_parameters(**view_of(renderer))
        copy_values(renderer, coarse)
        return coarse.set_display(renderer.display.exposure, renderer.display.tone)

    def took(self, renderer: ProgressiveRenderer, seconds: float) -> None:
        """Note how long the last frame of a moving camera took, to render and to be made into bytes."""
        wanted = WANTED[renderer.is_random]
        if self._is_new:
            return
        if seconds > wanted:
            self.step = min(2 * self.step, COARSEST)
        elif 4 * ROOM * seconds < wanted:
            self.step = max(1, self.step // 2)


def may_be_coarse(renderer: ProgressiveRenderer) -> bool:
    """Whether a coarse picture can be made: with a camera of the package, of a whole picture that is large enough."""
    is_whole = renderer.film.crop == (0, renderer.width, 0, renderer.height)
    is_own = not type(renderer.camera).__module__.startswith("taichi_tracer.")
    is_large = min(renderer.width, renderer.height) >= COARSEST * SMALLEST
    return is_large and is_whole and not is_own and not renderer.has_own_display


def current(renderer: ProgressiveRenderer) -> ProgressiveRenderer:
    """A renderer that has a picture of what its camera sees now, which may be one sample."""
    return renderer if renderer.is_current() and renderer.film.samples > 0 else renderer.render()


# ── two pictures ──


BRIGHTEST = 99.0  # percent of the pixels that the scale of the difference covers: a few are far off in noisy pictures


def difference_of(left: ProgressiveRenderer, right: ProgressiveRenderer) -> tuple[np.ndarray, Scale]:
    """(h, w, 3) bytes that show as colours how far two pictures differ, and what the colours mean."""
    values = np.abs(left.image().astype(np.float64) - right.image()).mean(axis=2)
    largest = round_up(float(np.percentile(values, BRIGHTEST)) or float(values.max()))
    text = f"difference of left and right, mean of red, green and blue; its mean is {values.mean():.3g}"
    return np.floor(255 * heat(values, largest) + 0.5).astype(np.uint8), Scale(largest, text)


# ── under the pointer ──


DIGITS = 4
MOST_VALUES = 4096  # pixels whose numbers are shown at once


def numbers_of(values: np.ndarray) -> str:
    """Numbers in words: "0.52, 0.41, 0.3"; one number where all are the same."""
    texts = [f"{value:.{DIGITS}g}" for value in values]
    return texts[0] if len(set(texts)) == 1 else ", ".join(texts)


def look_at(column: int, row: int, renderers: Sequence[ProgressiveRenderer]) -> dict[str, Any]:
    """A pixel, its linear numbers in each picture that is shown, and what it sees, for a page.

    Args:
        column, row: of the pixel; the top left one is (0, 0). They are brought into the picture.
    """
    first = renderers[0]
    column, row = min(column, first.width - 1), min(row, first.height - 1)
    values = [numbers_of(one.image()[row, column]) for one in renderers]
    hit = first.scene_data.intersect(*first.camera.rays(column, first.height - 1 - row))[0]
    place = place_of(hit, first.scene_data) if hit.is_hit else "nothing"
    return {"column": column, "row": row, "values": values, "place": place}


def place_of(hit: Any, scene: Any) -> str:
    """A hit in words: its position, its distance, the name of its material and the number of its primitive."""
    material = scene.mesh.materials[hit.material_id].name
    position = ", ".join(f"{x:.{DIGITS}g}" for x in hit.position)
    return f"({position}), {hit.distance:.{DIGITS}g} away: {material}, primitive {hit.triangle_id}"


def linear_values(renderer: ProgressiveRenderer, column: int, row: int, columns: int, rows: int) -> dict[str, Any]:
    """The numbers of a region of pixels, row by row: red, green and blue, with three digits; none of too many."""
    part = renderer.image()[row : row + rows, column : column + columns]
    few = part.reshape(-1).tolist() if part.size <= 3 * MOST_VALUES else []
    values = [float(f"{value:.3g}") if np.isfinite(value) else None for value in few]
    return {"column": column, "row": row, "columns": part.shape[1], "values": values}
