"""``taichi-tracer render``: pictures into files."""

import contextlib
import sys
import time
from argparse import Namespace
from pathlib import Path

import taichi as ti

from taichi_tracer.apps.choices import Picture, load_scene, make_renderer, pictures
from taichi_tracer.errors import InputError
from taichi_tracer.files.images import check_writable, save_image
from taichi_tracer.renderer import ProgressiveRenderer

SHOW_PROGRESS_AFTER = 1.0  # seconds: shorter work is over before a bar could be read


def run(args: Namespace) -> int:
    """Render and write every view that was asked for; 0, or 130 when Ctrl-C ended it with what was done by then."""
    asked = pictures(args)
    paths = paths_of(asked, args.output, args.scene)
    start = time.perf_counter()
    scene = load_scene(args)
    loading = f"scene {time.perf_counter() - start:.2f} s"
    for picture, places in zip(asked, paths, strict=True):
        made = {}
        for (renderer_class, choice), path in zip(picture.views, places, strict=True):
            if renderer_class not in made:
                made[renderer_class] = make_renderer(renderer_class, scene, args, picture)
            renderer = made[renderer_class].use(choice.name)
            first, others = add_samples(renderer, picture.spp)
            if renderer.samples > 0:
                image = renderer.film.own_pixels(renderer.image())
                encodes = renderer.srgb and (picture.shot is None or picture.shot.film.gamma_corrected)
                save_image(path, image, srgb=encodes)
                times = [loading, f"first sample with compiling {first:.2f} s"]
                if renderer.samples > 1:
                    times.append(f"{renderer.samples - 1} more {others:.2f} s")
                print(f"{path}: {image.shape[1]}x{image.shape[0]}, {renderer.samples} spp ({', '.join(times)})")
                report_non_finite(renderer)
            if renderer.samples < picture.spp:
                print(f"taichi-tracer: interrupted after {renderer.samples} of {picture.spp} samples", file=sys.stderr)
                return 130
    return 0


def paths_of(asked: list[Picture], output: str | None, scene: str) -> list[list[Path]]:
    """Where each view of each picture goes: where ``-o`` says, or the scene file; else into ``renders``."""
    names = [(picture.filename, choice.name) for picture in asked for _, choice in picture.views]
    if output is None and all(filename is not None for filename, _ in names):
        paths = [Path(filename) for filename, _ in names]
        for path in paths:
            make_folder(path.parent, f"filename {path}")
    else:
        paths = output_paths(output, scene, [name for _, name in names])
        if len(paths) > 1 or Path(output or "renders").is_dir():
            paths = [
                path.parent / Path(path.name if filename is None else filename).name
                for path, (filename, _) in zip(paths, names, strict=True)
            ]
    paths = distinct(paths)
    for path in paths:
        check_writable(path)
    places = iter(paths)
    return [[next(places) for _ in picture.views] for picture in asked]


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


def add_samples(renderer: ProgressiveRenderer, spp: int) -> tuple[float, float]:
    """Render ``spp`` samples, fewer on Ctrl-C; returns the seconds of the first, which compiles, and of the others."""
    renderer.reset()
    start = compiled = time.perf_counter()
    try:
        renderer.render()
        ti.sync()
        compiled = time.perf_counter()
        with progress(spp - 1) as steps:
            for _ in steps:
                renderer.render()
                ti.sync()
    except KeyboardInterrupt:
        pass
    return compiled - start, time.perf_counter() - compiled


def report_non_finite(renderer: ProgressiveRenderer) -> None:
    """A line on samples that were left out because they were not finite, if there were any (C-20)."""
    if renderer.non_finite > 0:
        places = ", ".join(f"pixel ({x}, {y}) sample {i}" for x, y, i in renderer.film.non_finite_samples()[:3])
        print(
            f"taichi-tracer: note: {renderer.non_finite} samples were not finite, not added: {places}", file=sys.stderr
        )


def progress(count: int):
    """A context of ``range(count)``, with a progress bar on stderr when that is a terminal and the work is long."""
    if count < 1 or not sys.stderr.isatty():
        return contextlib.nullcontext(range(count))
    from tqdm import tqdm

    return tqdm(range(count), unit="spp", delay=SHOW_PROGRESS_AFTER, leave=False)


def output_paths(output: str | None, scene: str, names: list[str]) -> list[Path]:
    """Where each view goes, known to be writable before any work is done.

    Args:
        output: a file, a folder, or None for ``renders``. Folders are made.
        scene: name or path of the scene: in a folder, files are called <scene>_<view>.png.
        names: of the views.

    Raises:
        InputError: one file for several views, or a place that cannot be written.
    """
    folder = Path("renders" if output is None else output)
    is_folder = output is None or output.endswith(("/", "\\")) or folder.is_dir()
    if len(names) > 1 and not is_folder:
        if folder.suffix != "":
            raise InputError(f"-o {output} is one file for {len(names)} views: give a folder, such as renders/")
        is_folder = True
    paths = [folder]
    if is_folder:
        make_folder(folder, f"-o {output}")
        paths = [folder / f"{Path(scene).stem}_{name}.png" for name in names]
    for path in paths:
        check_writable(path)
    return paths


def make_folder(folder: Path, why: str) -> None:
    """The folder, and those that it lies in; an InputError that begins with ``why`` where it cannot be."""
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise InputError(f"{why}: the folder {folder} cannot be made ({error.strerror})") from None
