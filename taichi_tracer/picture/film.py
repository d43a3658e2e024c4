"""The film: it adds up the samples of every pixel, shows their mean, and keeps what is needed to estimate its error."""

import math

import numpy as np
import taichi as ti
import taichi.math as tm

from taichi_tracer.picture.error_estimate import (
    RelativeError,
    error_from_deviation,
    error_from_halves,
    relative_error,
    scale_for,
)
from taichi_tracer.picture.film_arrays import errors_from_deviations, errors_from_halves, exact_means
from taichi_tracer.picture.pixel_groups import PixelGroups, groups_along
from taichi_tracer.picture.unseen_light import UnseenLight
from taichi_tracer.system import direct, memory, runtime
from taichi_tracer.system.errors import InputError

MAX_LOCATED = 16  # all non-finite samples are counted; this number of places is enough to find the cause

# Pixels up to which numpy reads the film: it takes less than 2 ms for them, and a kernel 0.1 s to translate and load.
FEW_PIXELS = 128 * 128


@ti.data_oriented
class Film:
    """The samples of a picture, added up for every pixel.

    Kernels name a pixel [x, y], with y up. Images that leave the film have their top row first.

    The low-discrepancy sampler takes its samples from two independent replicas of one sequence: samples of even index
    from the first, samples of odd index from the second. The film keeps the sums of these two halves separate,
    because their difference shows the error (see ``error_estimate``). If all samples belong to one sequence, half 0 has
    the first 2^m samples, where 2^m is the largest power of two below their number, and half 1 has the others.
    Independent samples need no second half: all of them belong to half 0.

    Args:
        width, height: size in pixels.
        crop: (x0, x1, y0, y1) in pixels from the bottom left, x1 and y1 excluded. Only the pixels inside take samples.
            None stands for all pixels.
        replicated: whether the samples of even and of odd index are two independent replicas.
        doubles: whether all samples are one sequence, whose error is bounded by its change when their number doubles.
        keeps_deviation: whether the film adds up squared deviations; with None, if the error is estimated from them.
        averages: whether pixels take samples. If all values come from ``put``, ``reset`` has no sums to clear.

    Attributes (``count``, ``half_count``, ``total``, ``rest`` and ``largest`` are ``PixelGroups``, the others fields):
        canvas: [x, y] the mean of the samples, which is the picture; ``show`` brings it up to date.
        count: [x, y] the number of samples.
        half_count: [x, y, half] the number of samples of each half.
        total, rest, residue: [x, y, half] the sum of the samples of each half is total + rest + residue, which together
            are exact to three times the precision: see ``exact_total``. The residue is what total and rest cannot hold;
            mostly, it is 0.
        deviation: [x, y] the sum of the squared deviations of the samples from their mean; only if it is kept.
        scale: [x, y] what deviations are multiplied by before they are squared: 1, or for very dim or very bright light
            another power of two, because the squares would be 0 or infinite in f32.
        largest: [x, y] the largest sample, as a mean of red, green and blue; only if there are two halves.
        samples: the number of samples that every pixel took; the caller of ``add`` counts them.
        unseen: what is known of the light that no sample met.
    """

    def __init__(
        self,
        width: int,
        height: int,
        crop: tuple[int, int, int, int] | None = None,
        replicated: bool = False,
        keeps_deviation: bool | None = None,
        averages: bool = True,
        doubles: bool = False,
    ) -> None:
        self.width, self.height = width, height
        self.crop = (0, width, 0, height) if crop is None else tuple(int(c) for c in crop)
        x0, x1, y0, y1 = self.crop
        if not (0 <= x0 < x1 <= width and 0 <= y0 < y1 <= height):
            raise InputError(
                f"film: crop {self.crop} does not lie within {width}x{height}: 0 <= x0 < x1 <= width, same for y"
            )
        self.ranges = (x0, x1), (y0, y1)
        self.halves = 2 if replicated or doubles else 1
        self.doubles = doubles
        self.keeps_deviation = self.halves == 1 if keeps_deviation is None else keeps_deviation
        self.averages = averages
        self.samples = 0
        self.unseen = UnseenLight()

        self._memory = memory.Memory()
        fields = self._memory.fields
        shape = (width, height)
        self.canvas = ti.Vector.field(3, float)
        fields.dense(ti.ij, shape).place(self.canvas)  # separate from the sums, because windows read it directly
        if self.keeps_deviation:
            self.deviation, self.scale = ti.Vector.field(3, float), ti.field(float)
            fields.dense(ti.ij, shape).place(self.deviation, self.scale)
        groups = groups_along(width), groups_along(height)
        pixel = fields.dense(ti.k, 1).dense(ti.ij, groups)
        self.count = PixelGroups(pixel.place, width, height, 1, ti.i32)
        if self.halves == 2:
            self.largest = PixelGroups(pixel.place, width, height)
        # In memory, the two halves of the picture lie apart. A pass over all pixels writes to only one half; then the
        # memory of the other half need not be written back.
        half = fields.dense(ti.k, self.halves).dense(ti.ij, groups)
        self.half_count = PixelGroups(half.place, width, height, 1, ti.i32)
        self.total, self.rest = (PixelGroups(half.place, width, height, 3) for _ in range(2))
        self.residue = ti.Vector.field(3, float)
        fields.dense(ti.k, self.halves).dense(ti.ij, shape).place(self.residue)  # apart, because it is seldom read
        self.non_finite_count, self.non_finite_at = ti.field(ti.i32), ti.Vector.field(3, ti.i32)
        fields.place(self.non_finite_count)
        fields.dense(ti.i, MAX_LOCATED).place(self.non_finite_at)
        self._memory.allocate()
        if self.keeps_deviation:
            self.clear()  # fields begin with 0, and the scale is 1

    def check_alive(self) -> None:
        """Raise a StaleSceneError if Taichi was initialised again after the film was made."""
        self._memory.check("film")

    def reset(self) -> None:
        """Forget every sample. The canvas keeps its last picture until the next sample."""
        self.check_alive()
        if self.averages:
            self.clear()
        elif self.samples > 0 or direct.is_possible():  # also if it is 0: so its place is found together with others
            self._memory.write(self.non_finite_count, 0)
        self.samples = 0
        self.unseen.reset()

    def clear(self) -> None:
        """Set all sums to those of no samples."""
        if not direct.is_possible():
            self._clear()
            return
        for field in (self.count.lanes[0], self.half_count.lanes[0], self.residue):
            self._memory.clear(field)
        if self.keeps_deviation:
            self._memory.clear(self.deviation)
            self._memory.write(self.scale, 1)
        self._memory.write(self.non_finite_count, 0)

    @ti.kernel
    def _clear(self):
        for x, y in self.canvas:
            self.count.set_number(x, y, 0, 0)
            if ti.static(self.keeps_deviation):
                self.deviation[x, y], self.scale[x, y] = tm.vec3(0), 1.0
            if ti.static(self.halves == 2):
                self.largest.set_number(x, y, 0, 0.0)
            for half in ti.static(range(self.halves)):
                self.clear_half(x, y, half)
        self.non_finite_count[None] = 0

    @ti.func
    def record(self, x, y, value, sample):
        """Take the value of a pixel: as one sample, or as the final value if samples are not random."""
        if ti.static(self.averages):
            self.add(x, y, value, sample)
        else:
            self.put(x, y, value, sample)

    @ti.func
    def put(self, x, y, value, sample):
        """Set a pixel to its value, if every sample would have the same value, as in a view without jitter.

        A value that is not finite is counted and located instead, and the pixel is black (C-20).
        """
        if is_finite(value):
            self.canvas[x, y] = value
        else:
            self.canvas[x, y] = tm.vec3(0)
            self.locate(x, y, sample)

    @ti.func
    def add(self, x, y, value, sample):
        """Add one sample to a pixel. A sample that is not finite is counted and located instead (C-20).

        Only one thread at a time may add to a pixel. Therefore there is no ``+=`` here: Taichi would make it an atomic
        operation, which takes more time than the rest of this method.
        """
        if is_finite(value):
            half = self.half_of(x, y, sample)
            self.add_to_half(x, y, half, value)
            self.count_in_half(x, y, half, 1)
            if ti.static(self.halves == 2):
                self.largest.set_number(x, y, 0, ti.max(self.largest.number(x, y, 0), mean_of_channels(value)))
            if ti.static(self.keeps_deviation):
                mean_before, mean = self.canvas[x, y], self.mean(x, y)
                self.canvas[x, y] = mean
                if self.count.number(x, y, 0) > 1:
                    self.add_deviation(x, y, value - mean_before, value - mean)  # Welford 1962
        else:
            self.locate(x, y, sample)

    @ti.func
    def half_of(self, x, y, sample):
        """The half to which a sample is added."""
        half = ti.cast(sample, ti.i32) & ti.static(self.halves - 1)
        if ti.static(self.doubles):
            self.begin_doubling(x, y)
            half = ti.select(self.count.number(x, y, 0) > 0, 1, 0)
        return half

    @ti.func
    def begin_doubling(self, x, y):
        """Where the number of samples is a power of two, half 1 becomes a part of half 0, for the samples to come."""
        n = self.count.number(x, y, 0)
        if n & (n - 1) == 0 and self.half_count.number(x, y, 1) > 0:
            self.move_half(self, x, y, 1, 0)
            self.clear_half(x, y, 1)
            self.count.set_number(x, y, 0, n)

    @ti.func
    def add_deviation(self, x, y, a, b):
        """Add the product a b of two deviations of one sign, |a| ≥ |b|, to the squared deviations of a pixel."""
        deviation, scale = self.deviation[x, y], self.scale[x, y]
        wanted = scale_for(scale, abs(a).max(), deviation.max() == 0)
        if wanted < scale:
            deviation *= (wanted / scale) * (wanted / scale)
        if wanted != scale:
            self.scale[x, y] = wanted
        self.deviation[x, y] = deviation + (a * wanted) * (b * wanted)

    @ti.func
    def locate(self, x, y, sample):
        """Count a sample that is not finite, and keep where the first of them were."""
        place = ti.atomic_add(self.non_finite_count[None], 1)
        if place < MAX_LOCATED:
            self.non_finite_at[place] = ti.Vector([x, y, ti.cast(sample, ti.i32)])

    @ti.func
    def add_to_half(self, x, y, half, value):
        """Add a number to the sum of one half of a pixel."""
        total, rest, lost = add_to_pair(self.total.colour(x, y, half), self.rest.colour(x, y, half), value)
        self.total.set_colour(x, y, half, total)
        self.rest.set_colour(x, y, half, rest)
        self.add_lost(x, y, half, lost)

    @ti.func
    def add_lost(self, x, y, half, lost):
        """Add to the residue of one half of a pixel."""
        if abs(lost).sum() > 0:  # seldom, so that this memory is mostly left alone
            self.residue[x, y, half] = self.residue[x, y, half] + lost

    @ti.func
    def count_in_half(self, x, y, half, count):
        """Count samples that were added to one half of a pixel."""
        self.half_count.set_number(x, y, half, self.half_count.number(x, y, half) + count)
        self.count.set_number(x, y, 0, self.count.number(x, y, 0) + count)

    @ti.func
    def move_half(self, other: ti.template(), x, y, source, half):
        """Add all samples that one half of a pixel has on another film, or on this one, to a half of this film."""
        for part in ti.static((other.total, other.rest)):
            self.add_to_half(x, y, half, part.colour(x, y, source))
        self.add_to_half(x, y, half, other.residue[x, y, source])
        self.count_in_half(x, y, half, other.half_count.number(x, y, source))

    @ti.func
    def clear_half(self, x, y, half):
        """Forget the samples of one half of a pixel."""
        self.half_count.set_number(x, y, half, 0)
        for part in ti.static((self.total, self.rest)):
            part.set_colour(x, y, half, tm.vec3(0))
        self.residue[x, y, half] = tm.vec3(0)

    @ti.func
    def mean(self, x, y):
        """The mean of all samples of a pixel; 0 if it has none."""
        total = self.total.colour(x, y, 0)
        for half in ti.static(range(1, self.halves)):
            total += self.total.colour(x, y, half)
        return total / ti.max(self.count.number(x, y, 0), 1)

    @ti.func
    def exact_mean(self, x, y):
        """The same, rounded once from the exact sum of each half: it does not depend on the order of the samples."""
        total = self.exact_half(x, y, 0)
        for half in ti.static(range(1, self.halves)):
            total += self.exact_half(x, y, half)
        return total / ti.max(self.count.number(x, y, 0), 1)

    @ti.func
    def exact_half(self, x, y, half):
        """The sum of one half of a pixel, rounded once."""
        return exact_total(self.total.colour(x, y, half), self.rest.colour(x, y, half), self.residue[x, y, half])

    def merge(self, other: "Film") -> None:
        """Add the samples of another film of the same kind. No sample may be on both films: it would count twice."""
        self.check_alive()
        other.check_alive()
        if (self.width, self.height) != (other.width, other.height):
            raise InputError(
                f"film: {other.width}x{other.height} samples cannot be added to a film of {self.width}x{self.height}"
            )
        if (self.halves, self.doubles, self.keeps_deviation) != (other.halves, other.doubles, other.keeps_deviation):
            raise InputError("film: samples of different samplers cannot be added")
        located = [*self.non_finite_samples(), *other.non_finite_samples()][:MAX_LOCATED]
        self._merge(other)
        places = self._memory.read(self.non_finite_at)
        places[: len(located)] = np.reshape(located, (-1, 3))
        self._memory.write(self.non_finite_at, places)
        self.samples += other.samples
        self.unseen.merge(other.unseen)

    def alike(self) -> "Film":
        """An empty film of the same kind, whose samples this one can ``merge``."""
        is_replicated = self.halves == 2 and not self.doubles
        options = self.keeps_deviation, self.averages, self.doubles
        return Film(self.width, self.height, self.crop, is_replicated, *options)

    @ti.kernel
    def _merge(self, other: ti.template()):
        for x, y in self.canvas:
            n, m = self.count.number(x, y, 0), other.count.number(x, y, 0)
            if m > 0:
                if ti.static(self.keeps_deviation):
                    root = tm.sqrt(ti.max(other.deviation[x, y], 0.0)) / other.scale[x, y]
                    self.add_deviation(x, y, root, root)
                    difference = (other.mean(x, y) - self.mean(x, y)) * tm.sqrt(ti.cast(n, float) * m / (n + m))
                    self.add_deviation(x, y, difference, difference)  # Chan et al. 1979
                if ti.static(self.halves == 2):
                    largest = ti.max(self.largest.number(x, y, 0), other.largest.number(x, y, 0))
                    self.largest.set_number(x, y, 0, largest)
                if ti.static(self.doubles):
                    self.begin_doubling(x, y)
                for half in ti.static(range(self.halves)):
                    self.move_half(other, x, y, half, self.half_of_others(half, n))
                self.canvas[x, y] = self.mean(x, y)
        self.non_finite_count[None] += other.non_finite_count[None]

    @ti.func
    def half_of_others(self, half, n):
        """The half to which samples are added that are half ``half`` of another film; this one had n samples before.

        If all samples are one sequence, those of the other film continue it: they are the others of this doubling.
        """
        into = half
        if ti.static(self.doubles):
            into = 1 if n > 0 else half
        return into

    @property
    def non_finite(self) -> int:
        """How many samples were not finite."""
        self.check_alive()
        return int(self._memory.read(self.non_finite_count))

    def non_finite_samples(self) -> list[tuple[int, int, int]]:
        """(x, y, sample index) of the first ``MAX_LOCATED`` samples that were not finite."""
        located = min(self.non_finite, MAX_LOCATED)
        return [tuple(int(number) for number in place) for place in self._memory.read(self.non_finite_at)[:located]]

    def image(self) -> np.ndarray:
        """(height, width, 3) float32, linear, top row first."""
        self.check_alive()
        if direct.is_possible() and not self.averages:
            return upright(self._memory.array(self.canvas))
        if self.is_read_by_numpy:
            total, rest, count = self.total.read(self._memory), self.rest.read(self._memory), self.counts()
            means = exact_means(total, rest, self._memory.array(self.residue), count)
            return upright(np.where(count[..., None] > 0, means, self._memory.array(self.canvas)))
        image = np.empty((self.height, self.width, 3), np.float32)
        self._write_image(image)
        return image

    @property
    def is_read_by_numpy(self) -> bool:
        """Whether the picture is so small that numpy is done with it before a kernel is loaded."""
        return direct.is_possible() and self.width * self.height <= FEW_PIXELS

    def counts(self) -> np.ndarray:
        """[x, y] the number of samples of every pixel."""
        return self.count.read(self._memory)[..., 0]

    @ti.kernel
    def _write_image(self, image: ti.types.ndarray(dtype=ti.f32, ndim=3)):
        for row, column in ti.ndrange(self.height, self.width):
            x, y = column, self.height - 1 - row
            value = self.canvas[x, y]
            if ti.static(self.averages):
                if self.count.number(x, y, 0) > 0:
                    value = self.exact_mean(x, y)
            for k in ti.static(range(3)):
                image[row, column, k] = value[k]

    def own_pixels(self, image: np.ndarray) -> np.ndarray:
        """The part of a (height, width, ...) image, top row first, that takes samples: files show only this part."""
        x0, x1, y0, y1 = self.crop
        return image[self.height - y1 : self.height - y0, x0:x1]

    def error(self, missed: float = 0.0) -> RelativeError:
        """Relative RMSE of the picture, with its 95 % interval, over the pixels that have two samples or more.

        The upper end contains the light that no sample met, see ``unseen_light``. The error is NaN if there is no such
        pixel, or if the picture is black.

        Args:
            missed: the RMSE, in the unit of the picture, by what only another technique finds: ``other_technique``.
        """
        image = self.image()
        mean = float(self.own_pixels(image).mean())
        unseen = self.unseen.bound(self.samples, mean)
        if missed > 0 and mean > 0:
            unseen = math.hypot(unseen, missed / mean)
        errors, groups, *of_largest = self._read_spread()
        share = self._share_of_largest(image, *of_largest)
        return relative_error(np.square(errors, dtype=np.float64), groups, image, unseen, self.doubles, share)

    def share_of_largest(self, image: np.ndarray) -> np.ndarray | None:
        """What the largest sample of every pixel adds to its mean, beyond what a sample adds on average.

        Args:
            image: of ``image``.

        Returns:
            (m − μ)/n for the largest m of n samples with mean μ, of which each is a mean of red, green and blue:
            (height, width) float64, top row first; None if all samples are independent, because their spread tells it.
        """
        return self._share_of_largest(image, *self._read_spread()[2:])

    def _share_of_largest(self, image: np.ndarray, largest: np.ndarray, counts: np.ndarray) -> np.ndarray | None:
        if self.halves == 1:
            return None
        return np.maximum(0, largest - image.mean(axis=2, dtype=np.float64)) / np.maximum(counts, 1)

    def variance_of_mean(self) -> np.ndarray:
        """(height, width, 3) float64, top row first: the variance of every pixel's mean; NaN where it is unknown."""
        return self.spread()[0]

    def standard_error(self) -> np.ndarray:
        """(height, width, 3) float32, top row first: the root of ``variance_of_mean``."""
        return self._read_spread()[0]

    def spread(self) -> tuple[np.ndarray, np.ndarray]:
        """The values of every pixel that ``relative_error`` needs, top row first.

        Returns:
            The variance of the mean, (height, width, 3) float64, which is NaN where it is unknown; and the number of
            independent groups of samples from which it was estimated, (height, width) int32.
        """
        errors, groups, *_ = self._read_spread()
        return np.square(errors, dtype=np.float64), groups

    def _read_spread(self) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
        """Of every pixel, top row first: standard errors, groups, the largest sample and the number of samples.

        The largest sample, in the running precision, is 0 if the film does not keep it.
        """
        self.check_alive()
        if self.is_read_by_numpy:
            return self._spread_by_numpy()
        shape = self.height, self.width
        errors, largest = np.empty((*shape, 3), np.float32), np.zeros(shape, runtime.dtype())
        groups, counts = np.empty(shape, np.int32), np.empty(shape, np.int32)
        self._write_spread(errors, groups, largest, counts)
        return errors, groups, largest, counts

    def _spread_by_numpy(self) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
        memory = self._memory
        groups = count = self.counts()
        if self.halves == 2:
            largest, halves = self.largest.read(memory)[..., 0], self.half_count.read(memory)
            groups = np.where((halves > 0).all(axis=2), 2, 1)
            errors = errors_from_halves(self.total.read(memory), halves)
        else:
            largest = np.zeros(count.shape, runtime.dtype())
            errors = errors_from_deviations(memory.array(self.deviation), memory.array(self.scale), count)
        errors = np.where(groups[..., None] > 1, errors, np.nan)
        return upright(errors), upright(groups, np.int32), upright(largest, runtime.dtype()), upright(count, np.int32)

    @ti.kernel
    def _write_spread(
        self,
        errors: ti.types.ndarray(dtype=ti.f32, ndim=3),
        groups: ti.types.ndarray(dtype=ti.i32, ndim=2),
        largest: ti.types.ndarray(ndim=2),
        counts: ti.types.ndarray(dtype=ti.i32, ndim=2),
    ):
        for row, column in ti.ndrange(self.height, self.width):
            x, y = column, self.height - 1 - row
            k, e = self.count.number(x, y, 0), tm.vec3(0)
            counts[row, column] = k
            if ti.static(self.halves == 2):
                largest[row, column] = self.largest.number(x, y, 0)
                n_even, n_odd = self.half_count.number(x, y, 0), self.half_count.number(x, y, 1)
                k = ti.select(n_even > 0 and n_odd > 0, 2, 1)
                e = error_from_halves(self.total.colour(x, y, 0), n_even, self.total.colour(x, y, 1), n_odd)
            else:
                e = error_from_deviation(self.deviation[x, y], self.scale[x, y], k)
            groups[row, column] = k
            for i in ti.static(range(3)):
                errors[row, column, i] = ti.select(k > 1, ti.cast(e[i], ti.f32), tm.nan)

    def sample_deviation(self) -> np.ndarray:
        """(height, width) float64, top row first: the standard deviation of one sample of every pixel.

        The film must keep deviations. The variances of the three channels are added.
        """
        self.check_alive()
        read = self._memory.read
        variance = read(self.deviation).sum(axis=2, dtype=np.float64) / np.maximum(self.counts() - 1, 1)
        return (np.sqrt(variance) / read(self.scale)).T[::-1]

    def to_arrays(self) -> dict[str, np.ndarray]:
        """The complete content of the film, for a checkpoint.

        Returns:
            values: [x, y, i] RGB vectors in the running precision; i runs over the total and the rest of half 0, the
                same of half 1 if there is one, and the deviation if it is kept.
            counts: [x, y, 0] the number of all samples, [x, y, 1] that of half 1, 0 if there is none; int32.
            non_finite: (1 + MAX_LOCATED, 3) int32: how many samples were not finite, then (x, y, sample index) of each.
            scale: [x, y] of the deviation; only if it is not 1 everywhere.
            largest: [x, y] the largest sample, in the running precision; only with two halves, and not 0 everywhere.
            residues: [x, y, half] RGB vectors in the running precision; only if they are not 0 everywhere.
            Beside these, the arrays of ``unseen``.
        """
        self.check_alive()
        read = self._memory.read
        sums = self.total.read(self._memory), self.rest.read(self._memory)
        pairs = np.stack(sums, axis=3)  # [x, y, half, total or rest, channel]
        values = pairs.reshape(self.width, self.height, 2 * self.halves, 3)
        if self.keeps_deviation:
            values = np.concatenate([values, read(self.deviation)[:, :, None]], axis=2)
        counts = np.zeros((self.width, self.height, 2), np.int32)
        counts[..., 0] = self.counts()
        counts[..., 1 : self.halves] = self.half_count.read(self._memory)[..., 1:]
        non_finite = np.concatenate([[[self.non_finite, 0, 0]], read(self.non_finite_at)]).astype(np.int32)
        arrays = {"values": values, "counts": counts, "non_finite": non_finite}
        residues = read(self.residue)
        if residues.any():
            arrays["residues"] = residues
        if self.keeps_deviation and (read(self.scale) != 1).any():
            arrays["scale"] = read(self.scale)
        if self.halves == 2 and (largest := self.largest.read(self._memory)[..., 0]).any():
            arrays["largest"] = largest
        return arrays | self.unseen.to_arrays()

    def from_arrays(self, arrays: dict[str, np.ndarray], samples: int) -> None:
        """Restore the arrays of ``to_arrays``, to the last bit; every pixel took ``samples`` samples."""
        self.check_alive()
        values, counts, non_finite = arrays["values"], arrays["counts"], arrays["non_finite"]
        pairs = values[:, :, : 2 * self.halves].reshape(self.width, self.height, self.halves, 2, 3)
        half_counts = np.stack([counts[..., 0] - counts[..., 1], counts[..., 1]], axis=2)
        parts = [
            (self.total, pairs[:, :, :, 0]),
            (self.rest, pairs[:, :, :, 1]),
            (self.count, counts[..., :1]),
            (self.half_count, half_counts[..., : self.halves]),
        ]
        if self.halves == 2:
            largest = arrays.get("largest", np.zeros(counts.shape[:2], values.dtype))
            parts.append((self.largest, largest[..., None]))
        for numbers, array in parts:
            numbers.write(self._memory, array)
        self._memory.write(self.residue, arrays.get("residues", np.zeros_like(pairs[:, :, :, 0])))
        if self.keeps_deviation:
            self._memory.write(self.deviation, values[:, :, -1])
            self._memory.write(self.scale, arrays.get("scale", np.ones(counts.shape[:2], values.dtype)))
        self._memory.write(self.non_finite_at, non_finite[1:])
        self._memory.write(self.non_finite_count, non_finite[0, 0])
        self.samples = samples
        self.unseen.from_arrays(arrays)
        self._show_mean()

    def show(self) -> None:
        """Bring the canvas up to date: ``add`` itself leaves it alone, unless it needs the mean.

        Memory is what limits ``add``, and the mean would have to be read from both halves and written.
        """
        if self.averages and not self.keeps_deviation:
            self._show_mean()

    @ti.kernel
    def _show_mean(self):
        for x, y in self.canvas:
            if self.count.number(x, y, 0) > 0:
                self.canvas[x, y] = self.mean(x, y)


