"""What one window can show: the renderers over one scene and one camera, its light, triangle test and lamp choice."""

import copy
from typing import Any

from taichi_tracer.apps.names import renderers
from taichi_tracer.apps.pictures import OF_LIGHT
from taichi_tracer.environment import load_environment
from taichi_tracer.files.shipped import shipped_environments
from taichi_tracer.integrators.base import Integrator
from taichi_tracer.maps import MapRenderer
from taichi_tracer.progressive import ProgressiveRenderer
from taichi_tracer.renderer import A1Renderer, A3Renderer, A4Renderer
from taichi_tracer.scene_data import SceneData, again
from taichi_tracer.settings import NO_NAME as NO_LIGHT
from taichi_tracer.settings import USUAL_LIGHT
from taichi_tracer.system.registry import PARTS


class Choices:
    """The renderers of one window, and which of them shows. All have one camera.

    A renderer is made when something that it offers is chosen for the first time. The renderer that is given, and its
    scene, stay as they are, except for the environment; another triangle test or lamp choice makes another scene.

    Attributes:
        renderer: the one that shows.
        environments: the names of the environments that can be chosen.
        white: the ``max_distance`` of the view of the distance; None until this view can be shown. It does not follow
            the camera, so that the greys of a picture stay the same while the camera moves. usual_white: the first one.
    """

    def __init__(self, renderer: ProgressiveRenderer) -> None:
        self.renderer = renderer
        scene, environment = renderer.scene_data, renderer.scene_data.environment
        of_courses = A1Renderer.what, A3Renderer.what, A4Renderer.what, MapRenderer.what
        self._classes = {c.what: c for c in renderers() if c.what in of_courses}
        # In one order, whichever renderer is given; what it alone offers comes first.
        first = {} if type(renderer).what in self._classes else {type(renderer).what: type(renderer)}
        self._classes = {**first, **self._classes, type(renderer).what: type(renderer)}
        self._scenes = {key_of(scene): scene}
        self._made = {(*key_of(scene), type(renderer)): renderer}
        self._last = {type(renderer): renderer}  # the renderer of each class that was shown last
        self._environments = {} if environment is None else {environment.name: environment}
        # That of the scene, those of the package, and none: the order in which they come one after another.
        shipped = [*shipped_environments(), *PARTS.names("environment")]
        self.environments = list(dict.fromkeys([*self._environments, *shipped, NO_LIGHT]))
        self._light_options = {} if environment is None else {name: getattr(environment, name) for name in OF_LIGHT}
        self._has_chosen_light = environment is not None
        self.white: float | None = None
        self.usual_white: float | None = None
        self._take_white()

    @property
    def scene(self):
        """The scene that is shown."""
        return self.renderer.scene_data

    @property
    def offered(self) -> list[tuple[type[ProgressiveRenderer], list[Integrator]]]:
        """What each renderer offers: views, estimators, paths and maps; what the given one alone offers comes first."""
        known = {type(one): one for one in self._made.values() if one.scene_data is self.scene}
        return [(c, list(known[c].offers if c in known else c.offered())) for c in self._classes.values()]

    def use(self, renderer_class: type[ProgressiveRenderer], name: str) -> None:
        """Show something that a renderer offers. For the first picture of light, a scene without light gets one."""
        needs_light = any(one.needs_light for one in renderer_class.offered() if one.name == name)
        if needs_light and self.scene.effects.is_dark and not self._has_chosen_light:
            self.set_environment(USUAL_LIGHT)
        self._show(self._renderer(renderer_class, self.scene).use(name))

    def _show(self, renderer: ProgressiveRenderer) -> None:
        """Show a renderer, with the exposure and the tone curve of the one before."""
        if not (self.renderer.has_own_display or renderer.has_own_display):
            display = self.renderer.display
            renderer.set_display(display.exposure, display.tone)
        self.renderer = renderer
        self._last[type(renderer)] = renderer
        self._take_white()

    def _renderer(self, renderer_class: type[ProgressiveRenderer], scene: SceneData) -> ProgressiveRenderer:
        """The renderer of this class for a scene; it is made if there is none, like the one that shows."""
        key = *key_of(scene), renderer_class
        if key not in self._made:
            self._made[key] = made_like(self.renderer, renderer_class, scene)
        copy_values(self._last.get(renderer_class, self._made[key]), self._made[key])
        return self._made[key]

    def beside(self) -> "Choices":
        """Other choices for the same camera, which begin as these.

        They have a scene of their own, so that they can have other light, too.
        """
        former = self.renderer
        renderer = made_like(former, type(former), again(self.scene))
        copy_values(former, renderer)
        display = former.display
        return Choices(renderer.use(copy.copy(former.active)).set_display(display.exposure, display.tone))

    # ── white, in the view of the distance ──

    def _take_white(self) -> None:
        distance = self.renderer.values().get("max_distance")
        if distance is not None:
            if self.white is None:
                self.white = self.usual_white = distance
            self.renderer.change("max_distance", self.white)

    def set_white(self, distance: float | None) -> None:
        """Choose the distance that the view of the distance shows white."""
        self.white = distance
        self._take_white()

    # ── light ──

    @property
    def environment(self) -> str:
        """The name of the environment; "none" if the scene has none."""
        return NO_LIGHT if self.scene.environment is None else self.scene.environment.name

    def set_environment(self, name: str) -> None:
        """Choose the light from far away; it keeps intensity, rotation and look-up of the scene's own."""
        if name != NO_LIGHT and name not in self._environments:
            self._environments[name] = load_environment(name, **self._light_options)
        self.scene.set_environment(self._environments.get(name))
        self._has_chosen_light = True

    def next_environment(self) -> None:
        """Choose the environment that comes next in ``environments``."""
        self.set_environment(after(self.environment, self.environments))

    # ── the triangle test ──

    @property
    def triangle_test(self) -> str:
        """The name of the triangle test of the scene that is shown."""
        return self.renderer.scene_data.ray_intersector.triangle_test

    @property
    def triangle_tests(self) -> list[str]:
        """The names of the triangle tests that can be chosen; none if the intersector's own is not among the parts."""
        known = PARTS.names("triangle test")
        return known if self.triangle_test in known else []

    def next_triangle_test(self) -> None:
        """Show the scene with the triangle test that comes next; its intersector is built when this happens first."""
        self._show_scene(triangle_test=after(self.triangle_test, self.triangle_tests))

    # ── which lamp ──

    @property
    def lamp_choice(self) -> str:
        """How samples of the scene choose among its lamps."""
        return self.scene.lamps.choice.name

    @property
    def lamp_choices(self) -> list[str]:
        """The names of the lamp choices; none if the choice makes no difference to what is shown."""
        known = PARTS.names("lamp choice")
        matters = self.scene.lamps.count > 1 and self.renderer.needs_light and self.renderer.active.samples_lights
        return known if matters and self.lamp_choice in known else []

    def next_lamp_choice(self) -> None:
        """Show the scene with the lamp choice that comes next."""
        self._show_scene(lamp_choice=after(self.lamp_choice, self.lamp_choices))

    # ── the ground ──

    @property
    def ground(self) -> str:
        """What lies under everything: one of ``grounds``."""
        return self.grounds[int(self.scene.ground)]

    @property
    def grounds(self) -> list[str]:
        """What may lie under everything."""
        return ["nothing", "a large square"]

    def next_ground(self) -> None:
        """Show the scene on a ground, or without."""
        self._show_scene(ground=not self.scene.ground)

    def _show_scene(self, **changes: Any) -> None:
        """Show the scene with other arguments of ``SceneData``; it is made when these are chosen for the first time."""
        names = {"triangle_test": self.triangle_test, "lamp_choice": self.lamp_choice, "ground": self.scene.ground}
        key = tuple((names | changes).values())
        if key not in self._scenes:
            self._scenes[key] = again(self.scene, **changes)
        scene, former = self._scenes[key], self.renderer
        if scene.environment is not former.scene_data.environment:
            scene.set_environment(former.scene_data.environment)
        self._show(self._renderer(type(former), scene).use(former.active))


def key_of(scene: SceneData) -> tuple[str, str, bool]:
    """What ``Choices`` can change of a scene."""
    return scene.ray_intersector.triangle_test, scene.lamps.choice.name, scene.ground


def made_like(
    like: ProgressiveRenderer, renderer_class: type[ProgressiveRenderer], scene: SceneData
) -> ProgressiveRenderer:
    """A renderer of a class for a scene, with the camera and the samples of another one."""
    options = {"sampler": like.sampler, "seed": like.seed, "first_sample": like.first_sample}
    options |= {"crop": like.film.crop, "jitter": (like.jitter and not like.jitters) or None}
    options["adaptive"] = like.adaptive and renderer_class.jitters
    return renderer_class(scene_data=scene, camera=like.camera, **options)


def copy_values(former: ProgressiveRenderer, renderer: ProgressiveRenderer) -> None:
    """Give a renderer the values of a former one that it has, too."""
    known = renderer.values()
    for name, value in former.values().items():
        if name in known and value != known[name]:
            renderer.change(name, value)


def after(name: str, names: list[str]) -> str:
    """The name that comes after another one in a list, from whose end it goes on at the beginning."""
    return names[(names.index(name) + 1) % len(names)]
