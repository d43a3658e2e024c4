"""What a command is asked for: the words of the command line, resolved once into objects that do not change.

The functions called ``…_of`` read argparse's namespace, at the top of a command. Everything below them takes what they
return. Names of parts are looked up in the registry, after the files of ``--parts`` were loaded.
"""

from argparse import Namespace
from dataclasses import dataclass
from typing import TYPE_CHECKING

from taichi_tracer.apps.names import VIEW, View, find_views
from taichi_tracer.apps.words import LIGHT, PICTURE_SIZE, given, note, size, taken
from taichi_tracer.camera import ProjectiveCamera, change_projection, make_camera
from taichi_tracer.cameras.orthographic import OrthographicCamera
from taichi_tracer.environment import Environment, load_environment
from taichi_tracer.formulas.camera_frame import up_of
from taichi_tracer.formulas.view import without_angle
from taichi_tracer.maps import MapRenderer, find_measured
from taichi_tracer.picture.crop import crop_pixels
from taichi_tracer.progressive import ProgressiveRenderer
from taichi_tracer.renderer import A1Renderer, A3Renderer, A4Renderer
from taichi_tracer.scene_data import SceneData
from taichi_tracer.scene_data_loader import find_scene, is_document, load_scene_data, scene_of_document
from taichi_tracer.system import runtime
from taichi_tracer.system.errors import InputError
from taichi_tracer.system.registry import PARTS
from taichi_tracer.system.stopwatch import TAICHI, part
from taichi_tracer.tones.display import Display

if TYPE_CHECKING:
    from taichi_tracer.rt3.document import Document, Shot

OF_LIGHT = ("intensity", "rotation", "lookup")  # arguments of ``Environment`` beside its image
QUICK = 4  # a quick picture has a quarter of the width and of the height
Options = tuple[tuple[str, object], ...]  # names with values, of options that were given
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
        with part(TAICHI):
            runtime.init(**given(arch=self.arch, precision=self.precision), fast_math=self.fast_math)

    def words(self) -> list[str]:
        """The options that ask for the same."""
        return options_of(arch=self.arch, precision=self.precision) + ["--fast-math"] * self.fast_math


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
        plain: whether only the plain forms run.
        parts: the files of ``--parts``, which are loaded already.
        up_axis: which axis points upwards, "y" or "z".
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
    plain: bool
    machine: MachineRequest
    parts: tuple[str, ...]
    up_axis: str

    def load(self) -> SceneData:
        """Start Taichi and read the scene; what the user should know about it goes to stderr."""
        self.machine.start()
        options = {"brdfs": self.brdfs, "lights": self.lights, "fast": not self.plain, "up_axis": self.up_axis}
        names = ("intersector", "triangle_test", "effects", "smooth", "lamp_choice")
        options |= given(**{name: getattr(self, name) for name in names}, two_sided_lamps=self.two_sided_lamps)
        if not self.is_usual:
            options["environment"] = None if self.environment is None else self.environment.load()
        if self.document is None:
            scene = load_scene_data(self.name, **options)
        else:
            scene = scene_of_document(self.document, **options)
        if self.is_usual and scene.effects.is_dark:
            scene.set_environment(self.environment.load())
        for text in scene.notes:
            note(text)
        return scene

    def words(self) -> list[str]:
        """The options that make this scene, but for its name and that of its environment."""
        words = [word for path in self.parts for word in ("--parts", path)]
        words += options_of(intersector=self.intersector, triangle_test=self.triangle_test, effects=self.effects)
        words += [] if self.environment is None else options_of(**self.environment.options)
        words += options_of(brdfs=",".join(self.brdfs) or None, lights=",".join(self.lights) or None)
        words += options_of(smooth=self.smooth)
        words += ["--up-axis", self.up_axis] * (self.up_axis != "y")
        words += options_of(lamp_choice=self.lamp_choice) + ["--two-sided-lamps"] * self.two_sided_lamps
        return words + ["--plain"] * self.plain + self.machine.words()


def options_of(**values) -> list[str]:
    """The words that give these values to the options of the same names; nothing for None."""
    options = {f"--{name.replace('_', '-')}": value for name, value in given(**values).items()}
    return [word for option, value in options.items() for word in (option, str(value))]


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
    adaptive: bool
    first_sample: int