def upright(array: np.ndarray, dtype: type = np.float32) -> np.ndarray:
    """[x, y, ...], y up, as an image: contiguous [row, column, ...] with the top row first."""
    return np.ascontiguousarray(array.swapaxes(0, 1)[::-1], dtype)


@ti.func
def two_sum(a, b):
    """a + b as the nearest number and its rounding error, which is exact (Knuth, TAOCP vol. 2, 4.2.2, theorem B)."""
    rounded = a + b
    part = rounded - a
    return rounded, (a - (rounded - part)) + (b - part)


@ti.func
def add_to_pair(total, rest, value):
    """The sum (total + rest) + value, as the nearest number, its rounding error, and what these two cannot hold."""
    rounded, lost = two_sum(total, value)
    rest, lost = two_sum(rest, lost)
    total, rest = two_sum(rounded, rest)
    return total, rest, lost


@ti.func
def exact_total(total, rest, residue):
    """The number that is nearest to total + rest + residue.

    Whatever the order in which numbers were added, and however they were divided into films that were merged: the sum
    of the three is the same, and therefore this number, as long as the last digit of every sample is within three times
    the precision of the sum, which is 72 binary digits in f32. A sample of less than 1e-14 of the sum may go beyond;
    then the residue is rounded, which changes about one of 10^14 such numbers.
    """
    rest, residue = two_sum(rest, residue)
    total, rest = two_sum(total, rest)
    rest, residue = two_sum(rest, residue)
    # If the rest is just half of the last digit of the total, the nearest number is on the side of the residue.
    other = total + 2 * rest
    is_halfway = other - total == 2 * rest
    has_more = ((rest > 0) & (residue > 0)) | ((rest < 0) & (residue < 0))
    return ti.select(is_halfway & has_more, other, total)


@ti.func
def mean_of_channels(value):
    """The mean of red, green and blue."""
    return (value * ti.static(1 / 3)).sum()


@ti.func
def is_finite(value):
    """Whether all three components are finite."""
    return abs(value).sum() < tm.inf
