"""What runs in a worker of Dask: samples of a range; and the job that says of which picture.

A job is the settings of a picture, and the contents of the files that they name. Paths of the sender do not travel. In
the settings, a file is named by its place within the job, such as ``scene/box.obj``; shipped scenes and environments
keep their names, because every worker has the same package.

Each process keeps one scene and its renderer, so that kernels are read once. One thread of it uses Taichi.
"""

import contextlib
import hashlib
import importlib.metadata
import io
import os
import signal
import sys
import tempfile
import time
from collections.abc import Iterable
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, field
from functools import cache
from pathlib import Path
from typing import Any

import taichi_tracer
from taichi_tracer.apps.console import load_parts
from taichi_tracer.apps.pictures import request_of
from taichi_tracer.files.disk import make_folder, read_bytes, replace_file, shipped_environments
from taichi_tracer.scene_data_loader import name_of, shipped_scenes
from taichi_tracer.settings import NO_NAME, RenderSettings
from taichi_tracer.system import runtime
from taichi_tracer.system.errors import InputError

# ── jobs ──


# What does not travel as a setting: where samples are kept, and when the picture ends, is the sender's.
STAYS = {"spp", "time", "error", "checkpoint", "checkpoint_every"}
STAYS |= {"bounces", "eye", "at", "up", "fov"}  # which the job has of the renderer


# ── versions ──


@cache
def installation() -> dict[str, str]:
    """What must be the same on all machines."""
    digest, package = hashlib.sha256(), Path(taichi_tracer.__file__).parent
    for path in sorted(package.rglob("*.py"), key=lambda path: path.relative_to(package).as_posix()):
        digest.update(path.relative_to(package).as_posix().encode())
        digest.update(path.read_bytes().replace(b"\r\n", b"\n"))
    return {
        "taichi_tracer": f"{taichi_tracer.__version__} (source {digest.hexdigest()[:12]})",
        "Taichi": importlib.metadata.version("taichi"),
        "Python": f"{sys.version_info.major}.{sys.version_info.minor}",
    }


# ── jobs ──


@dataclass(frozen=True)
class Job:
    """A picture, ready to travel.

    Attributes:
        settings: those of the picture that are not the default; files are named by their places.
        files: place → content.
        number: of the picture, where settings ask for several.
        bounces: whose light it shows; None for all. camera: the arguments of ``set_camera_parameters``.
        threads: how many processors a worker uses; None for all.
        facts: everything that the bits of the picture depend on, as the sender has them; None does not check them.
        shares: of the pixels of an adaptive picture, see ``picture.adaptive``.
        versions: what is installed at the sender.
    """

    settings: dict[str, Any]
    files: dict[str, bytes]
    number: int = 0
    bounces: tuple | None = None
    camera: dict[str, Any] = field(default_factory=dict)
    threads: int | None = None
    facts: dict[str, Any] | None = None
    shares: Any = None
    versions: dict[str, str] = field(default_factory=installation)

    @property
    def picture(self) -> tuple:
        """What is equal for jobs that share a renderer: all but the camera."""
        return self.settings, self.files, self.number, self.bounces, self.threads

    def settings_in(self, folder: Path) -> RenderSettings:
        """The settings, with the paths of the files in this folder."""
        settings = dict(self.settings)
        for name in ("scene", "environment"):
            if settings.get(name) in self.files:
                settings[name] = str(folder / settings[name])
        settings["parts"] = tuple(str(folder / place) for place in settings.get("parts", ()))
        return RenderSettings(**settings)


def pack(settings: RenderSettings, paths: Iterable[str | Path], threads: int | None = None) -> Job:
    """The job of a picture, whose scene was loaded here.

    Args:
        paths: every file that was read while the scene was loaded. Shipped ones do not travel. Of the folders of the
            others, only those below the one that all of them share are named.
    """
    options = {name: value for name, value in settings.changed().items() if name not in STAYS}
    running = runtime.ensure()
    options |= {"arch": running.arch, "precision": running.precision}
    places: dict[Path, str] = {}
    shipped = shipped_environments()
    if settings.environment not in (None, NO_NAME) and settings.environment not in shipped:
        path = absolute(settings.environment)
        places[path] = options["environment"] = f"environment/{path.name}"
    options["parts"] = []
    for i, path in enumerate(map(absolute, settings.parts)):
        options["parts"].append(f"parts/{i}/{path.name}")
        for file in sorted(path.rglob("*.py")) if path.is_dir() else [path]:  # a folder of the course
            places[file] = f"parts/{i}/{file.relative_to(path.parent).as_posix()}"
    if settings.scene not in shipped_scenes():
        options["scene"] = name_of(Path(settings.scene).expanduser().absolute())
    if options["scene"] not in shipped_scenes():
        file, known = absolute(settings.scene), {*places, *map(absolute, shipped.values())}
        of_scene = list(dict.fromkeys([file, *(path for path in map(absolute, paths) if path not in known)]))
        root = Path(os.path.commonpath([path.parent for path in of_scene]))
        places |= {path: f"scene/{path.relative_to(root).as_posix()}" for path in of_scene}
        options["scene"] = places[file]
    return Job(options, {place: read_bytes(path) for path, place in places.items()}, threads=threads)


