"""From settings to pictures: which scene is loaded, what the scene file says of its pictures, and who renders them.

Names of parts are looked up in the registry, after the files of ``--parts`` were loaded.
"""

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

from taichi_tracer.apps.names import VIEW, View, find_views
from taichi_tracer.apps.notes import note
from taichi_tracer.camera import ProjectiveCamera, change_projection, make_camera
from taichi_tracer.cameras.orthographic import OrthographicCamera
from taichi_tracer.environment import Environment, check_intensity, load_environment
from taichi_tracer.explain.maps import find_measured
from taichi_tracer.formulas.view import without_angle
from taichi_tracer.integrators import one_sample, path_settings
from taichi_tracer.picture.film import crop_pixels
from taichi_tracer.picture.progress import Target
from taichi_tracer.progressive import ProgressiveRenderer
from taichi_tracer.scene_data import SceneData
from taichi_tracer.scene_data_loader import find_scene, is_document, load_scene_data, scene_of_document
from taichi_tracer.settings import (
    NO_NAME,
    OPTIONS,
    PICTURE_SIZE,
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
from taichi_tracer.system.parts import PARTS
from taichi_tracer.system.stopwatch import TAICHI, stage
from taichi_tracer.tones.display import Display

if TYPE_CHECKING:
    from taichi_tracer.rt3.document import Document, Shot

OF_LIGHT = ("intensity", "rotation", "lookup")  # arguments of ``Environment`` beside its image
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
        views: what to show, one file each.
        names_view: whether the user says what to show.
        shot: what the scene file says; None for a mesh.
    """

    settings: RenderSettings
    views: tuple[View, ...]
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
        is_said = any(one is not None for one in (of.spp, of.time, of.error))
        if not is_said and any(renderer_class.jitters for renderer_class, _ in self.views):
            return Target(USUAL_SPP, USUAL_SECONDS if len(of.bounces) < 2 else None, is_usual=True)
        return Target.of(of.spp, of.time, None if of.error is None else of.error / 100)

    @property
    def is_encoded(self) -> bool:
        """Whether colours get the sRGB transfer function where a file holds 8 bits (C-14)."""
        return self.shot is None or self.shot.film.gamma_corrected

    @property
    def values(self) -> dict[str, Any]:
        """What is said of the values of renderers, by name."""
        return {**({} if self.shot is None else self.shot.integrator.values), **self.settings.values()}

    def view_of(self, view: dict) -> dict:
        """The parameters of the camera, from those of the scene or of the scene file."""
        width, height = self.settings.size
        return camera_for(self.settings, view, width / height)

    def make_camera(self, scene: SceneData) -> ProjectiveCamera:
        """The camera, with the size of the picture."""
        width, height = self.settings.size
        view = scene.view_for(width / height) if self.shot is None else self.shot.view
        return make_camera(width, height, **self.view_of(view))

    def make_renderer(self, renderer_class: type[ProgressiveRenderer], scene: SceneData) -> ProgressiveRenderer:
        """A renderer of this picture."""
        options = self.settings.given(*RENDERER_ARGUMENTS) | {"jitter": self.settings.jitter or None}
        renderer = renderer_class(scene_data=scene, camera=self.make_camera(scene), crop=self.crop, **options)
        known = renderer.values().keys()
        for name, value in self.values.items():
            if name in known:
                renderer.change(name, find_measured(value) if name == "of" else value)
        return renderer.set_display(self.settings.exposure, self.settings.tone)


@dataclass(frozen=True)
class Request:
    """A scene and the pictures of it that are asked for.

    Attributes:
        settings: what the user says. document: the scene file, where it is one of RT3; None for a mesh.
    """

    settings: RenderSettings
    document: "Document | None"
    pictures: tuple[Picture, ...]

    @property
    def environment(self) -> str | None:
        """The name of the light from far away; ``USUAL_LIGHT`` where light is shown and nobody says it; or None."""
        of = self.settings
        in_file = None if self.document is None else self.document.environment
        if of.environment is not None:
            return None if of.environment == NO_NAME else of.environment
        return str(in_file) if in_file is not None else USUAL_LIGHT if self.may_add_light else None

    @property
    def may_add_light(self) -> bool:
        """Whether a scene without light gets ``USUAL_LIGHT``: light is shown, and nobody says which."""
        if self.settings.environment is not None or self.settings.lights:
            return False
        is_in_file = self.document is not None and self.document.environment is not None
        return not is_in_file and any(one.needs_light for picture in self.pictures for _, one in picture.views)

    def load_environment(self) -> Environment | None:
        """Read the light from far away."""
        name, options = self.environment, self.settings.given(*OF_LIGHT)
        if self.settings.environment is None and self.document is not None and self.document.environment is not None:
            options = {**self.document.environment_options, **options}
        return None if name is None else load_environment(name, **options)

    def load(self) -> SceneData:
        """Start Taichi and read the scene; what the user should know about it goes to stderr."""
        start_taichi(self.settings)
        options = self.settings.given(*SCENE_ARGUMENTS)
        if not self.may_add_light:
            options["environment"] = self.load_environment()
        if self.document is None:
            scene = load_scene_data(self.settings.scene, **options)
        else:
            scene = scene_of_document(self.document, **options)
        if self.may_add_light and scene.effects.is_dark:
            scene.set_environment(self.load_environment())
            note(f"nothing in this scene emits light: {USUAL_LIGHT} lights it; --environment none leaves it dark")
        for text in scene.notes:
            note(text)
        return scene


def start_taichi(settings: RenderSettings) -> None:
    """Start Taichi where the settings say."""
    with stage(TAICHI):
        runtime.init(**settings.given("arch", "precision"), fast_math=settings.fast_math)


def camera_for(settings: RenderSettings, view: dict, aspect: float) -> dict:
    """The parameters of ``make_camera``: those of a view, and instead of them what the settings say.

    Args:
        aspect: width / height of the picture.
    """
    changed = dict(view) if settings.camera is None else change_projection(view, settings.camera)
    if settings.fov is not None or settings.window is not None:
        changed.pop("fov", None)
        changed.pop("screen_window", None)
    changed |= settings.given("eye", "at", "up", "fov", "handedness")
    if settings.window is not None:
        changed["screen_window"] = settings.window
    is_parallel = issubclass(PARTS.find("camera", changed.get("projection", "perspective")), OrthographicCamera)
    return without_angle(changed, aspect) if is_parallel else changed


def first_renderer(settings: RenderSettings, begins_lit: bool = False) -> ProgressiveRenderer:
    """The renderer of the first picture that settings ask for.

    Args:
        begins_lit: whether a scene with light is shown by its light, where nobody says what to show.
    """
    request = request_of(settings)
    picture, scene = request.pictures[0], request.load()
    is_lit = begins_lit and not picture.names_view and picture.shot is None and not scene.effects.is_dark
    (renderer_class, integrator), *_ = find_views("mis") if is_lit else picture.views
    return picture.make_renderer(renderer_class, scene).use(integrator.name)


# ── from settings ──


def request_of(settings: RenderSettings) -> Request:
    """The scene and the pictures that the settings ask for.

    Raises:
        InputError: a name is unknown, or a value is out of its range.
    """
    path = find_scene(settings.scene)
    document = None
    if is_document(path):
        from taichi_tracer.rt3.document import read_rt3

        document = read_rt3(path)
    check(settings)
    pictures = tuple(picture_of(settings, shot) for shot in ([None] if document is None else document.shots))
    return Request(settings, document, pictures)


def picture_of(settings: RenderSettings, shot: "Shot | None") -> Picture:
    """One picture: of a mesh, or as the scene file says where the settings say nothing."""
    of_file: dict[str, Any] = {"size": size(PICTURE_SIZE), "crop": WHOLE, "view": VIEW}
    if shot is not None:
        film, integrator = shot.film, shot.integrator
        view = integrator.estimator if integrator.name == "direct" else integrator.name
        of_file = {"size": (film.width, film.height), "crop": film.crop_window, "view": view}
        if not settings.given("spp", "time", "error"):
            of_file["spp"] = integrator.spp
    of_file |= settings.given(*of_file)
    if settings.quick:
        of_file["size"] = tuple(max(1, side // QUICK) for side in of_file["size"])
    whole = replace(settings, **of_file, quick=False)
    picture = Picture(whole, find_views(whole.view), settings.view is not None, shot)
    if not picture.display.is_plain and not any(integrator.srgb for _, integrator in picture.views):
        shown = ", ".join(integrator.name for _, integrator in picture.views)
        advice = "give what shows light, as with --estimator mis"
        raise InputError(f"{picture.display}: {shown} shows data, which neither of them changes: {advice}")
    _ = picture.crop, picture.target  # a window without pixels is an error before any work is done
    return picture


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