@dataclass(frozen=True)
class PictureRequest:
    """One picture that is asked for: by a scene file, and by the command line, which wins.

    Attributes:
        width, height: pixels of the whole frame.
        crop_window: (x0, x1, y0, y1), the part that is rendered, in fractions of the frame.
        views: what to show, one picture each.
        names_view: whether the command line says what to show.
        spp: samples per pixel.
        shot: what the scene file says; None for a mesh.
        filename: where the scene file wants it; None where it says nothing, or something else is shown.
        display: exposure and tone curve, for what shows light or colour.
        max_distance: what the view of the distance shows white; None is what fits the scene.
        paths, weights: what is asked of ``PathSettings``, and of ``A3Renderer.set_weights``.
        map_of: the name of what maps of work measure; None is what they usually measure.
    """

    width: int
    height: int
    crop_window: tuple[float, ...]
    views: tuple[View, ...]
    names_view: bool
    spp: int
    shot: "Shot | None"
    filename: str | None
    camera: CameraRequest
    samples: SamplesRequest
    display: Display
    max_distance: float | None
    map_of: str | None
    paths: Options
    weights: Options

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
        if isinstance(renderer, MapRenderer) and self.map_of is not None:
            renderer.of = self.map_of
        if isinstance(renderer, A4Renderer | MapRenderer):
            renderer.path_settings.set(**dict(self.paths))
        if isinstance(renderer, A3Renderer):
            renderer.set_weights(**dict(self.weights))
        if self.shot is not None and hasattr(renderer, "set_values"):  # the renderer of RT3 has it
            renderer.set_values(self.shot.integrator)
        if self.max_distance is not None and isinstance(renderer, A1Renderer):
            renderer.max_distance = self.max_distance
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
    asked = environment_of(args, document)
    is_usual = asked is None and needs_light and args.environment is None and not args.lights
    return taken(
        SceneRequest,
        args,
        name=args.scene,
        document=document,
        environment=EnvironmentRequest(LIGHT, args.intensity, args.rotation, args.lookup) if is_usual else asked,
        is_usual=is_usual,
        machine=taken(MachineRequest, args),
        up_axis=up_axis_of(args),
    )


def asked(args: Namespace, *names: str) -> Options:
    """The options of these names that are given, with their values."""
    return tuple((name, getattr(args, name)) for name in names if getattr(args, name) is not None)


def up_axis_of(args: Namespace) -> str:
    """Which axis of the scene points upwards; an InputError for a name that is none."""
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
    return tuple(_picture_of(args, shot) for shot in ([None] if document is None else document.shots))


def _picture_of(args: Namespace, shot: "Shot | None") -> PictureRequest:
    (width, height), view, spp, window, filename = size(PICTURE_SIZE), VIEW, 1, WHOLE, None
    if shot is not None:
        width, height, integrator, spp = shot.film.width, shot.film.height, shot.integrator, shot.integrator.spp
        view = integrator.estimator if integrator.name == "direct" else integrator.name
        window, filename = shot.film.crop_window, shot.film.filename
    if args.size is not None:
        width, height = args.size
    if args.quick:
        width, height = max(1, width // QUICK), max(1, height // QUICK)
    picture = taken(
        PictureRequest,
        args,
        width=width,
        height=height,
        crop_window=window if args.crop is None else tuple(args.crop),
        views=find_views(view if args.view is None else args.view),
        names_view=args.view is not None,
        spp=spp if args.spp is None else args.spp,
        shot=shot,
        filename=filename if args.view is None else None,
        camera=taken(CameraRequest, args),
        samples=taken(SamplesRequest, args),
        display=Display(args.exposure, args.tone),
        map_of=None if args.map_of is None else find_measured(args.map_of),
        paths=asked(args, "max_bounces", "rr_start_bounce", "rr_termination_probability", "roulette"),
        weights=asked(args, "mis_plight", "mis_pbrdf"),
    )
    if not picture.display.is_plain and not any(integrator.srgb for _, integrator in picture.views):
        shown = ", ".join(integrator.name for _, integrator in picture.views)
        advice = "give what shows light, as with --estimator mis"
        raise InputError(f"{picture.display}: {shown} shows data, which neither of them changes: {advice}")
    crop_pixels(picture.crop_window, width, height)  # a window without pixels is an error before any work is done
    return picture
