"""``taichi-tracer render``: pictures into files."""

import math
import signal
import sys
import time
from argparse import Namespace
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Protocol

import numpy as np

from taichi_tracer.apps.contact_sheet import contact_sheet
from taichi_tracer.apps.interruption import Interruption
from taichi_tracer.apps.requests import PictureRequest, SceneRequest, scene_and_pictures_of
from taichi_tracer.apps.rescue import written, written_bytes, written_picture
from taichi_tracer.apps.words import PICTURE_FOLDER, USER_ERROR, note
from taichi_tracer.assignments import A4Renderer
from taichi_tracer.files import checkpoint
from taichi_tracer.files.disk import check_place, make_folder
from taichi_tracer.files.images import EIGHT_BITS, HAVE_CHANNELS, check_writable, to_bytes
from taichi_tracer.integrators.path_settings import DEFAULTS, Bounces, check_bounces, check_terms, in_words, name_of
from taichi_tracer.picture.aovs import Aov, channel_names, find_aovs
from taichi_tracer.picture.checkpoint import NOT_ADAPTIVE
from taichi_tracer.picture.error_estimate import percent
from taichi_tracer.picture.progress import Progress, two_digits
from taichi_tracer.renderer import ProgressiveRenderer
from taichi_tracer.scene_data import SceneData
from taichi_tracer.system import compiling, stopwatch
from taichi_tracer.system.errors import IncompleteError, InputError
from taichi_tracer.system.stopwatch import READ, part
from taichi_tracer.tones.display import Display

SHOW_PROGRESS_AFTER = 1.0  # seconds: shorter work is over before a bar could be read
BAR = "{desc} {percentage:3.0f}%|{bar}| {postfix}"
WORTH_TELLING = 0.3  # seconds that a second run is spared: less is not told
SHORTEST = 1e-9  # seconds: keeps the share that is done a number before anything was timed
DISTANCE = "distance"  # the view to which --max-distance belongs
SUM = "sum"  # the caption of the last picture of a contact sheet
PROFILE = ".profile.html"  # the ending of the page that tells where the time of a picture went
MOST_PLACES = 3  # of samples that are not finite: how many are told


@dataclass(frozen=True)
class RenderRequest:
    """The pictures of a scene that are to be made, where they go, and when to stop.

    Attributes:
        output: a file or a folder; None is where the scene file says, or ``PICTURE_FOLDER``.
        spp, time, error: what ends the rendering, as for ``ProgressiveRenderer.render``. Where all are None, it is the
            samples of the picture.
        bounces: (first, last) of the light that each picture counts, see ``PathSettings``; empty is one picture of all.
        checkpoint: a file to go on from, and to keep samples in every ``checkpoint_every`` seconds; or None.
        aovs: the raw arrays that each file has beside its picture.
        profile: whether a page tells where the time went.
    """

    scene: SceneRequest
    pictures: tuple[PictureRequest, ...]
    output: str | None
    spp: int | None
    time: float | None
    error: float | None
    bounces: tuple[Bounces, ...]
    checkpoint: str | None
    checkpoint_every: float
    aovs: tuple[Aov, ...]
    profile: bool

    def samples_of(self, picture: PictureRequest) -> int | None:
        """How many samples end the rendering of a picture; None where only time or error do."""
        return picture.spp if self.spp is None and self.time is None and self.error is None else self.spp


def render_of(args: Namespace) -> RenderRequest:
    """What the options ask for."""
    scene, pictures = scene_and_pictures_of(args)
    if args.max_distance is not None and all(one.name != DISTANCE for picture in pictures for _, one in picture.views):
        note(f"--max-distance {args.max_distance:g} changes nothing here: it belongs to the view {DISTANCE!r}")
    if args.bounces:
        check_pictures_by_bounce(args, pictures)
    return RenderRequest(
        scene=scene,
        pictures=pictures,
        output=args.output,
        spp=args.spp,
        time=args.time,
        error=None if args.error is None else args.error / 100,
        bounces=args.bounces,
        checkpoint=args.checkpoint,
        checkpoint_every=args.checkpoint_every,
        aovs=find_aovs(args.aov),
        profile=args.profile,
    )


