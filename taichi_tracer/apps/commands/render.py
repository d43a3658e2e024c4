"""Write pictures of a scene."""

import contextlib
import math
import sys
import time
from argparse import Namespace
from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from tqdm import tqdm

from taichi_tracer.apps.console import CLUSTER, PICTURE_FOLDER, Parser, add_cluster_option, load, note
from taichi_tracer.apps.pictures import Picture, Request, request_of
from taichi_tracer.apps.running import Interruption, written, written_bytes
from taichi_tracer.files.disk import check_place, make_folder
from taichi_tracer.files.images import EIGHT_BITS, check_writable, encode_png, save_image
from taichi_tracer.integrators.path_settings import DEFAULTS, Bounces, check_terms
from taichi_tracer.picture.aovs import channel_names, find_aovs
from taichi_tracer.picture.checkpoint import EXTENSION
from taichi_tracer.picture.denoised import SAMPLER, check_clamp, denoiser, no_halves
from taichi_tracer.picture.error_estimate import percent
from taichi_tracer.picture.progress import Progress, Target
from taichi_tracer.progressive import ProgressiveRenderer
from taichi_tracer.renderer import A4Renderer
from taichi_tracer.scene_data import SceneData
from taichi_tracer.settings import (
    BY_BOUNCE,
    DISPLAY,
    KEEPING,
    OF_PICTURE,
    OF_SCENE,
    OPTIONS,
    TARGET,
    RenderSettings,
    add_scene,
    name_of_bounces,
    words_of,
)
from taichi_tracer.system import compiling, stopwatch
from taichi_tracer.system.argument_types import names, number
from taichi_tracer.system.errors import IncompleteError, InputError
from taichi_tracer.system.importing import import_quickly
from taichi_tracer.system.parts import PARTS
from taichi_tracer.system.stopwatch import READ, stage
from taichi_tracer.tones.display import Display, fitting_exposure, share_in_the_dark

GOOD = 0.05  # an error: pictures that are worse, and for which nobody asked when they end, get a note
VISIBLE = LEAST_SHOWN = 1 / 255  # of a difference from the reference; less is not made white
MOSTLY_DARK = 0.9  # of the pixels with light: from so many on that cannot be seen, another exposure is advised
MOST_PLACES = 3  # of samples that are not finite: how many are printed
SHOW_PROGRESS_AFTER = 1.0  # seconds: shorter work is over before a bar could be read
BAR = "{desc} {percentage:3.0f}%|{bar}| {postfix}"
SHORTEST = 1e-9  # seconds: keeps the share that is done a number before anything was timed
# On a cluster: a renderer, and the number of the picture → what takes the place of ``renderer.render``.
RendersElsewhere = Callable[[ProgressiveRenderer, int], Callable[..., object]]


def add_arguments(parser: Parser) -> None:
    """Add what ``render`` takes."""
    add_scene(parser, *OF_SCENE, *OF_PICTURE, DISPLAY, BY_BOUNCE, TARGET, KEEPING)
    add_cluster_option(parser, "take the samples")
    parser.add_argument(
        "-o",
        "--output",
        metavar="FILE",
        help="picture to write, or a folder; its ending says the format (default: the scene file's, or "
        f"{PICTURE_FOLDER}/SCENE_VIEW.png)",
    )
    parser.add_argument(
        "--aov",
        type=names,
        default=(),
        metavar="A,B",
        help="raw arrays that an .exr file has beside the picture, such as the distance: names with commas",
    )
    parser.add_argument(
        "--against",
        choices=("reference",),
        help="with --course: render every picture with the package's own methods, too, and write the difference: "
        "FILE_against_reference.png",
    )
    changes = parser.add_mutually_exclusive_group()  # one of them can be estimated from the samples at a time
    changes.add_argument(
        "--denoise",
        action="store_true",
        help="write what Open Image Denoise (the extra 'denoise') makes of the picture, and tell what error this has; "
        "the sampler is then niederreiter_two",
    )
    changes.add_argument(
        "--clamp",
        type=number,
        metavar="FACTOR",
        help="cut fireflies: no pixel of the file is brighter than FACTOR times the brightest of its eight neighbours; "
        "the bias that this adds is printed, and the sampler is then niederreiter_two",
    )
    parser.add_argument(
        "--profile",
        action="store_true",
        help="tell where the time goes, from the start of Python to the file, in a table",
    )


