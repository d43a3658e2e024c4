"""What a command is asked for: the words of the command line, resolved once into objects that do not change.

The functions called ``…_of`` read argparse's namespace, at the top of a command. Everything below them takes what they
return. Names of parts are looked up in the registry, after the files of ``--parts`` were loaded.
"""

import warnings
from argparse import Namespace
from dataclasses import dataclass, fields, replace
from typing import TYPE_CHECKING, Any

import numpy as np

from taichi_tracer.apps.names import VIEW, View, find_views
from taichi_tracer.apps.options import BY_BOUNCE, OPTIONS, words_of
from taichi_tracer.apps.words import PICTURE_SIZE, USUAL_SECONDS, USUAL_SPP, given, note, request_from, size
from taichi_tracer.camera import ProjectiveCamera, change_projection, check_view, make_camera
from taichi_tracer.cameras.orthographic import OrthographicCamera
from taichi_tracer.effects import MODES
from taichi_tracer.environment import LOOKUPS, Environment, check_intensity, load_environment
from taichi_tracer.formulas.camera_frame import HANDEDNESS, up_of
from taichi_tracer.formulas.view import without_angle
from taichi_tracer.integrators import one_sample, path_settings
from taichi_tracer.maps import find_measured
from taichi_tracer.picture.crop import crop_pixels
from taichi_tracer.picture.progress import Target
from taichi_tracer.progressive import ProgressiveRenderer
from taichi_tracer.scene_data import SceneData
from taichi_tracer.scene_data_loader import find_scene, is_document, load_scene_data, scene_of_document
from taichi_tracer.system import runtime
from taichi_tracer.system.errors import InputError, one_of
from taichi_tracer.system.registry import PARTS
from taichi_tracer.system.stopwatch import TAICHI, stage
from taichi_tracer.tones.display import Display
from taichi_tracer.values import USUAL_LIGHT, WEIGHTS

if TYPE_CHECKING:
    from taichi_tracer.rt3.document import Document, Shot

OF_LIGHT = ("intensity", "rotation", "lookup")  # arguments of ``Environment`` beside its image
QUICK = 4  # a quick picture has a quarter of the width and of the height
Values = tuple[tuple[str, Any], ...]  # names of ``values.VALUES`` with what was given for them
WHOLE = 0.0, 1.0, 0.0, 1.0  # the crop window of the whole frame


# ── where kernels run, and the scene ──


@dataclass(frozen=True)
class MachineRequest:
    """Where kernels run, as for ``runtime.init``; None where the command line says nothing."""

    arch: str | None
    precision: str | None
    fast_math: bool

    def start(self) -> None:
        """Start Taichi."""
        with stage(TAICHI):
            runtime.init(**given(arch=self.arch, precision=self.precision), fast_math=self.fast_math)

    def words(self) -> list[str]:
        """The options that ask for the same."""
        return words_of(**vars(self))


@dataclass(frozen=True)
class EnvironmentRequest:
    """The light from far away: a shipped name or the path of an image, and options as for ``Environment``."""

    name: str
    intensity: float | None
    rotation: float | None
    lookup: str | None

    @property
    def options(self) -> dict:
        """What is asked for beside the image."""
        return given(**{name: getattr(self, name) for name in OF_LIGHT})

    def load(self) -> Environment:
        """Read the image."""
        return load_environment(self.name, **self.options)


