"""The picture: the mean of the samples of every pixel, and what is needed to know its error."""

import math

import numpy as np
import taichi as ti
import taichi.math as tm

from taichi_tracer import runtime
from taichi_tracer.errors import InputError

MAX_LOCATED = 16  # non-finite samples whose place is kept; all are counted


@ti.data_oriented
class Film:
    """Sums over samples [x, y] with y up, inside kernels; an image with the top row first, outside.

    Every pixel has a compensated sum (two numbers, together exact to twice the precision), the sum of squared
    deviations from the mean, and how many samples there were. The canvas shows the mean.

    Args:
        width, height: pixels.
        crop: (x0, x1, y0, y1) in pixels from the bottom left, x1 and y1 excluded: only these take samples; None is all.
    """

    def __init__(self, width: int, height: int, crop: tuple[int, int, int, int] | None = None) -> None:
        self.width, self.height = width, height
        self.crop = (0, width, 0, height) if crop is None else tuple(int(c) for c in crop)
        x0, x1, y0, y1 = self.crop
        if not (0 <= x0 < x1 <= width and 0 <= y0 < y1 <= height):
            raise InputError(
                f"film: crop {self.crop} does not lie within {width}x{height}: 0 <= x0 < x1 <= width, same for y"
            )
        self.ranges = (x0, x1), (y0, y1)
        self.samples = 0
        self._memory = runtime.Memory()
        fields = self._memory.fields
        shape = (width, height)
        self.canvas = ti.Vector.field(3, float)
        fields.dense(ti.ij, shape).place(self.canvas)
        self.count = ti.field(ti.i32)
        self.total, self.rest, self.deviation = (ti.Vector.field(3, float) for _ in range(3))
        fields.dense(ti.ij, shape).place(self.count, self.total, self.rest, self.deviation)
        self.non_finite_count = ti.field(ti.i32)
        self.non_finite_at = ti.Vector.field(3, ti.i32)
        fields.place(self.non_finite_count)
        fields.dense(ti.i, MAX_LOCATED).place(self.non_finite_at)
        self._memory.allocate()

    def reset(self) -> None:
        """Forget every sample; the canvas keeps its last picture until the next one."""
        self.check_alive()
        self.samples = 0
        self._clear()

    def check_alive(self) -> None:
        """Raise StaleSceneError when Taichi was initialised again after the film was made."""
        self._memory.check("film")

    @ti.kernel
    def _clear(self):
        for x, y in self.count:
            self.count[x, y] = 0
            self.total[x, y], self.rest[x, y], self.deviation[x, y] = tm.vec3(0), tm.vec3(0), tm.vec3(0)
        self.non_finite_count[None] = 0

    @ti.func
    def put(self, x, y, value):
        """The value of a pixel that every sample agrees on: a view without jitter."""
        self.canvas[x, y] = value

    @ti.func
    def add(self, x, y, value, sample):
        """One more sample of a pixel. One that is not finite is counted and located, not added (C-20)."""
        if is_finite(value):
            n = self.count[x, y]
            total, rest = add_to_pair(self.total[x, y], self.rest[x, y], value, tm.vec3(0))
            after = total / (n + 1)
            if n > 0:
                self.deviation[x, y] += (value - self.canvas[x, y]) * (value - after)  # Welford 1962
            self.total[x, y], self.rest[x, y], self.count[x, y] = total, rest, n + 1
            self.canvas[x, y] = after
        else:
            place = ti.atomic_add(self.non_finite_count[None], 1)
            if place < MAX_LOCATED:
                self.non_finite_at[place] = ti.Vector([x, y, ti.cast(sample, ti.i32)])

    def merge(self, other: "Film") -> None:
        """Add the samples of another film of the same size: of other sample indices, so that none counts twice."""
        self._memory.check("film")
        if (self.width, self.height) != (other.width, other.height):
            raise InputError(
                f"film: {other.width}x{other.height} samples cannot be added to a film of {self.width}x{self.height}"
            )
        self._merge(other)
        self.samples += other.samples

    @ti.kernel
    def _merge(self, other: ti.template()):
        for x, y in self.count:
            n, m = self.count[x, y], other.count[x, y]
            if m > 0:
                difference = other.total[x, y] / m - self.total[x, y] / ti.max(n, 1)
                share = ti.cast(n, float) * m / (n + m)
                self.deviation[x, y] += other.deviation[x, y] + difference * difference * share  # Chan et al. 1979
                total, rest = add_to_pair(self.total[x, y], self.rest[x, y], other.total[x, y], other.rest[x, y])
                self.total[x, y], self.rest[x, y], self.count[x, y] = total, rest, n + m
                self.canvas[x, y] = total / (n + m)
        self.non_finite_count[None] += other.non_finite_count[None]

    @property
    def non_finite(self) -> int:
        """How many samples were not finite."""
        self._memory.check("film")
        return int(self.non_finite_count[None])

    def non_finite_samples(self) -> list[tuple[int, int, int]]:
        """(x, y, sample index) of the first ``MAX_LOCATED`` samples that were not finite."""
        places = self.non_finite_at.to_numpy()[: min(self.non_finite, MAX_LOCATED)]
        return [tuple(int(number) for number in place) for place in places]

    def image(self) -> np.ndarray:
        """(height, width, 3) float32, linear, top row first."""
        self._memory.check("film")
        image = np.empty((self.height, self.width, 3), np.float32)
        self._copy_to(image)
        return image

    def own_pixels(self, image: np.ndarray) -> np.ndarray:
        """The part of a (height, width, ...) image, top row first, that takes samples: what a file shows of it."""
        x0, x1, y0, y1 = self.crop
        return image[self.height - y1 : self.height - y0, x0:x1]

    def variance_of_mean(self) -> np.ndarray:
        """(height, width, 3) float64, top row first: the variance of every pixel's mean if its samples are independent.

        NaN where there are fewer than two samples.
        """
        self._memory.check("film")
        n = self.count.to_numpy().astype(np.float64)[..., None]
        with np.errstate(all="ignore"):
            variance = np.where(n > 1, self.deviation.to_numpy().astype(np.float64) / (n - 1) / n, np.nan)
        return variance.transpose(1, 0, 2)[::-1]

    def relative_error(self) -> float:
        """√(mean variance of the pixels' means) / mean of the picture, over the pixels that have two samples or more.

        NaN where there is none, and where the picture is black. It takes samples for independent: those of a
        low-discrepancy sampler err less.
        """
        self._memory.check("film")
        sums = self._sum_of_variance()
        return math.sqrt(max(sums[0], 0.0) * sums[2]) / sums[1] if sums[1] > 0 else math.nan

    @ti.kernel
    def _sum_of_variance(self) -> ti.types.vector(3, ti.f32):
        variance, mean, count = ti.f32(0.0), ti.f32(0.0), ti.f32(0.0)
        for x, y in self.count:
            n = self.count[x, y]
            if n > 1:
                variance += ti.cast(self.deviation[x, y].sum(), ti.f32) / (ti.cast(n, ti.f32) * (n - 1))
                mean += ti.cast(self.canvas[x, y].sum(), ti.f32)
                count += 3
        return ti.Vector([variance, mean, count])

    @ti.kernel
    def _copy_to(self, image: ti.types.ndarray(dtype=ti.f32, ndim=3)):
        for row, column in ti.ndrange(self.height, self.width):
            for k in ti.static(range(3)):
                image[row, column, k] = self.canvas[column, self.height - 1 - row][k]


@ti.func
def add_to_pair(total, rest, value, value_rest):
    """(total + rest) + (value + value_rest) as the nearest number and what it lacks (Dekker 1971)."""
    rounded = total + value
    part = rounded - total
    lost = (total - (rounded - part)) + (value - part)  # exactly (Knuth, TAOCP vol. 2, section 4.2.2, theorem B)
    lost += rest + value_rest
    new_total = rounded + lost
    return new_total, lost - (new_total - rounded)


@ti.func
def is_finite(value):
    """Whether all three components are numbers."""
    return abs(value).sum() < tm.inf
