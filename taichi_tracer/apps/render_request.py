"""What ``taichi-tracer render`` is asked for: pictures, places that are known to be writable, and when to stop."""

from argparse import Namespace
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from taichi_tracer.apps.options import BY_BOUNCE, OPTIONS, words_of
from taichi_tracer.apps.requests import PictureRequest, SceneRequest, scene_and_pictures_of
from taichi_tracer.apps.words import PICTURE_FOLDER, note, request_from
from taichi_tracer.files.disk import make_folder
from taichi_tracer.files.images import EIGHT_BITS, HAVE_CHANNELS, check_writable
from taichi_tracer.integrators.path_settings import DEFAULTS, Bounces, check_bounces, check_terms, name_of
from taichi_tracer.picture.aovs import Aov, channel_names, find_aovs
from taichi_tracer.picture.denoised import SAMPLER, Changed, check_clamp, denoiser
from taichi_tracer.progressive import ProgressiveRenderer
from taichi_tracer.renderer import A4Renderer
from taichi_tracer.system.errors import InputError
from taichi_tracer.tones.display import Display
from taichi_tracer.values import VALUES


@dataclass(frozen=True)
class RenderRequest:
    """The pictures of a scene that are to be made, where they go, and when to stop.

    Attributes:
        output: a file or a folder; None is where the scene file says, or ``PICTURE_FOLDER``.
        bounces: (first, last) of the light that each picture counts, see ``PathSettings``; empty is one picture of all.
        checkpoint: a file to go on from, and to keep samples in every ``checkpoint_every`` seconds; or None.
        aovs: the raw arrays that each file has beside its picture.
        denoise: whether what a denoiser makes of the picture is written.
        clamp: how many times as bright as its brightest neighbour a pixel may be that is written; None for any.
        profile: whether a table tells where the time went.
    """

    scene: SceneRequest
    pictures: tuple[PictureRequest, ...]
    output: str | None
    bounces: tuple[Bounces, ...]
    checkpoint: str | None
    checkpoint_every: float
    aovs: tuple[Aov, ...]
    denoise: bool
    clamp: float | None
    profile: bool

    def changed(self, renderer: ProgressiveRenderer) -> Changed | None:
        """What is written in place of the picture, with its error; None where the picture is."""
        if self.clamp is not None:
            return renderer.clamped(self.clamp)
        return renderer.denoised() if self.denoise else None


def render_of(args: Namespace) -> RenderRequest:
    """What the options of ``render`` ask for."""
    if args.denoise and args.clamp is not None:
        raise InputError("--denoise and --clamp: one of them can be told from the samples at a time")
    if args.denoise:
        denoiser()  # so that an installation without it says so at once
    if args.clamp is not None:
        check_clamp(args.clamp)
    if args.denoise or args.clamp is not None:
        args.sampler = args.sampler or SAMPLER
    scene, pictures = scene_and_pictures_of(args)
    note_unused(args, pictures)
    if args.bounces:
        check_pictures_by_bounce(args, pictures)
    return request_from(RenderRequest, args, scene=scene, pictures=pictures, aovs=find_aovs(args.aov))


def note_unused(args: Namespace, pictures: Sequence[PictureRequest]) -> None:
    """Tell the user which options change nothing, because no picture has the value that they change."""
    views = [view for picture in pictures for view in picture.views]
    for option in (one for one in OPTIONS.values() if one.value and one is not BY_BOUNCE):
        value, words = VALUES[option.value], words_of(**{option.name: getattr(args, option.name)})
        shown = [one.name for renderer_class, one in views if option.value in renderer_class.value_names]
        if words and (not shown or value.of not in ("", *shown)):
            note(f"{' '.join(words)} changes nothing here: it belongs to {value.owner}")


def check_pictures_by_bounce(args: Namespace, pictures: Sequence[PictureRequest]) -> None:
    """Raise an InputError unless there are pictures for ``--bounces`` that can be added up."""
    for picture in pictures:
        for renderer_class, integrator in picture.views:
            if not issubclass(renderer_class, A4Renderer):
                raise InputError(f"--bounces needs paths, and {integrator.name} has none: use --estimator path")
        for one in args.bounces:
            check_bounces(one)
        check_terms(args.bounces, dict(picture.values).get("max_bounces", DEFAULTS["max_bounces"]))
    if len(args.bounces) > 1:
        given = [name for name in ("time", "error", "adaptive") if getattr(args, name)]
        if given:
            advice = "give --spp alone"
            raise InputError(f"--bounces takes the same samples for each picture, --{given[0]} does not: {advice}")