@dataclass(frozen=True)
class SceneRequest:
    """A scene, what lights it, how its rays are intersected, and where that runs.

    Attributes:
        name: a shipped name or a path.
        document: what the file says, where it is one of RT3; None for a mesh.
        environment: None is no light from far away.
        is_usual: whether nobody asked for this environment, so that a scene with light of its own has none.
        lamp_choice: None is the default of ``SceneData``.
        intersector, triangle_test, effects: None is the default of ``SceneData``.
        brdfs, lights: names of registered parts.
        smooth: the crease angle of smooth normals in degrees; None leaves triangles without normals flat.
        ground: whether a large square lies under everything.
        parts: the files of ``--parts``, which are loaded already.
        up_axis: which axis points upwards, "y" or "z"; None is what the file says, or its shape.
    """

    name: str
    document: "Document | None"
    environment: EnvironmentRequest | None
    is_usual: bool
    intersector: str | None
    triangle_test: str | None
    lamp_choice: str | None
    two_sided_lamps: bool
    brdfs: tuple[str, ...]
    lights: tuple[str, ...]
    effects: str | None
    smooth: float | None
    ground: bool
    machine: MachineRequest
    parts: tuple[str, ...]
    up_axis: str | None

    def load(self) -> SceneData:
        """Start Taichi and read the scene; what the user should know about it goes to stderr."""
        self.machine.start()
        options = {"brdfs": self.brdfs, "lights": self.lights, "ground": self.ground}
        names = ("intersector", "triangle_test", "effects", "smooth", "lamp_choice", "up_axis")
        options |= given(**{name: getattr(self, name) for name in names}, two_sided_lamps=self.two_sided_lamps)
        if not self.is_usual:
            options["environment"] = None if self.environment is None else self.environment.load()
        if self.document is None:
            scene = load_scene_data(self.name, **options)
        else:
            scene = scene_of_document(self.document, **options)
        if self.is_usual and scene.effects.is_dark:
            scene.set_environment(self.environment.load())
            note(f"nothing in this scene emits light: {USUAL_LIGHT} lights it; --environment none leaves it dark")
        for text in scene.notes:
            note(text)
        return scene

    def words(self) -> list[str]:
        """The options that make this scene, but for its name and that of its environment."""
        names = [f.name for f in fields(self) if f.name in OPTIONS and f.name != "environment"]
        light = {} if self.environment is None else self.environment.options
        return words_of(**{name: getattr(self, name) for name in names}, **light) + self.machine.words()


# ── a picture ──


@dataclass(frozen=True)
class CameraRequest:
    """What the command line says of the camera; None leaves what the scene, or its file, says."""

    camera: str | None
    eye: tuple[float, ...] | None
    at: tuple[float, ...] | None
    up: tuple[float, ...] | None
    fov: float | None
    window: tuple[float, ...] | None
    handedness: str | None

    def applied_to(self, view: dict, aspect: float) -> dict:
        """The parameters of ``make_camera``: those of a view, and instead of them what is asked for.

        Args:
            aspect: width / height of the picture.
        """
        changed = dict(view) if self.camera is None else change_projection(view, self.camera)
        if self.fov is not None or self.window is not None:
            changed.pop("fov", None)
            changed.pop("screen_window", None)
        changed |= given(eye=self.eye, at=self.at, up=self.up, fov=self.fov, screen_window=self.window)
        changed |= given(handedness=self.handedness)
        is_parallel = issubclass(PARTS.find("camera", changed.get("projection", "perspective")), OrthographicCamera)
        return without_angle(changed, aspect) if is_parallel else changed


@dataclass(frozen=True)
class SamplesRequest:
    """How the samples of a picture are taken, as for ``ProgressiveRenderer``; ``sampler`` None is its default."""

    sampler: str | None
    seed: int
    jitter: bool
    adaptive: bool | None
    first_sample: int


