"""From settings to pictures, and back.

The names that can be typed, and what they lead to; which scene is loaded, what the scene file says of its pictures, and
who renders them; and what makes a picture again that is shown: its settings, the command line, and the lines of Python.
Names of parts are looked up in the registry, after the files of ``--parts`` were loaded.
"""

import shlex
import shutil
import textwrap
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from inspect import signature
from typing import TYPE_CHECKING, Any

import numpy as np

import taichi_tracer
from taichi_tracer.apps.console import note
from taichi_tracer.camera import ProjectiveCamera, change_projection, make_camera
from taichi_tracer.environment import check_intensity, load_environment
from taichi_tracer.explain.maps import find_measured
from taichi_tracer.files.disk import shipped_environments
from taichi_tracer.formulas.view import without_angle
from taichi_tracer.integrators import one_sample, path_settings
from taichi_tracer.integrators.base import Integrator
from taichi_tracer.integrators.rt3 import DepthMap
from taichi_tracer.integrators.rt3_blinn_phong import BlinnPhong
from taichi_tracer.intersectors.bvh import BVHRayIntersector
from taichi_tracer.lights.delta_lights import GivenLight
from taichi_tracer.options import intersector_of
from taichi_tracer.picture.aovs import AOVS
from taichi_tracer.picture.film import crop_pixels
from taichi_tracer.picture.progress import Target
from taichi_tracer.progressive import ProgressiveRenderer
from taichi_tracer.renderer import A3Renderer
from taichi_tracer.sampler import usual_sampler
from taichi_tracer.scene_data import SceneData
from taichi_tracer.scene_data_loader import (
    find_scene,
    is_document,
    load_scene_data,
    name_of,
    scene_names,
    scene_of_document,
)
from taichi_tracer.settings import (
    DEFAULTS,
    NO_NAME,
    OPTIONS,
    PICTURE_SIZE,
    SMOOTH,
    USUAL_LIGHT,
    USUAL_SECONDS,
    USUAL_SPP,
    WEIGHTS,
    RenderSettings,
    usual_values,
)
from taichi_tracer.system import runtime
from taichi_tracer.system.argument_types import size
from taichi_tracer.system.errors import InputError, one_of
from taichi_tracer.system.parts import PARTS, replaced, unfinished
from taichi_tracer.system.stopwatch import TAICHI, stage
from taichi_tracer.tones.display import Display

if TYPE_CHECKING:
    from taichi_tracer.rt3.document import Document, Shot

# ── names ──


VIEW = "normal"  # what a picture shows when nobody says it
ALL = "all"  # every view of the renderer that shows ``VIEW``
# Options of ``accuracy`` that take names, see ``studies.variants``.
STUDIED = ("estimators", "samplers", "precisions", "triangle_tests", "lookups", "intersectors", "lamp_choices")
STUDIED += ("roulettes",)
TITLE_WIDTH = 16  # characters: the longest title and a little more

View = tuple[type[ProgressiveRenderer], Integrator]  # what a picture shows, and the renderer that offers it


def renderers() -> list[type[ProgressiveRenderer]]:
    """Every registered renderer that offers something."""
    return [c for c in PARTS.all("renderer") if len(c.offered()) > 0]


def find_views(text: str) -> tuple[View, ...]:
    """What a list of names with commas asks for; "all" is everything that the renderer of ``VIEW`` offers.

    A name that several renderers offer belongs to the one that was registered last: a renderer of your own that derives
    from ``A1Renderer`` takes its place.

    Raises:
        InputError: a name that none of them offers.
    """
    offered = [(renderer_class, one) for renderer_class in renderers() for one in renderer_class.offered()]
    offered.sort(key=lambda pair: is_second_choice(*pair), reverse=True)
    known: dict[str, View] = {alias: (cls, one) for cls, one in offered for alias in one.aliases}
    known |= {one.name: (cls, one) for cls, one in offered}
    if text == ALL:
        renderer_class, _ = known[VIEW]
        return tuple((renderer_class, integrator) for integrator in renderer_class.offered())
    for name in text.split(","):
        if name not in known:
            raise one_of("view or estimator", name, [*dict.fromkeys(n for c in renderers() for n in c.names()), ALL])
    return tuple(known[name] for name in text.split(","))