def run(args: Namespace, elsewhere: RendersElsewhere | None = None) -> int:
    """Render and write every view that was asked for.

    Args:
        elsewhere: who takes the samples on other machines; None takes them here.

    Returns:
        0; or, when a signal ended it with what was done by then, 128 and the number of the signal: 130 for Ctrl-C.
    """
    if args.cluster is not None and args.profile:
        raise InputError("--profile measures the process that renders, and on a cluster others do: not --cluster")
    if args.cluster is not None and elsewhere is None:
        return load(CLUSTER)(args, run)
    request = render_of(args)
    paths = paths_of(request, args)
    check_single(args, len(paths) * max(1, len(request.settings.bounces)))
    note_linear(request.pictures[0].display, [path for files in paths for path in files])
    if args.profile:
        from taichi_tracer.studies.tables import profile

        watch = stopwatch.start(args.started)
    scene, before = load_scene(request, args.started)
    renderer, settings = None, None
    for k, (picture, files) in enumerate(zip(request.pictures, paths, strict=True)):
        if picture.renderer_class is type(renderer) and picture.settings is settings:  # of the same film
            renderer.use(picture.integrator.name)
        else:
            with stage(stopwatch.FILM):
                renderer, settings = picture.make_renderer(scene), picture.settings
        shown = []
        for path, bounces in zip(files, request.settings.bounces or (None,), strict=False):
            if bounces is not None:
                renderer.bounces = bounces
            render = renderer.render if elsewhere is None else elsewhere(renderer, k)
            renderer.reset()
            with Interruption(lambda of=renderer: of.samples > 0) as interruption:
                make_picture(renderer, picture, args, path, before, interruption, render)
            if interruption.number is not None:
                of = "" if args.spp is None else f" of {args.spp}"
                print(f"taichi-tracer: {interruption.word} after {renderer.samples}{of} samples", file=sys.stderr)
                return interruption.exit_code
            if args.against is not None:
                write_against(renderer, picture, request, path)
            shown.append(renderer.film.own_pixels(renderer.image()))
        if len(shown) > 1:
            write_sheet(shown, request.settings.bounces, files[-1], picture)
    if args.profile:
        stopwatch.stop()
        print("\n".join(profile(watch, compiling.kernels(watch.started))), flush=True)
    return 0


def check_single(args: Namespace, count: int) -> None:
    """Raise an InputError for what can be done with one picture only, or for a checkpoint that cannot be written."""
    for name in ("checkpoint", "profile"):
        if getattr(args, name) and count > 1:
            raise InputError(f"--{name} belongs to one picture, not to {count}: ask for one")
    check_place(args.checkpoint)


def write_against(renderer: ProgressiveRenderer, picture: Picture, request: Request, path: Path) -> None:
    """Write how a picture of a student's files differs from the package's own."""
    course = import_quickly("taichi_tracer.course.use").in_use()
    if course is None:
        raise InputError("--against reference compares with the files of --course FOLDER: give this, too")

    def rendered() -> np.ndarray:
        return np.asarray(picture.make_renderer(request.load()).render(renderer.samples).image())

    with course.reference():
        expected = rendered()
    difference = np.abs(np.asarray(renderer.image()) - expected)
    factor = 1 / max(float(difference.max()), LEAST_SHOWN)
    place = path.with_name(f"{path.stem}_against_reference.png")
    place = written_bytes(place, encode_png(difference * factor, srgb=False))
    what = f"the difference from the reference is {described_difference(difference)}"
    print(f"{place}: {what}; it is shown {factor:.3g} times as bright", flush=True)
    if difference.max() > VISIBLE:
        for file in course.files:
            with course.only(file):
                print(f"  {file} alone: {described_difference(np.abs(rendered() - expected))}", flush=True)


def described_difference(difference: np.ndarray) -> str:
    """How much a picture differs from the reference."""
    differs = (difference > VISIBLE).any(axis=-1)
    of = f"{differs.sum():,} of {differs.size:,} pixels differ by more than 1/255"
    return f"at most {difference.max():.3g}, {difference.mean():.3g} on average; {of}"


