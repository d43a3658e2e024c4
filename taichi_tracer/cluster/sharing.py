"""One picture, rendered by the workers of a cluster: ranges of samples are handed out, and their sums are added up.

The commands ``render`` and ``turntable`` run within ``on_cluster`` if ``--cluster`` is given.

A worker that ends costs its range: Dask lets another worker take it, and the nanny starts the worker again.
"""

import math
import time
from argparse import Namespace
from collections.abc import Callable
from concurrent.futures import CancelledError
from dataclasses import replace
from functools import partial
from typing import Any

from taichi_tracer.apps.console import note
from taichi_tracer.cluster import worker
from taichi_tracer.cluster.clusters import Cluster, last_line
from taichi_tracer.cluster.worker import Job, pack
from taichi_tracer.files.disk import noting_reads
from taichi_tracer.picture.adaptive import adapt
from taichi_tracer.picture.progress import Progress, Target
from taichi_tracer.settings import RenderSettings
from taichi_tracer.system.errors import IncompleteError, InputError

SECONDS = 5.0  # that a range takes: longer than the overhead by far, and short enough to be done again
SECONDS_PER_WORKER = 0.2  # that are added for many workers: this machine adds up so many films of 512x512 in time
GROWTH = 4  # a range has at most so many times the samples of the one that was measured
DEPTH = 2  # ranges that a worker has: one that it renders, and one that waits
MOST_WAITING = 8  # per worker, sums that wait for those before them
RETRIES = 2  # of a range that failed
LOOK = 1.0  # seconds between two counts of the workers
WAIT = 0.05  # seconds between two looks at what has come