def absolute(path: str | Path) -> Path:
    """The same file, wherever the program stands; links stay, because names in a scene begin beside the link."""
    return Path(os.path.abspath(Path(path).expanduser()))


# ── the worker ──


taichi_thread = ThreadPoolExecutor(1)  # Dask may have several threads, and Taichi bears one
kept: dict[str, Any] = {}  # picture, renderer and folder of the last job, and the job that its camera shows


def dask_setup(_worker: Any) -> None:
    """Called by Dask in a local worker: Ctrl-C in the terminal is for the program that has started it."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)


def deliver(job: Job) -> Job:
    """The job itself: Dask keeps it on the workers, and makes it again if they are lost."""
    return job


def render_range(job: Job, first: int, count: int) -> dict[str, Any]:
    """The samples first to first + count - 1 of every pixel: the film's arrays, and how many seconds they took.

    Raises:
        InputError: this worker cannot render them; the line names the worker.
    """
    from distributed import get_worker

    here = get_worker()
    try:
        own, wanted = installation(), job.versions
        unlike = [
            f"{name} {own.get(name)} there, {wanted[name]} here" for name in wanted if own.get(name) != wanted[name]
        ]
        if unlike:
            raise InputError(", ".join(unlike))
        return taichi_thread.submit(samples_of, job, here.local_directory, first, count).result()
    except InputError as error:
        raise InputError(f"worker {here.address}: {error}") from None


def samples_of(job: Job, directory: str, first: int, count: int) -> dict[str, Any]:
    """``render_range``, in the thread that uses Taichi."""
    renderer = renderer_of(job, directory)
    start = time.perf_counter()
    renderer.first_sample = first
    renderer.begin()
    if job.shares is not None:
        renderer.shares.set(job.shares)
    renderer.add_range(first, first + count)
    renderer.film.samples = count
    return {"arrays": renderer.film.to_arrays(), "seconds": time.perf_counter() - start}


def renderer_of(job: Job, directory: str) -> Any:
    """The renderer of a job. Pictures that differ only in where the camera stands share one.

    Raises:
        InputError: the picture is not the sender's, because something beside the versions differs.
    """
    if kept.get("picture") != job.picture:
        load(job, directory)
    renderer = kept["renderer"]
    if kept["job"] is not job:
        renderer.camera.set_camera_parameters(**job.camera)
        found = renderer.facts()
        unlike = [name for name, value in (job.facts or {}).items() if found.get(name) != value]
        if unlike:
            raise InputError(f"it has another {', '.join(unlike)} than the machine that asks for the picture")
        kept["job"] = job
    return renderer


def load(job: Job, directory: str) -> None:
    """Load the scene of a job, and make its renderer, in the place of the former ones."""
    if kept:
        kept["renderer"].scene_data.destroy()
        kept.clear()
    temporary = tempfile.TemporaryDirectory(prefix="taichi_tracer_", dir=directory)
    folder = Path(temporary.name)
    for place, content in job.files.items():
        make_folder((folder / place).parent, place)
        replace_file(folder / place, content)
    settings = job.settings_in(folder)
    load_parts(settings.parts)
    asked, now = (settings.arch, settings.precision, settings.fast_math), runtime.current()
    is_other = now is not None and (now.arch, now.precision, now.fast_math) != asked
    runtime.init(*asked, threads=job.threads, force=is_other)
    request = request_of(settings)
    with contextlib.redirect_stderr(io.StringIO()):  # the sender has read the same notes
        scene = request.load()
    renderer = request.pictures[job.number].make_renderer(scene)
    if job.bounces is not None:
        renderer.bounces = job.bounces
    renderer.begin()
    renderer.add_range(0, 1)  # which compiles the kernels
    kept.update(picture=job.picture, renderer=renderer, job=None, folder=temporary)