def write_sheet(images: list[np.ndarray], bounces: Sequence[Bounces], path: Path, picture: Picture) -> None:
    """Write pictures by bounce and their sum side by side, all with the same exposure."""
    sheet = np.hstack([*images, sum(images)])
    place = written_bytes(path, encode_png(sheet, picture.is_encoded, picture.display))
    print(f"{place}: bounces {', '.join(map(name_of_bounces, bounces))}, and their sum", flush=True)


def make_picture(
    renderer: ProgressiveRenderer,
    picture: Picture,
    args: Namespace,
    path: Path,
    before: str,
    interruption: Interruption,
    render: Callable[..., object],
) -> None:
    """Render and write a picture, as far as it came.

    Args:
        before: how long everything before took, in words.
        render: ``renderer.render``, or what takes its place.

    Raises:
        InputError: the rendering ended before its targets; what came is written, and the message says how to go on.
    """
    channels = renderer.channels(args.aov)  # first, because the picture may take hours
    try:
        add_samples(renderer, picture.target, interruption, render, args.checkpoint, args.checkpoint_every)
    except IncompleteError as error:
        how = "nothing has come yet: run the same command again"
        if renderer.samples > 0:
            place = written(Path(args.checkpoint or path.with_suffix(EXTENSION)), renderer.save_checkpoint)
            how = f"they are kept: to go on, run the same command again, with --checkpoint {place}"
        raise InputError(f"{error} after {renderer.samples} samples: {how}") from None
    finally:
        if renderer.samples > 0:
            with stage(stopwatch.WRITE, waits=True):
                changed = renderer.denoised() if args.denoise else None
                changed = changed if args.clamp is None else renderer.clamped(args.clamp)
                image = renderer.film.own_pixels(renderer.image() if changed is None else changed.image)
                encoding = encoding_of(renderer, picture)
                place = written(path, lambda one: save_image(one, image, channels=channels, **encoding))
            times = f"{before}, {describe_times(renderer)}, total {time.perf_counter() - args.started:.2f} s"
            what = describe(renderer, image) if changed is None else f"{describe_size(renderer, image)}, {changed}"
            print(f"{place}: {what} ({times})", flush=True)
            add_notes(renderer, image, place, picture.target, interruption)


def encoding_of(renderer: ProgressiveRenderer, picture: Picture) -> dict[str, Any]:
    """How the picture of a renderer is written."""
    return renderer.encoding | {"srgb": renderer.srgb and picture.is_encoded}


def load_scene(request: Request, started: float) -> tuple[SceneData, str]:
    """A scene, and in words how long the start of the program and reading the scene took.

    Args:
        started: the value of ``time.perf_counter`` at the key press.
    """
    start = time.perf_counter()
    with stage(READ, waits=True):
        loaded = request.load(any(picture.is_long for picture in request.pictures))
    return loaded, f"start {start - started:.2f} s, scene {time.perf_counter() - start:.2f} s"


def add_notes(
    renderer: ProgressiveRenderer, image: np.ndarray, path: Path, target: Target, interruption: Interruption
) -> None:
    """Lines on what is wrong with a picture, and what would make it better."""
    if renderer.non_finite > 0:  # they are left out (C-20)
        found = renderer.film.non_finite_samples()[:MOST_PLACES]
        places = ", ".join(f"pixel ({x}, {y}) sample {i}" for x, y, i in found)
        note(f"{renderer.non_finite} samples were not finite, not added: {places}")
    progress = renderer.progress
    has_ended = renderer.is_random and progress.samples > 0 and interruption.number is None
    if target.error is not None and has_ended and not progress.has_reached_error:
        limits = [f"--{name} {getattr(target, name):g}" for name in ("spp", "time") if getattr(target, name)]
        note(f"an error of {percent(target.error)} was not reached: {' or '.join(limits)} came first")
    if target.is_usual and renderer.samples > 1 and (error := renderer.error()) > GOOD:
        # The square of the error falls as 1/n with n samples.
        seconds = progress.seconds_per_sample * renderer.samples * (error / GOOD) ** 2
        note(f"--error {100 * GOOD:g} would take about {seconds:.0f} s of rendering")
    if renderer.srgb and not renderer.has_own_display and path.suffix.lower() in EIGHT_BITS:
        share = share_in_the_dark(image, renderer.display)
        if share >= MOSTLY_DARK:
            advice = f"try --exposure {fitting_exposure(image)}"
            note(f"{share:.0%} of the pixels with light are no brighter than 1/255: {advice}")
    for text in renderer.notes():
        note(text)