class DistributedRender:
    """The rendering of one picture.

    Sums are added in the order of their samples: what is on the film is the picture of the first n samples, which a
    checkpoint can hold.

    Args:
        renderer: of this machine; its film takes what comes, and its progress is updated.
        job: the same picture for the workers. target: when to stop.
    """

    def __init__(self, cluster: Cluster, renderer: Any, job: Job, target: Target) -> None:
        if renderer.shares.are_uneven and renderer.sampler.doubles:
            raise InputError("pixels of this checkpoint have different numbers of samples: go on without a cluster")
        if renderer.adaptive and renderer.sampler.doubles:  # pixels double at different times: the error is unknown
            raise InputError(f"--adaptive with --sampler {renderer.sampler.name} on a cluster: leave --sampler out")
        from distributed import as_completed

        pilot = None
        if not renderer.is_current():
            renderer.begin()
            pilot = adapt(renderer) if renderer.adaptive else None
        renderer.progress = self.progress = Progress(target, pilot=pilot)
        self.client, self.cluster, self.renderer, self.target = cluster.client, cluster, renderer, target
        self.added = self.next = renderer.first_sample + renderer.film.samples
        self.end = None if target.spp is None else self.next + math.ceil(target.spp / renderer.shares.mean)
        shares = renderer.shares.to_image() if renderer.shares.are_uneven else None
        camera = {name: given for name, given in renderer.camera.parameters().items() if name != "projection"}
        facts = {"facts": renderer.facts(), "bounces": renderer.values().get("bounces")}
        self.job = self.submit(worker.deliver, replace(job, camera=camera, shares=shares, **facts))
        self.given: dict[Any, tuple[int, int]] = {}  # future → its first sample, and how many these are
        self.sums: dict[int, tuple[int, dict]] = {}  # first sample → how many samples, and their sums
        self.coming = as_completed(loop=cluster.client.loop)
        self.spare = renderer.film.alike()
        self.workers, self.looked_at = 0, -LOOK
        self.added_at: float | None = None
        self.measured: tuple[float, int] | None = None  # seconds per sample of the last range, and its samples

    def submit(self, function: Callable, *words: Any) -> Any:
        """The future of a function that a worker calls."""
        return self.client.submit(function, *words, pure=False, retries=RETRIES)

    def run(self, watch: Callable[[Progress], Any]) -> None:
        """Render until a target is reached.

        Args:
            watch: called with the progress several times a second; whatever it raises ends the rendering.

        Raises:
            IncompleteError: the scheduler is gone, or a range could not be rendered. What came is on the film.
        """
        try:
            while not self.is_over:
                self.hand_out()
                time.sleep(WAIT)
                for future in self.coming.next_batch(block=False):
                    self.take(future)
                self.add()
                watch(self.progress)
        finally:
            if self.client.status == "running":
                self.client.cancel([*self.given, self.job])

    @property
    def seconds(self) -> float:
        """Of rendering, until now."""
        return 0.0 if self.added_at is None else self.progress.seconds + time.perf_counter() - self.added_at

    @property
    def is_over(self) -> bool:
        """Whether a target is reached."""
        return self.progress.is_done or (self.target.time is not None and self.seconds >= self.target.time)

    def hand_out(self) -> None:
        """Give the workers ranges, until each has enough."""
        if time.perf_counter() - self.looked_at > LOOK:
            self.workers, self.looked_at = self.cluster.workers(), time.perf_counter()
            self.progress.place = f"{self.workers} workers"
        most, waiting = DEPTH * self.workers, MOST_WAITING * self.workers
        while self.next != self.end and len(self.given) < most and len(self.sums) < waiting:
            first, count = self.next, self.size()
            self.next += count
            future = self.submit(worker.render_range, self.job, first, count)
            self.given[future] = first, count
            self.coming.add(future)

    def size(self) -> int:
        """How many samples the next range has."""
        if self.measured is None:
            return 1
        seconds_per_sample, last = self.measured
        wanted = SECONDS + SECONDS_PER_WORKER * self.workers
        if self.target.time is not None:
            wanted = min(wanted, (self.target.time - self.seconds) / DEPTH)
        size = min(int(wanted / seconds_per_sample), GROWTH * last)
        if self.end is not None:  # so that all workers end at about the same time
            size = min(size, math.ceil((self.end - self.next) / (DEPTH * self.workers)))
        if self.renderer.film.doubles:  # the error is estimated from doublings: a range may not go over one
            done = self.next - self.renderer.first_sample
            size = min(size, (1 << done.bit_length()) - done)
        return max(1, size)

    def take(self, future: Any) -> None:
        """Take the sums of a range."""
        first, count = self.given.pop(future)
        try:
            found = future.result()
        except (Exception, CancelledError) as error:
            self.cluster.workers()  # raises if the scheduler is gone
            if isinstance(error, InputError) and self.renderer.film.samples == 0:
                raise
            raise IncompleteError(f"{count} samples from {first} on are not rendered: {last_line(error)}") from None
        self.measured = max(found["seconds"], 1e-9) / count, count
        self.sums[first] = count, found["arrays"]
        if self.added_at is None:
            self.added_at = time.perf_counter() - found["seconds"]

    def add(self) -> None:
        """Put the sums onto the film that follow it without a gap."""
        before = self.added
        while self.added in self.sums:
            count, arrays = self.sums.pop(self.added)
            self.spare.from_arrays(arrays, count)
            self.renderer.film.merge(self.spare)
            self.added += count
        if self.added > before:
            now = time.perf_counter()
            self.progress.took(now - self.added_at, self.renderer.shares.mean, passes=self.added - before)
            self.added_at = now
            self.progress.look(self.renderer.error)
            self.added_at += time.perf_counter() - now  # which the progress counts itself


# ── commands ──


def on_cluster(args: Namespace, run: Callable[..., int]) -> int:
    """What ``run(args, elsewhere)`` returns: a command that renders, whose samples the workers of a cluster take."""
    with noting_reads() as paths, Cluster(args.cluster, note) as cluster:
        return run(args, partial(renders_on, cluster, RenderSettings.of(args), paths))


def renders_on(
    cluster: Cluster, settings: RenderSettings, paths: dict, renderer: Any, number: int = 0
) -> Callable[..., None]:
    """What takes the place of ``renderer.render``.

    Args:
        paths: the files that were read since the settings were read.
        number: of the picture, of those that the settings ask for.
    """
    if not renderer.is_random:
        note(f"{renderer.active.name} needs one sample: it is rendered here")
        return renderer.render
    if settings.parts:
        note(f"every worker gets the files of --parts, and runs them with its rights: {', '.join(settings.parts)}")
    job = replace(pack(settings, paths, cluster.threads), number=number)

    def render(spp: Any = None, time: Any = None, error: Any = None, watch: Any = None) -> None:
        """Add samples to the renderer's film until the first of the targets is reached."""
        DistributedRender(cluster, renderer, job, Target.of(spp, time, error)).run(watch or (lambda _: None))

    return render
