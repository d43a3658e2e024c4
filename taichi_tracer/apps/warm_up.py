"""``taichi-tracer warm-up``: pictures are rendered and thrown away, so that their kernels are kept.

A kernel that is kept belongs to a scene, to a size of the picture, and to what the picture shows. Therefore each
picture is rendered by a process of its own, by the same command that will be run later.
"""

import os
import subprocess
import sys
import tempfile
import time
from argparse import Namespace
from collections.abc import Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor, as_completed
from pathlib import Path

from tqdm import tqdm

from taichi_tracer.apps.names import VIEW
from taichi_tracer.apps.words import note
from taichi_tracer.renderer import A1Renderer, A2Renderer, A3Renderer, A4Renderer
from taichi_tracer.scene_data_loader import find_scene, scene_names
from taichi_tracer.system.cache import cache_folder, wanted_folder
from taichi_tracer.system.errors import InputError

SAMPLES = (
    2  # of a pixel: the forms of a picture of a few samples are those of more, and other ones than of a single one
)
# What the demos of the assignments show: scene, and views, estimators or paths.
ASSIGNMENTS = (
    ("cornell_box", A1Renderer.names),
    ("specular_spheres", A2Renderer.names),
    ("veach_plates", A3Renderer.names),
    ("cornell_box", A4Renderer.names),
)

Picture = tuple[str, str, tuple[int, int] | None]  # scene, what is shown, and a size other than the usual one


def pictures(args: Namespace) -> list[Picture]:
    """The pictures that the arguments ask for."""
    if args.scenes is None and not args.all:
        shown = [(scene, name) for scene, names in ASSIGNMENTS for name in names()]
    else:
        light = dict.fromkeys([*A3Renderer.names(), *A4Renderer.names()])
        shown = [(scene, name) for scene in args.scenes or scene_names() for name in (VIEW, *light)]
    return [(scene, name, size) for size in args.size or [None] for scene, name in shown]


def command(picture: Picture, output: Path) -> list[str]:
    """The command line that renders a picture into a folder: a scene file may ask for several views."""
    scene, name, size = picture
    words = [sys.executable, "-m", "taichi_tracer", "render", scene, "--view", name, "-o", f"{output}/"]
    words += ["--spp", str(SAMPLES)] if name not in A1Renderer.names() else []
    return words if size is None else [*words, "--size", f"{size[0]}x{size[1]}"]


def render_all(asked: Sequence[Picture], jobs: int) -> Iterator[tuple[Picture, str]]:
    """Each picture as soon as it is done, and the last line that its process told if it failed; "" if it did not."""
    with tempfile.TemporaryDirectory() as folder, ThreadPoolExecutor(jobs) as threads:

        def render(number: int) -> str:
            """What the process of a picture told last if it failed."""
            words = command(asked[number], Path(folder) / str(number))
            done = subprocess.run(words, capture_output=True, text=True, stdin=subprocess.DEVNULL)
            told = done.stderr.strip().splitlines() or [f"exit code {done.returncode}"]
            return told[-1] if done.returncode != 0 else ""

        numbers = {threads.submit(render, number): number for number in range(len(asked))}
        try:
            for future in as_completed(numbers):
                yield asked[numbers[future]], future.result()
        finally:
            threads.shutdown(cancel_futures=True)


def kernels_in(folder: Path) -> dict[str, int]:
    """The bytes of every kernel that is kept in a folder."""
    return {file.name: file.stat().st_size for file in folder.glob("*.tic")}


def run(args: Namespace) -> int:
    """Render the pictures, and say how many kernels are kept; 1 if a picture could not be rendered."""
    for scene in args.scenes or ():
        find_scene(scene)
    folder, why = cache_folder(wanted_folder())
    if folder is None:
        raise InputError(str(why))
    before, start = kernels_in(folder), time.perf_counter()
    asked, failed = pictures(args), 0
    with tqdm(total=len(asked), unit="picture", disable=None, leave=False) as bar:
        for (scene, name, _), told in render_all(asked, args.jobs or os.cpu_count() or 1):
            bar.set_description(f"{scene} {name}")
            bar.update()
            if told:
                failed += 1
                note(f"{scene}, {name}: {told}")
    after = kernels_in(folder)
    new, rendered = len(after.keys() - before.keys()), f"{len(asked) - failed} of {len(asked)} pictures"
    print(f"{folder}: {len(after)} kernels, {sum(after.values()) / 1e6:.1f} MB; {new} are new, from {rendered}")
    print(f"{time.perf_counter() - start:.0f} s")
    return 1 if failed else 0