def describe_size(renderer: ProgressiveRenderer, image: np.ndarray) -> str:
    """Size and samples."""
    of_pixels = " on average" if renderer.shares.are_uneven else ""
    return f"{image.shape[1]}x{image.shape[0]}, {renderer.samples} spp{of_pixels}"


def describe(renderer: ProgressiveRenderer, image: np.ndarray) -> str:
    """Size, samples, and the error where there is one."""
    text, progress = describe_size(renderer, image), renderer.progress
    if not renderer.jitter or renderer.samples < 2:
        return text
    error = progress.error if progress.has_reached_error else renderer.error()
    return text if math.isnan(error) else f"{text}, error {error}"


def describe_times(renderer: ProgressiveRenderer) -> str:
    """How long compiling and rendering took."""
    progress = renderer.progress
    if progress.samples == 0:
        return "no more samples were needed"
    return f"compiling {progress.compile_seconds:.2f} s, rendering {progress.seconds:.2f} s"


# ── samples are added while a bar grows, and are kept in a checkpoint ──


class RenderingStopped(Exception):
    """The rendering was interrupted after a whole sample."""


def add_samples(
    renderer: ProgressiveRenderer,
    target: Target,
    interruption: Interruption,
    render: Callable[..., object],
    checkpoint: str | None = None,
    every: float = math.inf,
) -> None:
    """Render until a target is reached or a signal came.

    Args:
        render: ``renderer.render``, or what takes its place.
        checkpoint: a file to go on from if it exists, and to which the samples go in the end. every: seconds after
            which they go there, too; a disk that is full then may have room by the next time.
    """
    spp, kept_at = target.spp, time.perf_counter()
    if checkpoint is not None and Path(checkpoint).exists():
        renderer.load_checkpoint(checkpoint)
        print(f"{checkpoint}: going on after {renderer.samples} samples")
        spp = None if spp is None else spp - renderer.samples
        if spp is not None and spp <= 0:
            return
    options = {"desc": renderer.active.name, "disable": None, "delay": SHOW_PROGRESS_AFTER, "leave": False}
    with tqdm(total=1.0, bar_format=BAR, **options) as bar, contextlib.suppress(RenderingStopped):

        def watch(progress: Progress) -> None:
            """After each sample: bring the bar up to date, keep a checkpoint if it is due, and stop after a signal."""
            nonlocal kept_at
            show_progress(bar, progress, renderer.samples)
            if checkpoint is not None and renderer.samples > 0 and time.perf_counter() - kept_at > every:
                kept_at = time.perf_counter()
                try:
                    renderer.save_checkpoint(checkpoint)
                except InputError as error:
                    note(f"{error}: rendering goes on")
            if interruption.number is not None:
                raise RenderingStopped

        render(spp=spp, time=target.time, error=target.error, watch=watch)
    if checkpoint is not None and renderer.samples > 0:
        with stage(stopwatch.WRITE):
            written(Path(checkpoint), renderer.save_checkpoint)


def show_progress(bar: tqdm, progress: Progress, samples: int) -> None:
    """Bring a bar up to date: samples, seconds, error, seconds left."""
    left, error = progress.seconds_left, f"error {percent(progress.error)}"
    rest = f"{left:.1f} s left" if left >= 0 else "? left"
    texts = [f"{samples} spp", f"{progress.seconds:.1f} s", progress.place, error, rest]
    bar.set_postfix_str(", ".join(filter(None, texts)), refresh=False)
    if left >= 0:
        bar.update(max(0.0, progress.seconds / max(progress.seconds + left, SHORTEST) - bar.n))


# ── before the rendering: which options change nothing, and places that can be written ──