def check_pictures_by_bounce(args: Namespace, pictures: Sequence[PictureRequest]) -> None:
    """Raise an InputError unless there are pictures for ``--bounces`` that can be added up."""
    for picture in pictures:
        for renderer_class, integrator in picture.views:
            if not issubclass(renderer_class, A4Renderer):
                raise InputError(f"--bounces needs paths, and {integrator.name} has none: use --estimator path")
        for one in args.bounces:
            check_bounces(one)
        most = picture.paths.max_bounces
        check_terms(args.bounces, DEFAULTS["max_bounces"] if most is None else most)
    if len(args.bounces) > 1:
        given = [name for name in ("time", "error", "adaptive") if getattr(args, name)]
        if given:
            advice = "give --spp alone"
            raise InputError(f"--bounces takes the same samples for each picture, --{given[0]} does not: {advice}")


@dataclass(frozen=True)
class Places:
    """Where the pictures of one view go.

    Attributes:
        pictures: one path, or one for each member of ``RenderRequest.bounces``.
        sheet: where a contact sheet of them goes, or None.
    """

    pictures: tuple[Path, ...]
    sheet: Path | None = None


def run(args: Namespace, elsewhere: "Elsewhere | None" = None) -> int:
    """Render and write every view that was asked for.

    Args:
        elsewhere: who takes the samples on other machines; None takes them here.

    Returns:
        0; 2 when a file had to be written elsewhere; or, when a signal ended it with what was done by then, 128 and the
        number of the signal: 130 for Ctrl-C.
    """
    watch = stopwatch.start(args.started) if args.profile else None
    try:
        return run_watched(args, elsewhere, watch)
    finally:
        stopwatch.stop()


def run_watched(args: Namespace, elsewhere: "Elsewhere | None", watch: stopwatch.Stopwatch | None) -> int:
    """``run``, while a stopwatch runs if there is one."""
    request = render_of(args)
    paths = paths_of(request)
    if watch is not None:
        check_profile([path for views in paths for places in views for path in places.pictures])
        watch.charge(stopwatch.IMPORTS)
    for picture, views in zip(request.pictures, paths, strict=True):
        note_linear(picture.display, [path for places in views for path in places.pictures])
    if request.checkpoint is not None:
        count = sum(len(places.pictures) for views in paths for places in views)
        if count > 1:
            raise InputError(f"--checkpoint {request.checkpoint} is one file for {count} pictures: ask for one")
        if args.adaptive:
            raise InputError(f"--checkpoint {request.checkpoint}: {NOT_ADAPTIVE}: leave out one of the two")
        check_place(request.checkpoint)
    clock = Clock(args.started)
    scene = clock.load(request.scene)
    if elsewhere is not None:
        elsewhere.loaded(scene)
    is_in_place = True
    for i, (picture, views) in enumerate(zip(request.pictures, paths, strict=True)):
        made = {}
        for j, ((renderer_class, integrator), places) in enumerate(zip(picture.views, views, strict=True)):
            if renderer_class not in made:
                with part(stopwatch.FILM):
                    made[renderer_class] = picture.make_renderer(renderer_class, scene)
            renderer = made[renderer_class].use(integrator.name)
            shown = []
            for path, bounces in zip(places.pictures, request.bounces or (None,), strict=True):
                if bounces is not None:
                    renderer.bounces = bounces
                render = renderer.render if elsewhere is None else elsewhere.renders(renderer, (i, j, bounces))
                with Interruption() as interruption:
                    is_in_place &= make_picture(renderer, picture, request, path, clock, interruption, render)
                if interruption.number is not None:
                    of = "" if request.spp is None else f" of {request.spp}"
                    print(f"taichi-tracer: {interruption.word} after {renderer.samples}{of} samples", file=sys.stderr)
                    return interruption.exit_code
                if watch is not None:
                    is_in_place &= write_profile(renderer, request, path, watch)
                    continue
                shown.append(renderer.film.own_pixels(renderer.image()))
            if places.sheet is not None:
                is_in_place &= write_sheet(shown, request.bounces, places.sheet, picture)
    return 0 if is_in_place else USER_ERROR


