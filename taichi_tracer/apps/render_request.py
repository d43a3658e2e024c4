"""What ``render`` must know before it renders: which options change nothing, and places that can be written."""

from argparse import Namespace
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

from taichi_tracer.apps.notes import PICTURE_FOLDER, note
from taichi_tracer.apps.pictures import Request, request_of
from taichi_tracer.files.disk import make_folder
from taichi_tracer.files.images import EIGHT_BITS, HAVE_CHANNELS, check_writable
from taichi_tracer.integrators.path_settings import DEFAULTS, check_bounces, check_terms
from taichi_tracer.picture.aovs import channel_names, find_aovs
from taichi_tracer.picture.denoised import SAMPLER, check_clamp, denoiser
from taichi_tracer.renderer import A4Renderer
from taichi_tracer.settings import OPTIONS, RenderSettings, name_of_bounces, words_of
from taichi_tracer.system.errors import InputError
from taichi_tracer.tones.display import Display


def render_of(args: Namespace) -> Request:
    """What the options of ``render`` ask for."""
    settings = RenderSettings.of(args)
    if args.denoise and args.clamp is not None:
        raise InputError("--denoise and --clamp: one of them can be estimated from the samples at a time")
    if args.denoise:
        denoiser()  # so that an installation without it says so at once
    if args.clamp is not None:
        check_clamp(args.clamp)
    if args.denoise or args.clamp is not None:
        settings = replace(settings, sampler=settings.sampler or SAMPLER)
    find_aovs(args.aov)
    request = request_of(settings)
    note_unused(request)
    if settings.bounces:
        check_pictures_by_bounce(request)
    return request


def note_unused(request: Request) -> None:
    """Note which options change nothing, because no picture has the value that they change."""
    views = [view for picture in request.pictures for view in picture.views]
    for name in request.settings.changed():
        option = OPTIONS.get(name)
        if option is None or not option.value or name == "bounces":
            continue
        shown = [one.name for renderer_class, one in views if option.value in renderer_class.value_names]
        if not shown or option.of not in ("", *shown):
            words = " ".join(words_of(name, getattr(request.settings, name)))
            note(f"{words} changes nothing here: it belongs to {option.owner}")


def check_pictures_by_bounce(request: Request) -> None:
    """Raise an InputError unless there are pictures for ``--bounces`` that can be added up."""
    settings = request.settings
    for picture in request.pictures:
        for renderer_class, integrator in picture.views:
            if not issubclass(renderer_class, A4Renderer):
                raise InputError(f"--bounces needs paths, and {integrator.name} has none: use --estimator path")
        for one in settings.bounces:
            check_bounces(one)
        check_terms(settings.bounces, picture.values.get("max_bounces", DEFAULTS["max_bounces"]))
    if len(settings.bounces) > 1:
        given = [name for name in ("time", "error", "adaptive") if getattr(settings, name)]
        if given:
            advice = "give --spp alone"
            raise InputError(f"--bounces takes the same samples for each picture, --{given[0]} does not: {advice}")


# ── where the pictures go ──


@dataclass(frozen=True)
class Places:
    """Where the pictures of one view go.

    Attributes:
        pictures: one path, or one for each member of ``RenderSettings.bounces``.
        sheet: where a contact sheet of them goes, or None.
    """

    pictures: tuple[Path, ...]
    sheet: Path | None = None


def paths_of(request: Request, args: Namespace) -> list[list[Places]]:
    """Where each view of each picture goes: where ``-o`` says, or the scene file; else into ``PICTURE_FOLDER``."""
    asked, output, bounces = request.pictures, args.output, request.settings.bounces
    channels = channel_names(find_aovs(args.aov))
    names = [(picture.filename, integrator.name) for picture in asked for _, integrator in picture.views]
    if output is None and all(filename is not None for filename, _ in names):
        paths = [Path(filename) for filename, _ in names]
        for path in paths:
            make_folder(path.parent, f"filename {path}")
    else:
        extension = HAVE_CHANNELS[0] if args.aov else ".png"
        paths = output_paths(output, request.settings.scene, [name for _, name in names], extension)
        if len(paths) > 1 or Path(output or PICTURE_FOLDER).is_dir():
            paths = [
                path.parent / Path(path.name if filename is None else filename).name
                for path, (filename, _) in zip(paths, names, strict=True)
            ]
    found = [places_of(path, bounces, output) for path in distinct(paths)]
    for places in found:
        for path in places.pictures:
            check_writable(path, channels)
        if places.sheet is not None:
            check_writable(places.sheet)
    following = iter(found)
    return [[next(following) for _ in picture.views] for picture in asked]


def places_of(path: Path, bounces: Sequence, output: str | None) -> Places:
    """The place of a view's picture; or of its pictures by bounce, which have the number after the name."""
    if not bounces:
        return Places((path,))
    pictures = tuple(path.with_stem(f"{path.stem}_bounce_{name_of_bounces(one)}") for one in bounces)
    if len(pictures) == 1:
        return Places((path,) if output is not None and Path(output) == path else pictures)
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
