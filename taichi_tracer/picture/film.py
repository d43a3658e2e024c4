"""The picture: the mean of the samples of every pixel, and what is needed to know its error."""

import numpy as np
import taichi as ti
import taichi.math as tm

from taichi_tracer.picture.error_estimate import RelativeError, relative_error
from taichi_tracer.system import runtime
from taichi_tracer.system.errors import InputError

MAX_LOCATED = 16  # non-finite samples whose place is kept; all are counted


@ti.data_oriented
class Film:
    """Sums over samples [x, y] with y up, inside kernels; an image with the top row first, outside.

    Every pixel has a compensated sum (two numbers, together exact to twice the precision), and how many samples there
    were. The canvas shows the mean. Of independent samples there is also the sum of squared deviations from the mean;
    of replicas, those of odd index have a sum of their own, and the difference says what the deviations would.

    Args:
        width, height: pixels.
        crop: (x0, x1, y0, y1) in pixels from the bottom left, x1 and y1 excluded: only these take samples; None is all.
        replicated: whether samples of even and of odd index are two independent replicas, and not independent within
            them; see ``error_estimate``.
        keeps_deviation: whether there are squared deviations; None is where the error needs them.
        averages: whether pixels take samples; a picture that is only ``put`` leaves no sums to be cleared.
    """

    def __init__(
        self,
        width: int,
        height: int,
        crop: tuple[int, int, int, int] | None = None,
        replicated: bool = False,
        keeps_deviation: bool | None = None,
        averages: bool = True,
    ) -> None:
        self.width, self.height, self.replicated = width, height, replicated
        self.averages = averages
        self.keeps_deviation = not replicated if keeps_deviation is None else keeps_deviation
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
        self.count, self.total, self.rest = ti.field(ti.i32), ti.Vector.field(3, float), ti.Vector.field(3, float)
        cell = [self.count, self.total, self.rest]
        if self.keeps_deviation:
            self.deviation = ti.Vector.field(3, float)
            cell.append(self.deviation)
        fields.dense(ti.ij, shape).place(*cell)
        if replicated:
            self.odd_count = ti.field(ti.i32)
            self.odd_total, self.odd_rest = ti.Vector.field(3, float), ti.Vector.field(3, float)
            fields.dense(ti.ij, shape).place(self.odd_count, self.odd_total, self.odd_rest)
        self.non_finite_count = ti.field(ti.i32)
        self.non_finite_at = ti.Vector.field(3, ti.i32)
        fields.place(self.non_finite_count)
        fields.dense(ti.i, MAX_LOCATED).place(self.non_finite_at)
        self._memory.allocate()

    def reset(self) -> None:
        """Forget every sample; the canvas keeps its last picture until the next one."""
        self.check_alive()
        self.samples = 0
        if self.averages:
            self._clear()

    def check_alive(self) -> None:
        """Raise StaleSceneError when Taichi was initialised again after the film was made."""
        self._memory.check("film")

    @ti.kernel
    def _clear(self):
        for x, y in self.count:
            self.count[x, y] = 0
            if ti.static(self.replicated):
                self.odd_count[x, y] = 0
            for field in ti.static(self._sums()):
                field[x, y] = tm.vec3(0)
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
            is_odd = sample & 1 == 1
            if ti.static(self.replicated):
                if is_odd:
                    total, rest = add_to_pair(self.odd_total[x, y], self.odd_rest[x, y], value, tm.vec3(0))
                    self.odd_total[x, y], self.odd_rest[x, y] = total, rest
                    self.odd_count[x, y] += 1
            if not (is_odd and ti.static(self.replicated)):
                total, rest = add_to_pair(self.total[x, y], self.rest[x, y], value, tm.vec3(0))
                self.total[x, y], self.rest[x, y] = total, rest
            after = self.sum_of_samples(x, y) / (n + 1)
            if ti.static(self.keeps_deviation):
                if n > 0:
                    self.deviation[x, y] += (value - self.canvas[x, y]) * (value - after)  # Welford 1962
            self.count[x, y] = n + 1
            self.canvas[x, y] = after
        else:
            place = ti.atomic_add(self.non_finite_count[None], 1)
            if place < MAX_LOCATED:
                self.non_finite_at[place] = ti.Vector([x, y, ti.cast(sample, ti.i32)])

    @ti.func
    def sum_of_samples(self, x, y):
        """The sum of all samples of a pixel."""
        total = self.total[x, y]
        if ti.static(self.replicated):
            total += self.odd_total[x, y]
        return total

    def merge(self, other: "Film") -> None:
        """Add the samples of another film of the same kind: of other sample indices, so that none counts twice."""
        self._memory.check("film")
        if (self.width, self.height) != (other.width, other.height):
            raise InputError(
                f"film: {other.width}x{other.height} samples cannot be added to a film of {self.width}x{self.height}"
            )
        if (self.replicated, self.keeps_deviation) != (other.replicated, other.keeps_deviation):
            raise InputError("film: samples of different samplers cannot be added")
        self._merge(other)
        self.samples += other.samples

    @ti.kernel
    def _merge(self, other: ti.template()):
        for x, y in self.count:
            n, m = self.count[x, y], other.count[x, y]
            if m > 0:
                if ti.static(self.keeps_deviation):
                    difference = other.sum_of_samples(x, y) / m - self.sum_of_samples(x, y) / ti.max(n, 1)
                    share = ti.cast(n, float) * m / (n + m)
                    self.deviation[x, y] += other.deviation[x, y] + difference * difference * share  # Chan et al. 1979
                self.total[x, y], self.rest[x, y] = add_to_pair(
                    self.total[x, y], self.rest[x, y], other.total[x, y], other.rest[x, y]
                )
                if ti.static(self.replicated):
                    self.odd_total[x, y], self.odd_rest[x, y] = add_to_pair(
                        self.odd_total[x, y], self.odd_rest[x, y], other.odd_total[x, y], other.odd_rest[x, y]
                    )
                    self.odd_count[x, y] += other.odd_count[x, y]
                self.count[x, y] = n + m
                self.canvas[x, y] = self.sum_of_samples(x, y) / (n + m)
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
        """(height, width, 3) float32, top row first: the variance of every pixel's mean; NaN where it is not known.

        Of independent samples, by their squared deviations; of two replicas, by the difference of their means.
        """
        return self.spread()[0]

    def sample_deviation(self) -> np.ndarray:
        """(height, width) float64, top row first: the standard deviation of one sample of every pixel."""
        self._memory.check("film")
        n = self.count.to_numpy()
        variance = self.deviation.to_numpy().sum(axis=2, dtype=np.float64) / np.maximum(n - 1, 1)
        return np.sqrt(variance).T[::-1]

    def error(self) -> RelativeError:
        """Relative RMSE of the picture over the pixels that have two samples or more, with its 95 % interval.

        NaN where there is none, and where the picture is black.
        """
        variance, groups = self.spread()
        return relative_error(variance, groups, self.image())

    def spread(self) -> tuple[np.ndarray, np.ndarray]:
        """Variance of the pixels' means, (height, width, 3), and how many independent groups it comes from."""
        self._memory.check("film")
        variance = np.empty((self.height, self.width, 3), np.float32)
        groups = np.empty((self.height, self.width), np.int32)
        self._write_spread(variance, groups)
        return variance, groups

    @ti.kernel
    def _write_spread(
        self, variance: ti.types.ndarray(dtype=ti.f32, ndim=3), groups: ti.types.ndarray(dtype=ti.i32, ndim=2)
    ):
        for row, column in ti.ndrange(self.height, self.width):
            x, y = column, self.height - 1 - row
            n = self.count[x, y]
            k, v = n, tm.vec3(0)
            if ti.static(self.replicated):
                odd = self.odd_count[x, y]
                k = ti.select(n > odd and odd > 0, 2, 1)
                share = ti.cast(n - odd, float) * odd / (ti.cast(n, float) * n)  # a quarter, when both have as many
                difference = self.total[x, y] / (n - odd) - self.odd_total[x, y] / odd
                v = difference * difference * share
            else:
                v = self.deviation[x, y] / (ti.cast(n, float) * (n - 1))
            groups[row, column] = k
            for i in ti.static(range(3)):
                variance[row, column, i] = ti.select(k > 1, ti.max(0.0, ti.cast(v[i], ti.f32)), tm.nan)

    def to_arrays(self) -> dict[str, np.ndarray]:
        """Everything the film holds, for a checkpoint."""
        self._memory.check("film")
        values = np.empty((self.width, self.height, len(self._sums()), 3), runtime.dtype())
        counts = np.empty((self.width, self.height, 2), np.int32)
        self._export(values, counts)
        return {"values": values, "counts": counts, "non_finite": self._bad_samples()}

    def from_arrays(self, arrays: dict[str, np.ndarray], samples: int) -> None:
        """The opposite of ``to_arrays``, to the last bit; ``samples`` are there of every pixel."""
        self._memory.check("film")
        self._import(arrays["values"], arrays["counts"])
        bad = arrays["non_finite"]
        self.non_finite_count[None] = int(bad[0, 0])
        self.non_finite_at.from_numpy(np.ascontiguousarray(bad[1:]))
        self.samples = samples

    def _bad_samples(self) -> np.ndarray:
        """(1 + MAX_LOCATED, 3) int32: how many were not finite, and where the first ones were."""
        return np.concatenate([[[self.non_finite, 0, 0]], self.non_finite_at.to_numpy()]).astype(np.int32)

    @ti.kernel
    def _export(self, values: ti.types.ndarray(ndim=4), counts: ti.types.ndarray(dtype=ti.i32, ndim=3)):
        for x, y in self.count:
            counts[x, y, 0], counts[x, y, 1] = self.count[x, y], 0
            if ti.static(self.replicated):
                counts[x, y, 1] = self.odd_count[x, y]
            for k in ti.static(range(3)):
                for i, field in ti.static(enumerate(self._sums())):
                    values[x, y, i, k] = field[x, y][k]

    @ti.kernel
    def _import(self, values: ti.types.ndarray(ndim=4), counts: ti.types.ndarray(dtype=ti.i32, ndim=3)):
        for x, y in self.count:
            self.count[x, y] = counts[x, y, 0]
            if ti.static(self.replicated):
                self.odd_count[x, y] = counts[x, y, 1]
            for k in ti.static(range(3)):
                for i, field in ti.static(enumerate(self._sums())):
                    field[x, y][k] = values[x, y, i, k]
            if self.count[x, y] > 0:
                self.canvas[x, y] = self.sum_of_samples(x, y) / self.count[x, y]

    def _sums(self) -> tuple:
        """The fields that a checkpoint keeps, in its order."""
        odd = (self.odd_total, self.odd_rest) if self.replicated else ()
        return (self.total, self.rest, *odd, *([self.deviation] if self.keeps_deviation else []))

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