def is_second_choice(renderer_class: type[ProgressiveRenderer], one: Integrator) -> bool:
    """Whether another renderer shows this, if it can: a student has not written this one, or only A2 has the mode."""
    return "shade_ray" in unfinished(renderer_class) or (one.microfacets and renderer_class is A3Renderer)


# ── the end of a help ──


def help_text(options: Sequence[str]) -> str:
    """The end of a command's help: the names that its options take; a star follows what counts when none is given."""
    lines, columns = [], shutil.get_terminal_size().columns
    for option in options:
        for title, (known, usual) in names_of(option).items():
            words = ", ".join(f"{name}*" if name in usual else name for name in known)
            text = f"{title + ':':<{TITLE_WIDTH}}{words}"
            lines += textwrap.wrap(text, columns, subsequent_indent=" " * TITLE_WIDTH, break_on_hyphens=False)
    if any("*" in line for line in lines):
        lines.append("* counts where nothing is said, neither here nor in the scene file.")
    return "\n" + "".join(f"{line}\n" for line in lines)


def names_of(option: str) -> dict[str, tuple[Iterable[str], tuple]]:
    """Title → the names that an option takes, and those that count when none is given; {} where it takes no names."""
    title = option.replace("_", " ")
    if option == "view":
        (first, _), *_ = find_views(VIEW)
        found: dict[str, tuple[Iterable[str], tuple]] = {}
        for renderer_class in renderers():
            known, _ = found.get(renderer_class.what, ((), ()))
            found[renderer_class.what] = dict.fromkeys([*known, *renderer_class.names()]), (VIEW,)
        found[first.what] = [*found[first.what][0], ALL], (VIEW,)
        return found
    if option in ("scene", "what"):
        return {"scene": (scene_names(), ())} | ({} if option == "scene" else names_of("environment"))
    if option == "environment":
        return {title: ((*shipped_environments(), *PARTS.names("environment"), NO_NAME), ())}
    single = {"aov": (AOVS, ()), "arch": (runtime.ARCHS, ("auto",)), "precision": (runtime.PRECISIONS, ("f32",))}
    if option in single:
        return {title: single[option]}
    if option in STUDIED:
        from taichi_tracer.studies import variants

        return {title: (variants.known(option), variants.USUAL[option])}
    known = OPTIONS.get(option)
    if known is None or not (known.part or known.choices):
        return {}
    return {title: (PARTS.names(known.part) if known.part else known.choices, (known.usual or DEFAULTS[option],))}


# ── from settings to pictures ──


OF_LIGHT = ("intensity", "rotation", "lookup")  # arguments of ``Environment`` beside its image
MANY = 1 << 22  # samples of all pixels, from which on a picture has the wide hierarchy
QUICK = 4  # a quick picture has a quarter of the width and of the height
WHOLE = 0.0, 1.0, 0.0, 1.0  # the crop window of the whole frame
# Settings that are arguments of a scene, and of a renderer, under the same names.
SCENE_ARGUMENTS = ("brdfs", "lights", "ground", "two_sided_lamps", "intersector", "triangle_test")
SCENE_ARGUMENTS += ("effects", "smooth", "lamp_choice", "up_axis", "background")
RENDERER_ARGUMENTS = ("sampler", "seed", "adaptive", "first_sample")