def check_profile(pictures: Sequence[Path]) -> None:
    """Raise an InputError unless one picture is asked for, beside which its profile can be written."""
    if len(pictures) > 1:
        raise InputError(f"--profile tells where the time of one picture goes, not of {len(pictures)}: ask for one")
    check_place(profile_path(pictures[0]))


def profile_path(picture: Path) -> Path:
    """The page that belongs to a picture."""
    return picture.with_suffix(PROFILE)


def write_profile(
    renderer: ProgressiveRenderer, request: RenderRequest, path: Path, watch: stopwatch.Stopwatch
) -> bool:
    """Print and write where the time of a picture went that is done; False if the page had to go elsewhere."""
    stopwatch.stop()
    from taichi_tracer.studies.profile import as_page, described, profile_of

    title = f"{Path(request.scene.name).name}, {renderer.active.name}"
    found = profile_of(renderer, watch, title)
    print(described(found))
    place = written_bytes(profile_path(path), as_page(found).encode())
    print(f"{place}: where the time went", flush=True)
    return place == profile_path(path)


def write_sheet(images: list[np.ndarray], bounces: Sequence[Bounces], path: Path, picture: PictureRequest) -> bool:
    """Write pictures by bounce and their sum side by side, all with the same exposure; False if it went elsewhere."""
    captions = [*map(in_words, bounces), SUM]
    shown = [to_bytes(image, picture.is_encoded, picture.display) for image in (*images, sum(images))]
    place = written_bytes(path, contact_sheet(shown, captions))
    print(f"{place}: {', '.join(captions)}", flush=True)
    return place == path


def make_picture(
    renderer: ProgressiveRenderer,
    picture: PictureRequest,
    request: RenderRequest,
    path: Path,
    clock: "Clock",
    interruption: Interruption,
    render: Callable[..., object],
) -> bool:
    """Render and write a picture, as far as it came; False where something had to be written elsewhere.

    Args:
        clock: knows how long everything before took, to be told.
        render: ``renderer.render``, or what takes its place.

    Raises:
        InputError: the rendering ended before its targets; what came is written, and the message says how to go on.
    """
    renderer.reset()
    channels = renderer.channels([aov.name for aov in request.aovs])  # first, because the picture may take hours
    keeper = Keeper(renderer, request.checkpoint, request.checkpoint_every)
    incomplete = None
    try:
        add_samples(renderer, keeper, request.samples_of(picture), request, interruption, render)
    except IncompleteError as error:
        incomplete = InputError(f"{error} after {renderer.samples} samples: {keeper.kept_at_end(path)}")
    is_in_place = keeper.is_in_place
    if renderer.samples > 0:
        encoding = renderer.encoding | {"srgb": renderer.srgb and picture.is_encoded}
        with part(stopwatch.WRITE, waits=True):
            image = renderer.film.own_pixels(renderer.image())
            place = written_picture(path, image, channels, **encoding)
        times = f"{clock.before}, {describe_times(renderer)}, {clock.total(renderer)}"
        print(f"{place}: {describe(renderer, image)} ({times})", flush=True)
        report_non_finite(renderer)
        report_missed_error(renderer, interruption)
        for text in renderer.notes():
            note(text)
        is_in_place &= place == path
    if incomplete is not None:
        raise incomplete
    return is_in_place


class Elsewhere(Protocol):
    """Who takes samples on other machines."""

    def loaded(self, scene: SceneData) -> None:
        """The scene was loaded here."""

    def renders(self, renderer: ProgressiveRenderer, which: tuple) -> Callable[..., object]:
        """What takes the place of ``renderer.render``.

        Args:
            which: (number of the picture, number of its view, bounces or None).
        """