@dataclass(frozen=True)
class PictureRequest:
    """One picture that is asked for: by a scene file, and by the command line, which wins.

    Attributes:
        width, height: pixels of the whole frame.
        crop_window: (x0, x1, y0, y1), the part that is rendered, in fractions of the frame.
        views: what to show, one picture each.
        names_view: whether the command line says what to show.
        target: when its rendering ends.
        shot: what the scene file says; None for a mesh.
        filename: where the scene file wants it; None where it says nothing, or something else is shown.
        display: exposure and tone curve, for what shows light or colour.
        values: what is asked of the renderer, if it has such a value.
    """

    width: int
    height: int
    crop_window: tuple[float, ...]
    views: tuple[View, ...]
    names_view: bool
    target: Target
    shot: "Shot | None"
    filename: str | None
    camera: CameraRequest
    samples: SamplesRequest
    display: Display
    values: Values

    @property
    def crop(self) -> tuple[int, int, int, int]:
        """(x0, x1, y0, y1) in pixels."""
        return crop_pixels(self.crop_window, self.width, self.height)

    @property
    def needs_light(self) -> bool:
        """Whether something is asked for that light has to be simulated for."""
        return any(integrator.needs_light for _, integrator in self.views)

    @property
    def is_encoded(self) -> bool:
        """Whether colours get the sRGB transfer function where a file holds 8 bits (C-14)."""
        return self.shot is None or self.shot.film.gamma_corrected

    def view_of(self, view: dict) -> dict:
        """The parameters of the camera, from those of the scene or of the scene file."""
        return self.camera.applied_to(view, self.width / self.height)

    def make_camera(self, scene: SceneData) -> ProjectiveCamera:
        """The camera, with the size of the picture."""
        view = scene.view_for(self.width / self.height) if self.shot is None else self.shot.view
        return make_camera(self.width, self.height, **self.view_of(view))

    def make_renderer(self, renderer_class: type[ProgressiveRenderer], scene: SceneData) -> ProgressiveRenderer:
        """A renderer of this picture."""
        samples = self.samples
        options = given(sampler=samples.sampler, jitter=samples.jitter or None)
        options |= {"seed": samples.seed, "adaptive": samples.adaptive, "first_sample": samples.first_sample}
        renderer = renderer_class(scene_data=scene, camera=self.make_camera(scene), crop=self.crop, **options)
        known = renderer.values().keys()
        for name, value in self.values:
            if name in known:
                renderer.change(name, value)
        return renderer.set_display(self.display.exposure, self.display.tone)


# ── from the namespace ──


def scene_and_pictures_of(args: Namespace) -> tuple[SceneRequest, tuple[PictureRequest, ...]]:
    """The scene, and the pictures of it that are asked for."""
    document = document_of(args.scene)
    pictures = pictures_of(args, document)
    return scene_of(args, document, any(picture.needs_light for picture in pictures)), pictures


def document_of(scene: str) -> "Document | None":
    """The RT3 document that a name or path leads to; None where it leads to a mesh."""
    path = find_scene(scene)
    if not is_document(path):
        return None
    from taichi_tracer.rt3.document import read_rt3

    return read_rt3(path)


def scene_of(args: Namespace, document: "Document | None", needs_light: bool) -> SceneRequest:
    """The scene that the options of a scene ask for.

    Args:
        needs_light: whether something is to be shown that light has to be simulated for.
    """
    if args.intensity is not None:
        check_intensity(args.intensity)
    asked = environment_of(args, document)
    is_usual = asked is None and needs_light and args.environment is None and not args.lights
    return request_from(
        SceneRequest,
        args,
        name=args.scene,
        document=document,
        environment=EnvironmentRequest(USUAL_LIGHT, args.intensity, args.rotation, args.lookup) if is_usual else asked,
        is_usual=is_usual,
        machine=request_from(MachineRequest, args),
        up_axis=up_axis_of(args),
    )


def up_axis_of(args: Namespace) -> str | None:
    """Which axis of the scene points upwards, or None; an InputError for a name that is none."""
    if args.up_axis is not None:
        up_of(args.up_axis)
    return args.up_axis


def environment_of(args: Namespace, document: "Document | None") -> EnvironmentRequest | None:
    """The environment of the command line, or of the scene file; None if neither names one, or it is "none"."""
    name, options = args.environment, {}
    if name is None and document is not None and document.environment is not None:
        name, options = str(document.environment), document.environment_options
    if name is None or name == "none":
        return None
    options = options | given(intensity=args.intensity, rotation=args.rotation)
    return EnvironmentRequest(name, options.get("intensity"), options.get("rotation"), args.lookup)


def pictures_of(args: Namespace, document: "Document | None") -> tuple[PictureRequest, ...]:
    """The pictures to be made: those of the scene file, or one; what the command line says counts instead."""
    check_names(args)
    return tuple(_picture_of(args, shot) for shot in ([None] if document is None else document.shots))