def render_of(args: Namespace) -> Request:
    """What the options of ``render`` ask for."""
    settings = RenderSettings.of(args)
    if args.denoise:
        denoiser()  # so that an installation without it says so at once
    if args.clamp is not None:
        check_clamp(args.clamp)
    if args.denoise or args.clamp is not None:
        settings = replace(settings, sampler=settings.sampler or SAMPLER)
        sampler = PARTS.find("sampler", settings.sampler)
        if settings.spp == 1 or not sampler.replicated:
            raise no_halves("--denoise" if args.denoise else "--clamp", sampler)
    find_aovs(args.aov)
    request = request_of(settings)
    note_unused(request)
    if settings.bounces:
        check_pictures_by_bounce(request)
    return request


def note_unused(request: Request) -> None:
    """Note which options change nothing, because no picture has the value that they change."""
    for name in request.settings.changed():
        option = OPTIONS.get(name)
        if option is None or not option.value or name == "bounces":
            continue
        shown = [one.integrator.name for one in request.pictures if option.value in one.renderer_class.value_names]
        if not shown or option.of not in ("", *shown):
            words = " ".join(words_of(name, getattr(request.settings, name)))
            note(f"{words} changes nothing here: it belongs to {option.owner}")


def check_pictures_by_bounce(request: Request) -> None:
    """Raise an InputError unless there are pictures for ``--bounces`` that can be added up."""
    settings = request.settings
    for picture in request.pictures:
        if not issubclass(picture.renderer_class, A4Renderer):
            name = picture.integrator.name
            raise InputError(f"--bounces needs paths, and {name} has none: use --estimator path")
        check_terms(settings.bounces, picture.values.get("max_bounces", DEFAULTS["max_bounces"]))
    if len(settings.bounces) > 1:
        given = [name for name in ("time", "error", "adaptive") if getattr(settings, name)]
        if given:
            advice = "give --spp alone"
            raise InputError(f"--bounces takes the same samples for each picture, --{given[0]} does not: {advice}")


# ── where the pictures go ──


def paths_of(request: Request, args: Namespace) -> list[list[Path]]:
    """The files of each picture: where ``-o`` says, or the scene file; else in ``PICTURE_FOLDER``. Folders are made.

    In a folder, a file has the name that the scene file says, or SCENE_VIEW.png; a number follows where another one
    has this name already.

    Raises:
        InputError: one file for several views, or a place that cannot be written.
    """
    pictures, output = request.pictures, args.output
    folder, ending = Path(PICTURE_FOLDER if output is None else output), ".exr" if args.aov else ".png"
    is_folder = output is None or output.endswith(("/", "\\")) or folder.is_dir()
    if is_folder or (len(pictures) > 1 and folder.suffix == ""):
        stem = Path(request.settings.scene).stem
        paths = [Path(one.filename or f"{stem}_{one.integrator.name}{ending}") for one in pictures]
        if output is not None or any(one.filename is None for one in pictures):
            paths = [folder / path.name for path in paths]
        for path in paths:
            make_folder(path.parent, f"-o {output}" if output else str(path))
    elif len(pictures) == 1:
        paths = [folder]
    else:
        raise InputError(f"-o {output} is one file for {len(pictures)} views: give a folder, such as renders/")
    for i, path in enumerate(paths):
        count = 1
        while paths[i] in paths[:i]:
            count += 1
            paths[i] = path.with_stem(f"{path.stem}_{count}")
        check_writable(paths[i], channel_names(find_aovs(args.aov)))
    found = [files_of(path, request.settings.bounces, output) for path in paths]
    check_place(*(path for files in found for path in files))
    return found


def files_of(path: Path, bounces: Sequence, output: str | None) -> list[Path]:
    """The file of a view's picture; or those of its pictures by bounce and, if there are several, of their sheet."""
    if not bounces or (len(bounces) == 1 and output is not None and Path(output) == path):
        return [path]
    pictures = [path.with_stem(f"{path.stem}_bounce_{name_of_bounces(one)}") for one in bounces]
    return pictures if len(pictures) == 1 else [*pictures, path.with_name(f"{path.stem}_bounces.png")]


def note_linear(display: Display, paths: Sequence[Path]) -> None:
    """Tell the user which files keep linear values although an exposure or a tone curve was asked for."""
    linear = [str(path) for path in paths if path.suffix.lower() not in EIGHT_BITS]
    if linear and not display.is_plain:
        note(f"{', '.join(linear)}: linear, without {display}: these change only {' '.join(EIGHT_BITS)}")