class Clock:
    """What a user waits for, from the key press on.

    Args:
        started: the value of ``time.perf_counter`` at the key press.

    Attributes:
        before: what the program took before the first picture, in words.
    """

    def __init__(self, started: float) -> None:
        self.started, self.before = started, ""
        self._saved_before = compiling.seconds_to_save()  # by other commands of this process

    def load(self, scene: SceneRequest) -> SceneData:
        """Load a scene, and remember how long that took."""
        start = time.perf_counter()
        with part(READ, waits=True):
            loaded = scene.load()
        self.before = f"start {start - self.started:.2f} s, scene {time.perf_counter() - start:.2f} s"
        return loaded

    def total(self, renderer: ProgressiveRenderer) -> str:
        """Everything until now; and what the same would take again, where kernels were compiled that are kept."""
        total, saved = time.perf_counter() - self.started, compiling.seconds_to_save() - self._saved_before
        told = f"total {total:.2f} s"
        return told if saved < WORTH_TELLING else f"{told}, a second run about {total - saved:.2f} s"


def report_missed_error(renderer: ProgressiveRenderer, interruption: Interruption) -> None:
    """A line if the rendering has ended before it reached the error that was asked for."""
    progress = renderer.progress
    target = progress.target.error
    if target is None or progress.has_reached_error or not renderer.is_random or progress.samples == 0:
        return
    if interruption.number is not None:
        return  # the user knows what has ended it
    limits = [f"--{name} {getattr(progress.target, name):g}" for name in ("spp", "time")
              if getattr(progress.target, name) is not None]  # fmt: skip
    note(f"an error of {percent(target)} was not reached: {' or '.join(limits)} came first")


def note_linear(display: Display, paths: Sequence[Path]) -> None:
    """Tell the user which files keep linear values although an exposure or a tone curve was asked for."""
    linear = [str(path) for path in paths if path.suffix.lower() not in EIGHT_BITS]
    if linear and not display.is_plain:
        note(f"{', '.join(linear)}: linear, without {display}: these change only {' '.join(EIGHT_BITS)}")


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


def add_samples(
    renderer: ProgressiveRenderer,
    keeper: "Keeper",
    spp: int | None,
    request: RenderRequest,
    interruption: Interruption,
    render: Callable[..., object],
) -> None:
    """Render until a target is reached or a signal came, and keep a checkpoint if one is wanted."""
    kept = keeper.resume()
    if spp is not None:
        spp -= kept
        if spp <= 0:
            return
    with Bar(renderer) as bar:

        def watch(progress: Progress) -> None:
            """After each sample: bring the bar up to date, keep a checkpoint if it is due, and stop after a signal."""
            bar.show(progress)
            keeper.keep_sometimes()
            if interruption.number is not None:
                raise Stopped

        interruption.is_rendering = True
        try:
            render(spp=spp, time=request.time, error=request.error, watch=watch)
        except Stopped:
            pass
        except KeyboardInterrupt:  # within a sample: some pixels may have it, so that nothing can go on from there
            interruption.number = interruption.number or signal.SIGINT
            return
        finally:
            interruption.is_rendering = False
    keeper.keep()


class Stopped(Exception):
    """The rendering was interrupted after a whole sample."""