@dataclass(frozen=True)
class Picture:
    """One picture: what the user says counts, and beside it what the scene file says.

    Attributes:
        settings: with the size, the crop window and the samples of this picture.
        renderer_class, integrator: what to show, and the renderer that offers it.
        names_view: whether the user says what to show.
        shot: what the scene file says; None for a mesh.
    """

    settings: RenderSettings
    renderer_class: type[ProgressiveRenderer]
    integrator: Integrator
    names_view: bool
    shot: "Shot | None"

    @property
    def crop(self) -> tuple[int, int, int, int]:
        """(x0, x1, y0, y1) in pixels."""
        return crop_pixels(self.settings.crop, *self.settings.size)

    @property
    def filename(self) -> str | None:
        """Where the scene file wants the picture; None where it says nothing, or something else is shown."""
        return None if self.shot is None or self.names_view else self.shot.film.filename

    @property
    def display(self) -> Display:
        """Exposure and tone curve."""
        return Display(self.settings.exposure, self.settings.tone)

    @property
    def target(self) -> Target:
        """When the rendering ends. Where nobody says it, light has ``USUAL_SPP`` samples, or those of
        ``USUAL_SECONDS``; pictures by bounce need the same samples each.
        """
        of = self.settings
        if self.renderer_class.jitters and not of.given("spp", "time", "error"):
            return Target(USUAL_SPP, USUAL_SECONDS if len(of.bounces) < 2 else None, is_usual=True)
        return Target.of(of.spp, of.time, None if of.error is None else of.error / 100)

    @property
    def is_long(self) -> bool:
        """Whether so many samples are asked for that the hierarchy that compiles longer, and renders faster, pays."""
        width, height = self.settings.size
        return self.integrator.needs_light and width * height * (self.target.spp or USUAL_SPP) >= MANY

    @property
    def is_encoded(self) -> bool:
        """Whether colours get the sRGB transfer function where a file holds 8 bits (C-14)."""
        return self.shot is None or self.shot.film.gamma_corrected

    @property
    def values(self) -> dict[str, Any]:
        """What is said of the values of renderers, by name."""
        return {**({} if self.shot is None else self.shot.integrator.values), **self.settings.values()}

    def make_camera(self, scene: SceneData) -> ProjectiveCamera:
        """The camera, with the size of the picture."""
        width, height = self.settings.size
        view = scene.view_for(width / height) if self.shot is None else self.shot.view
        return make_camera(width, height, **camera_for(self.settings, view))

    def make_renderer(self, scene: SceneData) -> ProgressiveRenderer:
        """The renderer that shows this picture."""
        options = self.settings.given(*RENDERER_ARGUMENTS) | {"jitter": self.settings.jitter or None}
        renderer = self.renderer_class(scene_data=scene, camera=self.make_camera(scene), crop=self.crop, **options)
        known = renderer.values().keys()
        for name, value in self.values.items():
            if name in known:
                renderer.change(name, find_measured(value) if name == "of" else value)
        return renderer.set_display(self.settings.exposure, self.settings.tone).use(self.integrator.name)


@dataclass(frozen=True)
class Request:
    """A scene and the pictures of it that are asked for.

    Attributes:
        settings: what the user says. document: the scene file, where it is one of RT3; None for a mesh.
        pictures: one for each view of each film of the scene file.
    """

    settings: RenderSettings
    document: "Document | None"
    pictures: tuple[Picture, ...]

    def single(self, command: str) -> Picture:
        """The only picture; an InputError if there are several."""
        if len(self.pictures) > 1:
            raise InputError(f"{command} takes one picture: name one view or estimator, or a scene file with one film")
        return self.pictures[0]

    def load(self, is_long: bool = False) -> SceneData:
        """Start Taichi and read the scene; what the user should know about it goes to stderr.

        A scene without light gets ``USUAL_LIGHT`` where light is shown, and nobody says which.

        Args:
            is_long: whether many samples follow, so that the wide hierarchy pays: it compiles longer, renders faster.
        """
        of, document = self.settings, self.document
        with stage(TAICHI):
            runtime.init(**of.given("arch", "precision"), fast_math=of.fast_math)
        options, of_light = of.given(*SCENE_ARGUMENTS), of.given(*OF_LIGHT)
        is_said = document is not None and document.intersector is not None
        if is_long and not is_said and not replaced(BVHRayIntersector):
            options.setdefault("intersector", "wide_bvh")
        if of.environment is not None:
            options["environment"] = None if of.environment == NO_NAME else load_environment(of.environment, **of_light)
        elif document is not None and document.environment is not None:
            of_light = document.environment_options | of_light
            options["environment"] = load_environment(str(document.environment), **of_light)
        scene = load_scene_data(of.scene, **options) if document is None else scene_of_document(document, **options)
        shows_light = any(one.integrator.needs_light for one in self.pictures)
        if shows_light and not of.lights and "environment" not in options and not scene.effects.is_lit:
            scene.set_environment(load_environment(USUAL_LIGHT, **of_light))
            note(f"nothing in this scene emits light: {USUAL_LIGHT} lights it; --environment none leaves it dark")
        for text in scene.notes:
            note(text)
        return scene