def _picture_of(args: Namespace, shot: "Shot | None") -> PictureRequest:
    (width, height), view, spp, window, filename = size(PICTURE_SIZE), VIEW, None, WHOLE, None
    if shot is not None:
        width, height, integrator, spp = shot.film.width, shot.film.height, shot.integrator, shot.integrator.spp
        view = integrator.estimator if integrator.name == "direct" else integrator.name
        window, filename = shot.film.crop_window, shot.film.filename
    if args.size is not None:
        width, height = args.size
    if args.quick:
        width, height = max(1, width // QUICK), max(1, height // QUICK)
    values = values_of(args, shot)
    views = find_views(view if args.view is None else args.view)
    picture = request_from(
        PictureRequest,
        args,
        width=width,
        height=height,
        crop_window=window if args.crop is None else tuple(args.crop),
        views=views,
        names_view=args.view is not None,
        target=target_of(args, spp, any(renderer_class.jitters for renderer_class, _ in views)),
        shot=shot,
        filename=filename if args.view is None else None,
        camera=request_from(CameraRequest, args),
        samples=request_from(SamplesRequest, args),
        display=Display(args.exposure, args.tone),
        values=values,
    )
    if not picture.display.is_plain and not any(integrator.srgb for _, integrator in picture.views):
        shown = ", ".join(integrator.name for _, integrator in picture.views)
        advice = "give what shows light, as with --estimator mis"
        raise InputError(f"{picture.display}: {shown} shows data, which neither of them changes: {advice}")
    crop_pixels(picture.crop_window, width, height)  # a window without pixels is an error before any work is done
    check_camera(picture)
    return picture


def target_of(args: Namespace, spp: int | None, is_light: bool) -> Target:
    """When the rendering ends: as the command line says, or the scene file, which says so many samples.

    Args:
        is_light: whether the picture is a mean of random samples. Where nobody says when it ends, it has
            ``USUAL_SPP`` samples, or those of ``USUAL_SECONDS``; pictures by bounce need the same samples each.
    """
    if args.error is not None and args.error > 100:
        raise InputError(f"--error {args.error:g}: at most 100, which is an error as large as the picture's mean")
    error = None if args.error is None else args.error / 100
    if any(value is not None for value in (args.spp, args.time, error)):
        return Target.of(args.spp, args.time, error)
    if spp is None and is_light:
        is_alone = len(getattr(args, "bounces", ())) < 2
        return Target(USUAL_SPP, USUAL_SECONDS if is_alone else None, is_usual=True)
    return Target.of(spp)


def values_of(args: Namespace, shot: "Shot | None") -> Values:
    """The values of renderers that the command line gives, or the scene file.

    Raises:
        InputError: one of them is out of its range.
    """
    asked = dict(shot.integrator.values) if shot is not None else {}
    words = {o.value: getattr(args, o.name) for o in OPTIONS.values() if o.value and o is not BY_BOUNCE}
    asked |= given(**words)
    if "of" in asked:
        asked["of"] = find_measured(asked["of"])
    path_settings.check(**{name: asked.get(name, usual) for name, usual in path_settings.DEFAULTS.items()})
    one_sample.check(**{value.name: asked.get(value.name, value.default) for value in WEIGHTS})
    return tuple(asked.items())


# ── wrong words, before a scene is loaded ──


def check_names(args: Namespace) -> None:
    """Raise an InputError for a name that is none."""
    for option in OPTIONS.values():
        said = getattr(args, option.name, None) if option.part else None
        for name in said if isinstance(said, tuple) else given(name=said).values():
            PARTS.find(option.part, name)
    for name, known in (("effects", MODES), ("lookup", LOOKUPS), ("handedness", HANDEDNESS)):
        if getattr(args, name, None) not in (None, *known):
            raise one_of(name, getattr(args, name), known)


def check_camera(picture: PictureRequest) -> None:
    """Raise an InputError if there is no such camera. The place of a mesh's own is not known yet: any stands for it."""
    camera, view = picture.camera, {"eye": (0, 0, 1), "at": (0, 0, 0), "up": (0, 1, 0)}
    if picture.shot is not None:
        view = picture.shot.view
    elif camera.eye is None or camera.at is None:
        camera = replace(camera, eye=None, at=None, up=None)
    elif camera.up is None:
        view["up"] = np.eye(3)[np.abs(np.subtract(camera.at, camera.eye)).argmin()]  # not along the gaze
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # the camera itself warns
        check_view(picture.width, picture.height, **camera.applied_to(view, picture.width / picture.height))