class Keeper:
    """Writes a checkpoint every few seconds, and reads the one that is there."""

    def __init__(self, renderer: ProgressiveRenderer, path: str | None, every: float) -> None:
        self.renderer, self.path, self.every = renderer, path, every
        self.kept_at, self.failed, self.is_in_place = time.perf_counter(), False, True

    def resume(self) -> int:
        """Go on from the file if it exists; returns how many samples it has."""
        if self.path is None or not Path(self.path).exists():
            return 0
        self.renderer.load_checkpoint(self.path)
        print(f"{self.path}: going on after {self.renderer.samples} samples")
        return self.renderer.samples

    def keep_sometimes(self) -> None:
        """Write, unless that was just done."""
        if self.path is not None and self.renderer.samples > 0 and time.perf_counter() - self.kept_at > self.every:
            self.kept_at = time.perf_counter()
            try:
                self.renderer.save_checkpoint(self.path)
            except InputError as error:  # the disk may have room by the next time
                if not self.failed:
                    print(f"taichi-tracer: note: {error}: rendering goes on", file=sys.stderr)
                self.failed = True

    def kept_at_end(self, picture: Path) -> str:
        """Write now, beside the picture if nobody named a place; says how to go on."""
        if self.renderer.samples == 0:
            return "nothing has come yet: run the same command again"
        if self.renderer.adaptive:
            return f"they are in the picture, because {NOT_ADAPTIVE}"
        if self.path is None:
            self.path = str(picture.with_suffix(checkpoint.EXTENSION))
        self.keep()
        again = f"run the same command again, with --checkpoint {self.path}"
        return f"they are kept in {self.path}: to go on, {again}" if self.is_in_place else "they are kept as told above"

    def keep(self) -> None:
        """Write now, if there is where to and what."""
        if self.path is not None and self.renderer.samples > 0:
            with part(stopwatch.WRITE):
                self.is_in_place = written(Path(self.path), self.renderer.save_checkpoint) == Path(self.path)


class Bar:
    """A progress bar on stderr, when that is a terminal and the work is long: samples, seconds, error, seconds left."""

    def __init__(self, renderer: ProgressiveRenderer) -> None:
        self.renderer, self.bar = renderer, None
        if sys.stderr.isatty():  # where there is no bar, tqdm is not loaded either
            from tqdm import tqdm

            options = {"delay": SHOW_PROGRESS_AFTER, "leave": False}
            self.bar = tqdm(total=1.0, bar_format=BAR, desc=renderer.active.name, **options)

    def __enter__(self):
        return self

    def show(self, progress: Progress) -> None:
        """Bring the bar up to date."""
        if self.bar is None:
            return
        left, texts = progress.seconds_left, [f"{self.renderer.samples} spp", f"{progress.seconds:.1f} s"]
        if not math.isnan(progress.error):
            texts.append(f"error {two_digits(progress.error)}")
        if progress.place:
            texts.append(progress.place)
        texts.append("? left" if math.isnan(left) else f"{left:.1f} s left")
        self.bar.set_postfix_str(", ".join(texts), refresh=False)
        done = 0.0 if math.isnan(left) else progress.seconds / max(progress.seconds + left, SHORTEST)
        self.bar.update(max(0.0, done - self.bar.n))

    def __exit__(self, *_error) -> None:
        if self.bar is not None:
            self.bar.close()


def describe(renderer: ProgressiveRenderer, image: np.ndarray) -> str:
    """Size, samples, and the error where there is one."""
    text = f"{image.shape[1]}x{image.shape[0]}, {renderer.samples} spp"
    error = renderer.error() if renderer.jitter and renderer.samples > 1 else None
    return text if error is None or math.isnan(error) else f"{text}, error {error}"


def describe_times(renderer: ProgressiveRenderer) -> str:
    """How long compiling and rendering took."""
    progress = renderer.progress
    if progress.samples == 0:
        return "no more samples were needed"
    if progress.samples == 1:
        return f"first sample with compiling {progress.seconds:.2f} s"
    return f"compiling {progress.compile_seconds:.2f} s, rendering {progress.seconds:.2f} s"


def report_non_finite(renderer: ProgressiveRenderer) -> None:
    """A line on samples that were left out because they were not finite, if there were any (C-20)."""
    if renderer.non_finite > 0:
        found = renderer.film.non_finite_samples()[:MOST_PLACES]
        places = ", ".join(f"pixel ({x}, {y}) sample {i}" for x, y, i in found)
        print(
            f"taichi-tracer: note: {renderer.non_finite} samples were not finite, not added: {places}", file=sys.stderr
        )


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
