"""What the parts of a sample cost: shading, shadow rays and film, which one kernel does and no clock sees apart.

Some samples are taken once more, after the picture, by a kernel from which parts can be left out. It has the same code
as the kernel of the picture, and a switch at two places. One switch leaves out the film. The other one leaves out the
search for what a ray meets: the answers of all rays that leave a surface are written down once, and are then read
instead of found. The sample stays the same, to the last bit, so that the difference in time is the cost of the rays.

The same kernel counts the rays.
"""

import copy
import math
import statistics
from dataclasses import dataclass
from time import perf_counter, process_time
from typing import Any

import numpy as np
import taichi as ti
import taichi.math as tm
from taichi.lang import impl

from taichi_tracer.progressive import ProgressiveRenderer
from taichi_tracer.ray import HitData, no_hit
from taichi_tracer.system import memory, runtime
from taichi_tracer.system.observed import before, observed
from taichi_tracer.system.seams import in_kernels
from taichi_tracer.system.some_pixels import SomePixels

TRACE, COUNT, RECORD, REPLAY, REPLAY_ALL = range(5)  # what the kernel does with rays; see ``Answers``
ROUNDS = 5  # times that each variant runs; the variants take turns
PASSES = 2 + 4 * ROUNDS  # over all pixels: one to count, one to write answers down, and those that are measured
LEAST_STRIP = 16  # columns of pixels: fewer would be too little work for a call
STRIPS = 8  # into which the picture is cut, of which some are left out if all of them would take too long
MOST_SHADOWS, MOST_HITS = 1 << 22, 1 << 19  # answers that are kept at a time: 16 MB, and about 40 MB


@dataclass(frozen=True)
class PixelRays:
    """Rays of one sample of every pixel.

    Attributes:
        eye: rays from the eye. shadow: rays that ask whether a light is blocked. others: rays that look for what they
            hit, such as the next segment of a path.
    """

    eye: int
    shadow: int
    others: int


@dataclass(frozen=True)
class SampleTimes:
    """Seconds of one sample, of as many pixels as were measured; see ``Anatomy.run``.

    Attributes:
        whole: with everything. film: what the film takes. rays: what the rays that leave a surface take. eye: what eye
            rays take. shading: the rest.
        share: the fraction of the pixels that were measured.
        rays_counted: in one sample of every pixel.
        seconds: what all of this took, compilation included.
    """

    whole: float
    film: float
    rays: float
    eye: float
    shading: float
    share: float
    rays_counted: PixelRays
    seconds: float


