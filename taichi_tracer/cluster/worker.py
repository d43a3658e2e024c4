"""What runs in a worker of Dask: samples of a range.

Each process keeps one scene and its renderers, so that kernels are read once. One thread of it uses Taichi.
"""

import contextlib
import io
import signal
import tempfile
import time
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any

from taichi_tracer.apps.console import load_parts
from taichi_tracer.apps.pictures import request_of
from taichi_tracer.cluster.jobs import Job, difference, installation
from taichi_tracer.system import runtime
from taichi_tracer.system.errors import InputError

taichi_thread = ThreadPoolExecutor(1)  # Dask may have several threads, and Taichi bears one
kept: dict[str, Any] = {}  # key of a scene, the scene, its pictures and its folder; renderers by their keys


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
        unlike = difference(installation(), job.versions)
        if unlike:
            raise InputError(unlike)
        return taichi_thread.submit(samples_of, job, here.local_directory, first, count).result()
    except InputError as error:
        raise InputError(f"worker {here.address}: {error}") from None


def samples_of(job: Job, directory: str, first: int, count: int) -> dict[str, Any]:
    """``render_range``, in the thread that uses Taichi."""
    renderer = renderer_of(job, directory)
    start = time.perf_counter()
    renderer.first_sample = first
    renderer.begin()
    renderer.add_range(first, first + count)
    renderer.film.samples = count
    return {"arrays": renderer.film.to_arrays(), "seconds": time.perf_counter() - start}


def renderer_of(job: Job, directory: str) -> Any:
    """The renderer of a job. Pictures that differ only in where the camera stands share one.

    Raises:
        InputError: the picture is not the sender's, because something beside the versions differs.
    """
    scene_key, renderer_key = job.keys
    if kept.get("key") != scene_key:
        load_scene(job, directory)
    renderer = kept["renderers"].get(renderer_key)
    if renderer is not None and kept["job"] is job:
        return renderer
    picture_number, view_number, bounces = job.which
    picture = request_of(job.settings_in(kept["folder"])).pictures[picture_number]
    if renderer is None:
        renderer_class, integrator = picture.views[view_number]
        renderer = picture.make_renderer(renderer_class, kept["scene"]).use(integrator.name)
        if bounces is not None:
            renderer.bounces = tuple(bounces)
        renderer.begin()
        renderer.add_range(0, 1)  # which compiles the kernels
        kept["renderers"][renderer_key] = renderer
    place = picture.make_camera(kept["scene"]).parameters()
    del place["projection"]
    renderer.camera.set_camera_parameters(**place)
    if job.shares is not None:
        renderer.shares.set(job.shares)
    found = renderer.facts()
    unlike = [name for name, value in (job.facts or {}).items() if found.get(name) != value]
    if unlike:
        raise InputError(f"it has another {', '.join(unlike)} than the machine that asks for the picture")
    kept["job"] = job
    return renderer


def load_scene(job: Job, directory: str) -> None:
    """Load the scene of a job, in the place of the former one."""
    if kept:
        kept["scene"].destroy()
        kept.clear()
    temporary = tempfile.TemporaryDirectory(prefix="taichi_tracer_", dir=directory)
    folder = Path(temporary.name)
    job.unpack(folder)
    settings = job.settings_in(folder)
    load_parts(settings.parts)
    asked, now = (settings.arch, settings.precision, settings.fast_math), runtime.current()
    is_other = now is not None and (now.arch, now.precision, now.fast_math) != asked
    runtime.init(*asked, threads=job.threads, force=is_other)
    with contextlib.redirect_stderr(io.StringIO()):  # the sender has read the same notes
        scene = request_of(settings).load()
    kept.update(key=job.keys[0], scene=scene, renderers={}, job=None, folder=folder, temporary=temporary)