def camera_for(settings: RenderSettings, view: dict) -> dict:
    """The parameters of ``make_camera``: those of a view, and instead of them what the settings say."""
    changed = dict(view) if settings.camera is None else change_projection(view, settings.camera)
    if settings.fov is not None or settings.window is not None:
        changed.pop("fov", None)
        changed.pop("screen_window", None)
    changed |= camera_arguments(settings)
    width, height = settings.size
    camera = PARTS.find("camera", changed.get("projection", "perspective"))
    return without_angle(changed, width / height) if camera.is_parallel else changed


def camera_arguments(settings: RenderSettings) -> dict[str, Any]:
    """The arguments of ``set_camera_parameters`` that settings give."""
    window = {} if settings.window is None else {"screen_window": settings.window}
    return settings.given("eye", "at", "up", "fov", "handedness") | window


def first_renderer(settings: RenderSettings, begins_lit: bool = False) -> ProgressiveRenderer:
    """The renderer of the first picture that settings ask for.

    Args:
        begins_lit: whether a scene with light is shown by its light, where nobody says what to show.
    """
    request = request_of(settings)
    picture, scene = request.pictures[0], request.load(is_long=True)
    if begins_lit and not picture.names_view and picture.shot is None and scene.effects.is_lit:
        ((renderer_class, integrator),) = find_views("mis")
        picture = replace(picture, renderer_class=renderer_class, integrator=integrator)
    return picture.make_renderer(scene)


# ── from settings ──


def request_of(settings: RenderSettings) -> Request:
    """The scene and the pictures that the settings ask for.

    Raises:
        InputError: a name is unknown, or a value is out of its range.
    """
    path, document = find_scene(settings.scene), None
    if is_document(path):
        from taichi_tracer.rt3.document import read_rt3

        document = read_rt3(path)
    check(settings)
    shots = [None] if document is None else document.shots
    return Request(settings, document, tuple(picture for shot in shots for picture in pictures_of(settings, shot)))