@ti.data_oriented
class Answers:
    """The answers to the rays of a sample, in the order in which each pixel asks.

    What the kernel does is its ``mode``: TRACE finds the answers. COUNT finds and counts them. RECORD finds them and
    writes them down. REPLAY reads those of the rays that leave a surface, and REPLAY_ALL those of eye rays, too.
    """

    def __init__(self, width: int, height: int) -> None:
        self.shadows, self.hits = min(MOST_SHADOWS, 32 * width * height), min(MOST_HITS, 16 * width * height)
        self._memory = memory.Memory()
        self.blocked, self.hit = ti.field(ti.i32), HitData.field()
        self.first_shadow, self.first_hit = ti.field(ti.i32), ti.field(ti.i32)
        self.switches = ti.field(ti.i32)  # the mode, and whether the film takes the samples
        self._memory.fields.dense(ti.i, self.shadows).place(self.blocked)
        self._memory.fields.dense(ti.i, self.hits).place(self.hit)
        self._memory.fields.dense(ti.ij, (width, height)).place(self.first_shadow, self.first_hit)
        self._memory.fields.dense(ti.i, 2).place(self.switches)
        self._memory.allocate()

    def switch(self, mode: int, fills_film: bool) -> None:
        """Say what the kernel does with the rays and the samples that come next."""
        self._memory.write(self.switches, [mode, int(fills_film)])

    @in_kernels
    def begin(self, x, y) -> None:
        """Begin the sample of a pixel."""
        self.mode, self.shadow, self.other = (impl.expr_init(number) for number in self.of_pixel(x, y))

    @ti.func
    def of_pixel(self, x, y):
        """The mode, and the numbers of the first answers of a pixel."""
        return self.switches[0], self.first_shadow[x, y], self.first_hit[x, y]

    @ti.func
    def end(self, x, y):
        """End the sample of a pixel: write down how many answers it needed, if they are counted."""
        if self.mode == COUNT:
            self.first_shadow[x, y], self.first_hit[x, y] = self.shadow, self.other

    def observed(self, intersector: Any, replayed: int) -> Any:
        """An intersector whose answers come from here, from the mode ``replayed`` on.

        The searches within an answer are not observed, because nobody makes them when the answer is read.
        """
        is_occluded, query_segment = intersector.is_occluded, intersector.query_segment
        answers = {
            "is_occluded": lambda part, call, *of: self.occlusion(is_occluded, *of),
            "query_segment": lambda part, call, *of: self.nearest(query_segment, *of, replayed),
            "query_ray": lambda part, call, ray: self.nearest(query_segment, ray, 0.0, tm.inf, replayed),
        }
        return observed(intersector, answers)

    @ti.func
    def occlusion(self, find: ti.template(), ray, t_max):
        """Whether a shadow ray is blocked: what ``find`` says, or what it said when it was written down."""
        k, blocked = self.shadow, 0
        self.shadow += 1
        if self.mode >= REPLAY:
            blocked = self.blocked[k]
        else:
            blocked = ti.cast(find(ray, t_max), ti.i32)
            if self.mode == RECORD:
                self.blocked[k] = blocked
        return blocked != 0

    @ti.func
    def nearest(self, find: ti.template(), ray, t_min, t_max, replayed: ti.template()):
        """What a ray hits: what ``find`` says, or what it said when it was written down."""
        k, hit = self.other, no_hit()
        self.other += 1
        if self.mode >= replayed:
            hit = self.hit[k]
        else:
            hit = find(ray, t_min, t_max)
            if self.mode == RECORD:
                self.hit[k] = hit
        return hit


