"""The process that renders on a worker: it starts Taichi once, keeps the scenes that came, and renders sample ranges.

It is a process of its own, because kernels must not be launched from several threads, as Dask has them, and because a
process that a scene or the system has ended can be replaced. It owns the folder of the files, and removes it.
"""

import hashlib
import json
import math
import os
import shutil
import signal
import sys
import tempfile
import time
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Any

from taichi_tracer.system.errors import InputError
from taichi_tracer.system.processes import WorkerProcess, serve

if TYPE_CHECKING:
    from taichi_tracer.apps.requests import PictureRequest
    from taichi_tracer.picture.film import Film
    from taichi_tracer.progressive import ProgressiveRenderer
    from taichi_tracer.scene_data import SceneData

SLOW = 10.0  # seconds of a first sample, after which no second one is taken to learn its time
MOST_SCENES = 2  # that are kept: the pictures of a sweep that need one scene mostly come one after the other


class Child(WorkerProcess):
    """The process, as its parent sees it. The methods of ``Desk`` are called by name."""

    program = "from taichi_tracer.cluster.child import work; work()"
    task = "the rendering"

    def end(self) -> None:
        """Let the process end; a range that it renders is given up."""
        self.close()
        if self.process.poll() is None:
            self.process.terminate()


def work() -> None:
    """What the process does until its parent lets go of it."""
    serve_and_close(Desk)


def serve_and_close(make: Callable[..., Any]) -> None:
    """Answer the calls of the parent. In the end, close the object that they were made to."""
    made: list[Any] = []

    def open_one(*words: Any, **options: Any) -> Any:
        """Make the object, and remember it."""
        made.append(make(*words, **options))
        return made[0]

    signal.signal(signal.SIGTERM, lambda *_: sys.exit(1))  # by which the parent ends a range that nobody needs
    try:
        serve(open_one)
    finally:
        for one in made:
            one.close()


def new_folder(parent: str | None) -> Path:
    """A folder for files of a scene, which its process removes in the end."""
    try:
        return Path(tempfile.mkdtemp(prefix="taichi_tracer_", dir=parent))
    except OSError as error:
        raise InputError(f"{parent}: no folder for the scene can be made there ({error.strerror})") from None