def pictures_of(settings: RenderSettings, shot: "Shot | None") -> list[Picture]:
    """The pictures of a mesh, a view each; or one as the scene file says where the settings say nothing."""
    of_file: dict[str, Any] = {"size": size(PICTURE_SIZE), "crop": WHOLE, "view": VIEW}
    if shot is not None:
        film, integrator = shot.film, shot.integrator
        of_file = {"size": (film.width, film.height), "crop": film.crop_window, "view": integrator.name}
        if not settings.given("spp", "time", "error"):
            of_file["spp"] = integrator.spp
    of_file |= settings.given(*of_file)
    if settings.quick:
        of_file["size"] = tuple(max(1, side // QUICK) for side in of_file["size"])
    whole = replace(settings, **of_file, quick=False)
    pictures = [Picture(whole, *view, settings.view is not None, shot) for view in find_views(whole.view)]
    if not pictures[0].display.is_plain and not any(one.integrator.srgb for one in pictures):
        shown = ", ".join(one.integrator.name for one in pictures)
        advice = "give what shows light, as with --estimator mis"
        raise InputError(f"{pictures[0].display}: {shown} shows data, which neither of them changes: {advice}")
    _ = pictures[0].crop, pictures[0].target  # a window without pixels is an error before any work is done
    return pictures


def check(settings: RenderSettings) -> None:
    """Raise an InputError for a name that is none, or a value out of its range."""
    for name, option in OPTIONS.items():
        found = getattr(settings, name)
        for one in found if isinstance(found, tuple) else () if found is None else (found,):
            if option.part:
                PARTS.find(option.part, one)
            if option.choices and one not in option.choices:
                raise one_of(name.replace("_", " "), one, option.choices)
    if settings.intensity is not None:
        check_intensity(settings.intensity)
    if settings.error is not None and settings.error > 100:
        advice = "at most 100, which is an error as large as the picture's mean"
        raise InputError(f"--error {settings.error:g}: {advice}")
    values = settings.values()
    if "of" in values:
        find_measured(values["of"])
    path_settings.check(**{name: values.get(name, usual) for name, usual in path_settings.DEFAULTS.items()})
    one_sample.check(**{name: values.get(name, usual) for name, usual in usual_values(WEIGHTS).items()})


# ── from pictures to settings ──


def as_command(renderer: ProgressiveRenderer, base: RenderSettings | None = None) -> str:
    """The command line that makes the picture that the renderer shows; ``base`` as for ``settings_of``."""
    settings = settings_of(renderer, base)
    if not renderer.needs_light:
        settings = replace(settings, environment=None, lamp_choice=None, **dict.fromkeys(OF_LIGHT))
    return shlex.join(["taichi-tracer", "render", settings.scene, *settings.words()])


def settings_of(renderer: ProgressiveRenderer, base: RenderSettings | None = None) -> RenderSettings:
    """The settings of the picture that a renderer shows.

    Args:
        base: what the program was started with; it has what no renderer knows, such as the files of ``--parts``.
    """
    film, sampler = renderer.film, renderer.sampler.name
    values = {name: changed_values(renderer).get(one.value) for name, one in OPTIONS.items() if one.value}
    is_shown = renderer.srgb and not renderer.has_own_display
    return replace(
        scene_settings(renderer.scene_data, base or RenderSettings()),
        **values | {"bounces": () if values["bounces"] is None else (values["bounces"],)},
        **camera_settings(renderer.camera),
        environment=environment_name(renderer.scene_data),
        view=renderer.active.name,
        size=(renderer.width, renderer.height),
        quick=False,
        crop=fractions_of(film.crop, renderer.width, renderer.height),
        sampler=None if sampler == usual_sampler(bool(renderer.adaptive)) else sampler,
        seed=renderer.seed,
        first_sample=renderer.first_sample,
        jitter=renderer.jitter and not renderer.jitters,
        adaptive=renderer.adaptive,
        spp=renderer.samples if renderer.is_random and renderer.samples > 0 else None,
        time=None,
        error=None,
        exposure=float(renderer.display.exposure) if is_shown else 0.0,
        tone=renderer.display.part.name if is_shown else "none",
    )


def scene_settings(scene: SceneData, base: RenderSettings) -> RenderSettings:
    """The settings of a scene."""
    light, given = scene.environment, scene.lights[scene.lights_of_file :]
    name = name_of(scene.source)
    is_usual = name != str(scene.source) and scene.up_axis == "y"  # what a shipped scene says itself
    own_test = scene.ray_intersector.triangle_test
    return replace(
        base,
        scene=name,
        up_axis=None if is_usual else scene.up_axis,
        lights=tuple(one.name for one in given if not isinstance(one, GivenLight)),
        intersector=None if scene.chosen is intersector_of(None, scene.mesh) else scene.chosen.name,
        triangle_test=own_test if own_test in PARTS.names("triangle test") and own_test != "watertight" else None,
        lamp_choice=scene.lamps.choice.name if scene.lamps.count > 1 else None,
        two_sided_lamps=scene.lamps.two_sided,
        effects=None if scene.effects_mode == "scene" else scene.effects_mode,
        smooth=SMOOTH if scene.given["smooth"] is True else scene.given["smooth"] or None,
        ground=scene.ground,
        precision=None if runtime.current().precision == "f32" else runtime.current().precision,
        **{name: getattr(light, name) for name in OF_LIGHT if light is not None and is_changed(light, name)},
    )


def environment_name(scene: SceneData) -> str:
    """The name of the light from far away, or "none"."""
    return NO_NAME if scene.environment is None else scene.environment.name


def is_changed(part: Any, name: str) -> bool:
    """Whether an argument of a part is not the default."""
    return getattr(part, name) != signature(type(part)).parameters[name].default


def fractions_of(crop: tuple[int, int, int, int], width: int, height: int) -> tuple[float, ...] | None:
    """The crop window that has exactly these pixels; None for the whole picture."""
    if crop == (0, width, 0, height):
        return None
    sides = zip(crop, (width, width, height, height), strict=True)
    return tuple(0.0 if edge == 0 else 1.0 if edge == side else (edge - 0.5) / side for edge, side in sides)


def changed_values(renderer: ProgressiveRenderer) -> dict[str, Any]:
    """The values of a renderer that are not the defaults, and that the picture in use may depend on."""
    known, active = {one.value: one for one in OPTIONS.values() if one.value}, renderer.active.name
    values = ((known[name], value) for name, value in renderer.values().items() if name in known)
    return {of.value: value for of, value in values if value != of.usual and of.of in ("", active)}


def camera_settings(camera: ProjectiveCamera) -> dict[str, Any]:
    """The settings of a camera, to nine digits; its window at distance 1, or in world units if it is orthographic."""
    scale = 1.0 if camera.is_parallel or not camera.has_window else camera.focal_distance
    window = rounded(np.divide(camera.screen_window, scale)) if camera.has_window else None
    return {
        **{name: rounded(getattr(camera, name)) for name in ("eye", "at", "up")},
        "camera": camera.name,
        "window": window,
        "fov": None if camera.has_window else rounded([camera.fov])[0],
        "handedness": camera.handedness,
    }


def rounded(values: Any) -> tuple[float, ...]:
    """Numbers to nine digits, without a negative zero."""
    return tuple(float(f"{value:.9g}") + 0.0 for value in values)


# ── as Python ──


def as_python(renderer: ProgressiveRenderer) -> str:
    """Lines of Python that make the picture that the renderer shows, of a scene that ``load_scene_data`` finds.

    Parts that are objects of a program of your own, and a background, are left out.
    """
    scene, cls, settings = renderer.scene_data, type(renderer), settings_of(renderer)
    options = settings.changed()
    of_scene, of_light, of_renderer = (
        {name: options[name] for name in names if name in options}
        for names in (SCENE_ARGUMENTS, OF_LIGHT, (*RENDERER_ARGUMENTS, "jitter"))
    )
    light = repr(scene.environment and scene.environment.name)
    lines = ["import taichi_tracer as tt", ""]
    if of_light:
        light = call("load_environment", light, **of_light)
        lines.insert(1, "from taichi_tracer.environment import load_environment")
    if settings.precision is not None:
        lines.append(call("tt.init", precision=settings.precision))
    if given := scene.lights[scene.lights_of_file :]:
        of_scene["lights"] = [one if isinstance(one, GivenLight) else one.name for one in given]
    lines.append(call("scene = tt.load_scene_data", repr(settings.scene), f"environment={light}", **of_scene))
    if "crop" in options:
        of_renderer["crop"] = renderer.film.crop
    if settings.camera != "perspective":
        of_renderer["camera"] = settings.camera
    name = f"tt.{cls.__name__}" if hasattr(taichi_tracer, cls.__name__) else cls.__name__
    lines.append(call(f"renderer = {name}", "scene", str(renderer.width), str(renderer.height), **of_renderer))
    lines.append(call("renderer.camera.set_camera_parameters", **camera_arguments(settings)))
    for name, value in changed_values(renderer).items():
        is_attribute, text = hasattr(type(renderer), name), repr(value)
        lines.append(f"renderer.{name} = {text}" if is_attribute else f"renderer.change({name!r}, {text})")
    if isinstance(renderer.active, BlinnPhong) and renderer.active.depth != BlinnPhong().depth:
        lines.append(call("renderer.set_mirrors", repr(int(renderer.active.depth))))
    if isinstance(renderer.active, DepthMap):
        lines.append(call("renderer.set_depth", **renderer.active.arguments()))
    if "exposure" in options or "tone" in options:
        lines.append(call("renderer.set_display", exposure=settings.exposure, tone=settings.tone))
    lines.append(f"renderer.use({renderer.active.name!r}).render({max(1, renderer.samples)})")
    lines.append(f"renderer.save({renderer.active.name + '.png'!r})")
    return "\n".join(lines)


def call(function: str, *arguments: str, **options: Any) -> str:
    """A call, as Python writes it; the arguments are Python already, and the values of the options become it."""
    return f"{function}({', '.join([*arguments, *(f'{name}={value!r}' for name, value in options.items())])})"