@ti.data_oriented
class Anatomy:
    """Takes a renderer's samples apart. Its film gets samples twice: the picture must be begun again afterwards."""

    def __init__(self, renderer: ProgressiveRenderer) -> None:
        self.renderer, scene = renderer, renderer.kernel_scene()
        self.answers, self.pixels = Answers(renderer.width, renderer.height), SomePixels(self.end)
        self.columns, self.rows = renderer.film.ranges
        parts = renderer.sample_parts(scene, renderer.active)
        eye_rays = parts.eye_rays
        self.traces_eye_rays = eye_rays.traces
        if self.traces_eye_rays:
            eye_rays = copy.copy(eye_rays)
            eye_rays.intersector = self.answers.observed(scene.ray_intersector, REPLAY_ALL)
        watched = copy.copy(parts.scene)
        watched.ray_intersector = self.answers.observed(scene.ray_intersector, REPLAY)
        start = before(lambda sampler, seed, x, y, index: self.answers.begin(x, y))
        sampler = observed(parts.sampler, {"start": start})
        self.parts = parts._replace(scene=watched, eye_rays=eye_rays, sampler=sampler, film=self.pixels)

    @property
    def is_possible(self) -> bool:
        """Whether the rays can be left out; those that a student's ``shade_ray`` traces itself cannot."""
        return "shade_ray" not in self.renderer.replaced

    @ti.func
    def end(self, x, y, value, index):
        """End the sample of a pixel."""
        if self.answers.switches[1] != 0:
            self.renderer.record(x, y, value, index)
        else:
            self.pixels.keep(value)
        self.answers.end(x, y)

    def run(self, columns: tuple[int, int], mode: int, fills_film: bool = True) -> float:
        """Seconds of the next sample of all pixels in a range of columns: of the processor, in all threads.

        Other programs make the clock go on, but not the seconds of the processor. On a GPU, it is the clock.
        """
        r = self.renderer
        self.pixels.choose(columns, self.rows)
        self.answers.switch(mode, fills_film)
        ti.sync()
        clock = process_time if runtime.ensure().arch == "cpu" else perf_counter
        start = clock()
        r._take_samples(self.parts, r.seed, self.index, 1)
        ti.sync()
        return clock() - start

    @property
    def index(self) -> int:
        """The number of the next sample."""
        return self.renderer.first_sample + self.renderer.film.samples

    def count(self) -> PixelRays:
        """Count the rays of one sample, and prepare a place for each answer's number."""
        r = self.renderer
        r.kernel_scene().lights.prepare(r.active.samples_lights)
        self.answers.first_shadow.fill(0)
        self.answers.first_hit.fill(0)
        self.run(self.columns, COUNT)
        self.counted = self.answers.first_shadow.to_numpy(), self.answers.first_hit.to_numpy()
        shadows, hits = (int(counts.sum(dtype=np.int64)) for counts in self.counted)
        taken = (self.columns[1] - self.columns[0]) * (self.rows[1] - self.rows[0])
        return PixelRays(taken, shadows, hits - (taken if self.traces_eye_rays else 0))

    def strips(self, seconds: float, budget: float) -> list[tuple[int, int]]:
        """Ranges of columns to measure, whose answers fit into memory; some are left out to keep within a budget.

        Args:
            seconds: of one sample. budget: seconds of all passes.
        """
        first, end = self.columns
        step = max(1, math.ceil(PASSES * seconds / budget))
        width = max(LEAST_STRIP, (end - first) // (STRIPS * step)) if step > 1 else end - first
        for counts, room in zip(self.counted, (self.answers.shadows, self.answers.hits), strict=True):
            most = int(counts.sum(axis=1).max())  # of a column
            width = min(width, max(1, room // max(1, most)))
        return [(x, min(x + width, end)) for x in range(first, end, width * step)]

    def place(self, columns: tuple[int, int]) -> None:
        """Give each pixel of a range of columns its places for answers."""
        for counts, field in zip(self.counted, (self.answers.first_shadow, self.answers.first_hit), strict=True):
            own = counts[columns[0] : columns[1]].ravel().astype(np.int64)
            begins = np.zeros_like(counts)
            begins[columns[0] : columns[1]] = (np.cumsum(own) - own).reshape(-1, counts.shape[1])
            field.from_numpy(begins.astype(np.int32))

    def measure(self, budget: float) -> SampleTimes | None:
        """Take one more sample apart; None if that is not possible.

        Args:
            budget: the seconds that it may take, compilation not counted.
        """
        if not self.is_possible:
            return None
        start = perf_counter()
        rays = self.count()
        strips = self.strips(self.run(self.columns, TRACE), budget)
        whole, no_film, no_rays, no_eye = 0.0, 0.0, 0.0, 0.0
        variants = {"whole": (TRACE, True), "film": (TRACE, False), "rays": (REPLAY, False), "eye": (REPLAY_ALL, False)}
        for strip in strips:
            self.place(strip)
            self.run(strip, RECORD)
            times: dict[str, list[float]] = {name: [] for name in variants}
            for _ in range(ROUNDS):
                for name, (mode, fills_film) in variants.items():
                    times[name].append(self.run(strip, mode, fills_film))
            whole, no_film, no_rays, no_eye = (
                total + statistics.median(times[name])
                for total, name in zip((whole, no_film, no_rays, no_eye), variants, strict=True)
            )
        share = sum(b - a for a, b in strips) / (self.columns[1] - self.columns[0])
        film, of_rays = max(0.0, whole - no_film), max(0.0, no_film - no_rays)
        of_rays = of_rays if rays.shadow + rays.others > 0 else 0.0  # without rays, the difference is noise
        eye = max(0.0, no_rays - no_eye) if self.traces_eye_rays else 0.0
        rest = max(0.0, whole - film - of_rays - eye)
        self.renderer.begin_anew()
        return SampleTimes(whole, film, of_rays, eye, rest, share, rays, perf_counter() - start)