class Desk:
    """The scenes and renderers of one worker.

    Args:
        folder: where a folder for the files is made.
        threads: how many processors the kernels use; None for all.
    """

    def __init__(self, folder: str | None, threads: int | None) -> None:
        self.threads = threads
        self.folder = new_folder(folder)
        self.scenes: dict[tuple, SceneData] = {}
        # Parcel → the key of its scene, its pictures, and its options but for where the camera stands.
        self.parcels: dict[str, tuple[tuple, tuple[PictureRequest, ...], str]] = {}
        self.shown: dict[tuple, str] = {}  # the parcel whose camera a renderer has
        self.renderers: dict[tuple, ProgressiveRenderer] = {}
        self.piloted: dict[tuple, str] = {}  # the parcel for which an adaptive renderer has its shares
        self.spare: dict[tuple, Film] = {}

    def close(self) -> None:
        """Remove the files."""
        shutil.rmtree(self.folder, ignore_errors=True)

    def settings(self, arch: str | None, precision: str | None, fast_math: bool) -> dict[str, str]:
        """Start Taichi, and say how it runs."""
        from taichi_tracer.system import runtime

        options = {name: value for name, value in (("arch", arch), ("precision", precision)) if value is not None}
        runtime.init(**options, fast_math=fast_math, threads=self.threads)
        return described(runtime.current())

    def receive(self, message: dict, pieces: dict[str, bytes]) -> None:
        """Write the files of a parcel, and load its scene."""
        if message["id"] in self.parcels:
            return
        from taichi_tracer.apps.grammar import load_parts
        from taichi_tracer.apps.requests import scene_and_pictures_of
        from taichi_tracer.cluster.parcel import CAMERA, PICTURE, name_of_files, unpack, without

        files = name_of_files(message)
        args = unpack(message, pieces, self.folder / files)
        load_parts(args.parts)
        scene, pictures = scene_and_pictures_of(args)
        key = files, without(message, PICTURE), any(picture.needs_light for picture in pictures)
        if key not in self.scenes:
            while len(self.scenes) >= MOST_SCENES:
                self.forget(next(iter(self.scenes)))
            self.scenes[key] = scene.load()
        self.parcels[message["id"]] = key, pictures, without(message, CAMERA)

    def forget(self, scene: tuple) -> None:
        """Free a scene, its parcels and its renderers."""
        for kept in (self.renderers, self.spare, self.piloted):
            for key in [key for key in kept if key[0] == scene]:
                del kept[key]
        for parcel in [parcel for parcel, (key, *_) in self.parcels.items() if key == scene]:
            del self.parcels[parcel]
        self.scenes.pop(scene).destroy()

    def warm(self, parcel: str, which: tuple) -> dict:
        """Compile what a picture needs. Says everything that its bits depend on, and the seconds of one sample."""
        renderer = self.renderer_of(parcel, which)
        seconds = math.nan
        one: dict = {}
        for _ in range(2):  # the first one compiles; where even that is slow, it tells enough
            if not seconds > SLOW:
                start = time.perf_counter()
                one = self.render(parcel, which, 0, 1)
                seconds = time.perf_counter() - start
        self.merge(parcel, which, [one, one | {"ranges": [[1, 2]]}])  # for its kernels alone
        return {"facts": facts_of(renderer), "seconds": seconds, "pid": os.getpid(), "memory": most_memory()}

    def renderer_of(self, parcel: str, which: tuple) -> "ProgressiveRenderer":
        """The renderer of one picture of a parcel: (number of the picture, number of its view, bounces or None).

        Pictures that differ only in where the camera stands share one, whose kernels are compiled once.
        """
        scene, pictures, others = self.parcels[parcel]
        key = scene, others, which
        if key not in self.renderers:
            self.renderers[key] = renderer_of(self.scenes[scene], pictures, which)
        elif self.shown[key] != parcel:
            place = pictures[which[0]].make_camera(self.scenes[scene]).parameters()
            del place["projection"]
            self.renderers[key].camera.set_camera_parameters(**place)
        self.shown[key] = parcel
        return self.renderers[key]

    def take_pilot(self, parcel: str, which: tuple) -> None:
        """Give an adaptive renderer the shares of its pixels, unless it has them.

        Every process takes the pilot itself. It has random numbers of its own, and is the same everywhere.
        """
        from taichi_tracer.picture.adaptive import adapt

        renderer = self.renderer_of(parcel, which)
        key = *self.parcels[parcel][::2], which
        if renderer.adaptive and self.piloted.get(key) != parcel:
            renderer.begin()
            adapt(renderer)
            self.piloted[key] = parcel

    def render(self, parcel: str, which: tuple, first: int, count: int) -> dict:
        """The samples of a range, as a film's arrays; and the seconds that they took, also of all processors.

        A range counts passes over all pixels. In an adaptive picture, not every pixel takes a sample in every pass.
        """
        renderer = self.renderer_of(parcel, which)
        self.take_pilot(parcel, which)
        start, cpu = time.perf_counter(), time.process_time()
        renderer.first_sample = first
        renderer.begin()
        renderer.add_range(first, first + count)
        renderer.film.samples = count
        arrays = renderer.film.to_arrays()
        took = {"seconds": time.perf_counter() - start, "cpu": time.process_time() - cpu}
        return {"ranges": [[first, first + count]], "arrays": arrays, **took}

    def merge(self, parcel: str, which: tuple, parts: list[dict]) -> dict:
        """The sum of several parts, which must follow each other without gaps."""
        from taichi_tracer.files.checkpoint import joined

        renderer = self.renderer_of(parcel, which)
        scene, _, others = self.parcels[parcel]
        key = scene, others, which
        if key not in self.spare:
            self.spare[key] = renderer.film.alike()
        ranges = parts[0]["ranges"]
        renderer.begin()
        renderer.film.from_arrays(parts[0]["arrays"], samples_of(parts[0]))
        for part in parts[1:]:
            ranges = joined(ranges, part["ranges"])
            self.spare[key].from_arrays(part["arrays"], samples_of(part))
            renderer.film.merge(self.spare[key])
        took = {name: sum(part[name] for part in parts) for name in ("seconds", "cpu")}
        return {"ranges": ranges, "arrays": renderer.film.to_arrays(), **took}

    def picture(self, parcel: str, which: tuple, spp: int | None, seconds: float | None, error: float | None) -> dict:
        """A whole picture, which is rendered here alone; as ``ProgressiveRenderer.render`` does."""
        renderer = self.renderer_of(parcel, which)
        start = time.perf_counter()
        renderer.begin_anew()
        renderer.render(spp, seconds, error)
        image = renderer.film.own_pixels(renderer.image())
        told = renderer.error() if renderer.is_random and renderer.samples > 1 else None
        facts = {"samples": renderer.samples, "error": told, "srgb": renderer.srgb, "non_finite": renderer.non_finite}
        return {"image": image, "seconds": time.perf_counter() - start, **facts}


def most_memory() -> int:
    """The most bytes that this process has used; 0 where the system does not tell."""
    try:
        import resource
    except ImportError:  # Windows
        return 0
    most = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    return most if sys.platform == "darwin" else most * 1024


def described(settings: Any) -> dict[str, str]:
    """How Taichi runs, for ``versions.difference``."""
    return {"backend": settings.arch, "precision": settings.precision, "fast math": str(settings.fast_math)}


def renderer_of(scene: "SceneData", pictures: tuple, which: tuple) -> "ProgressiveRenderer":
    """A renderer of one picture of a request, as ``taichi-tracer render`` makes it."""
    picture_number, view_number, bounces = which
    picture = pictures[picture_number]
    renderer_class, integrator = picture.views[view_number]
    renderer = picture.make_renderer(renderer_class, scene).use(integrator.name)
    if bounces is not None:
        renderer.bounces = tuple(bounces)
    return renderer


def facts_of(renderer: "ProgressiveRenderer") -> str:
    """Everything that the bits of a picture depend on, as JSON; with the shares of its pixels if it is adaptive."""
    facts = renderer.facts()
    if renderer.adaptive:
        facts["adaptive pilot"] = hashlib.sha256(renderer.shares.share.to_numpy().tobytes()).hexdigest()
    return json.dumps(facts, sort_keys=True)


def samples_of(part: dict) -> int:
    """How many samples every pixel of a part has."""
    return sum(end - first for first, end in part["ranges"])