# ── where the pictures go ──


@dataclass(frozen=True)
class Places:
    """Where the pictures of one view go.

    Attributes:
        pictures: one path, or one for each member of ``RenderRequest.bounces``.
        sheet: where a contact sheet of them goes, or None.
    """

    pictures: tuple[Path, ...]
    sheet: Path | None = None


def paths_of(request: RenderRequest) -> list[list[Places]]:
    """Where each view of each picture goes: where ``-o`` says, or the scene file; else into ``PICTURE_FOLDER``."""
    asked, output = request.pictures, request.output
    names = [(picture.filename, integrator.name) for picture in asked for _, integrator in picture.views]
    if output is None and all(filename is not None for filename, _ in names):
        paths = [Path(filename) for filename, _ in names]
        for path in paths:
            make_folder(path.parent, f"filename {path}")
    else:
        extension = HAVE_CHANNELS[0] if request.aovs else ".png"
        paths = output_paths(output, request.scene.name, [name for _, name in names], extension)
        if len(paths) > 1 or Path(output or PICTURE_FOLDER).is_dir():
            paths = [
                path.parent / Path(path.name if filename is None else filename).name
                for path, (filename, _) in zip(paths, names, strict=True)
            ]
    found = [places_of(path, request) for path in distinct(paths)]
    for places in found:
        for path in places.pictures:
            check_writable(path, channel_names(request.aovs))
        if places.sheet is not None:
            check_writable(places.sheet)
    following = iter(found)
    return [[next(following) for _ in picture.views] for picture in asked]


def places_of(path: Path, request: RenderRequest) -> Places:
    """The place of a view's picture; or of its pictures by bounce, which have the number after the name."""
    if not request.bounces:
        return Places((path,))
    pictures = tuple(path.with_stem(f"{path.stem}_bounce_{name_of(one)}") for one in request.bounces)
    if len(pictures) == 1:
        return Places((path,) if request.output is not None and Path(request.output) == path else pictures)
    return Places(pictures, path.with_name(f"{path.stem}_bounces.png"))


def distinct(paths: list[Path]) -> list[Path]:
    """The same paths, but a number after the name of each that an earlier one has."""
    free: list[Path] = []
    for path in paths:
        numbered, count = path, 1
        while numbered in free:
            count += 1
            numbered = path.with_stem(f"{path.stem}_{count}")
        free.append(numbered)
    return free


def output_paths(output: str | None, scene: str, names: list[str], extension: str = ".png") -> list[Path]:
    """Where each view goes, known to be writable before any work is done.

    Args:
        output: a file, a folder, or None for ``PICTURE_FOLDER``. Folders are made.
        scene: name or path of the scene: in a folder, files are called <scene>_<view><extension>.
        names: of the views.

    Raises:
        InputError: one file for several views, or a place that cannot be written.
    """
    folder = Path(PICTURE_FOLDER if output is None else output)
    is_folder = output is None or output.endswith(("/", "\\")) or folder.is_dir()
    if len(names) > 1 and not is_folder:
        if folder.suffix != "":
            raise InputError(f"-o {output} is one file for {len(names)} views: give a folder, such as renders/")
        is_folder = True
    paths = [folder]
    if is_folder:
        make_folder(folder, f"-o {output}")
        paths = [folder / f"{Path(scene).stem}_{name}{extension}" for name in names]
    for path in paths:
        check_writable(path)
    return paths


def note_linear(display: Display, paths: Sequence[Path]) -> None:
    """Tell the user which files keep linear values although an exposure or a tone curve was asked for."""
    linear = [str(path) for path in paths if path.suffix.lower() not in EIGHT_BITS]
    if linear and not display.is_plain:
        note(f"{', '.join(linear)}: linear, without {display}: these change only {' '.join(EIGHT_BITS)}")
