"""``taichi-tracer render``: pictures into files."""

import contextlib
import sys
import time
from argparse import Namespace
from pathlib import Path

import taichi as ti

from taichi_tracer.apps.choices import find_views, load_scene, make_renderer
from taichi_tracer.errors import InputError
from taichi_tracer.files.images import check_writable, save_image
from taichi_tracer.renderer import ProgressiveRenderer

SHOW_PROGRESS_AFTER = 1.0  # seconds: shorter work is over before a bar could be read


def run(args: Namespace) -> int:
    """Render and write every view that was asked for; 0, or 130 when Ctrl-C ended it with what was done by then."""
    views = find_views(args.view)
    paths = output_paths(args.output, args.scene, [choice.name for _, choice in views])
    start = time.perf_counter()
    scene = load_scene(args)
    loading = f"scene {time.perf_counter() - start:.2f} s"
    made = {}
    for (renderer_class, choice), path in zip(views, paths, strict=True):
        if renderer_class not in made:
            made[renderer_class] = make_renderer(renderer_class, scene, args)
        renderer = made[renderer_class].use(choice.name)
        first, others = add_samples(renderer, args.spp)
        if renderer.samples > 0:
            save_image(path, renderer.image(), srgb=renderer.srgb)
            times = [loading, f"first sample with compiling {first:.2f} s"]
            if renderer.samples > 1:
                times.append(f"{renderer.samples - 1} more {others:.2f} s")
            print(f"{path}: {renderer.width}x{renderer.height}, {renderer.samples} spp ({', '.join(times)})")
            report_non_finite(renderer)
        if renderer.samples < args.spp:
            print(f"taichi-tracer: interrupted after {renderer.samples} of {args.spp} samples", file=sys.stderr)
            return 130
    return 0


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
        try:
            folder.mkdir(parents=True, exist_ok=True)
        except OSError as error:
            raise InputError(f"-o {output}: the folder cannot be made ({error.strerror})") from None
        paths = [folder / f"{Path(scene).stem}_{name}.png" for name in names]
    for path in paths:
        check_writable(path)
    return paths
