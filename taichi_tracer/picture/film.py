"""The film: it adds up the samples of every pixel, shows their mean, and keeps what is needed to estimate its error."""

import math

import numpy as np
import taichi as ti
import taichi.math as tm

from taichi_tracer.picture.error_estimate import RelativeError, relative_error, scale_for
from taichi_tracer.picture.exact_sums import exact_means
from taichi_tracer.picture.film_arrays import arrays_of, restore
from taichi_tracer.picture.film_spread import Spread, spread_of
from taichi_tracer.picture.merging import merge
from taichi_tracer.picture.non_finite import NonFiniteSamples
from taichi_tracer.picture.pixel_groups import upright
from taichi_tracer.picture.pixel_sums import PixelSums, is_finite, mean_of_channels
from taichi_tracer.system import memory
from taichi_tracer.system.errors import InputError
from taichi_tracer.system.varying import varying
from taichi_tracer.unseen import rare_light
from taichi_tracer.unseen.unseen_light import UnseenLight

# Pixels up to which numpy reads the film: it takes less than 2 ms for them, and a kernel 0.1 s to translate and load.
FEW_PIXELS = 128 * 128


@ti.data_oriented
class Film(PixelSums):
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
        doubles: whether all samples are one sequence, whose error is told by its change when their number doubles.
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
        before: [x, y] the mean of the first 2^(m−1) samples; only for one sequence.
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
        self.width, self.height = varying(width), varying(height)
        self.crop = (0, width, 0, height) if crop is None else tuple(int(c) for c in crop)
        x0, x1, y0, y1 = self.crop
        if not (0 <= x0 < x1 <= width and 0 <= y0 < y1 <= height):
            raise InputError(
                f"film: crop {self.crop} does not lie within {width}x{height}: 0 <= x0 < x1 <= width, same for y"
            )
        self.ranges = varying(((x0, x1), (y0, y1)))
        self.halves = 2 if replicated or doubles else 1
        self.doubles = doubles
        self.keeps_deviation = self.halves == 1 if keeps_deviation is None else keeps_deviation
        self.averages = averages
        self.samples = 0
        self.unseen = UnseenLight()

        self.memory = memory.Memory()
        self._place_fields()
        self.memory.allocate()
        if self.keeps_deviation:
            self.clear()  # fields begin with 0, and the scale is 1

    def _place_fields(self) -> None:
        fields, shape = self.memory.fields, (self.width, self.height)
        self.canvas = ti.Vector.field(3, float)
        fields.dense(ti.ij, shape).place(self.canvas)  # separate from the sums, because windows read it directly
        if self.keeps_deviation:
            self.deviation, self.scale = ti.Vector.field(3, float), ti.field(float)
            fields.dense(ti.ij, shape).place(self.deviation, self.scale)
        self.place_sums()
        self.non_finites = NonFiniteSamples(self.memory)

    def check_alive(self) -> None:
        """Raise a StaleSceneError if Taichi was initialised again after the film was made."""
        self.memory.check("film")

    def reset(self) -> None:
        """Forget every sample. The canvas keeps its last picture until the next sample."""
        self.check_alive()
        if self.averages:
            self.clear()
        elif self.samples > 0:
            self.non_finites.clear()
        self.samples = 0
        self.unseen.reset()

    def clear(self) -> None:
        """Set all sums to those of no samples."""
        if not self.memory.has_arrays:
            self._clear()
            return
        for field in (self.count.lanes[0], self.half_count.lanes[0], self.residue):
            self.memory.clear(field)
        if self.keeps_deviation:
            self.memory.clear(self.deviation)
            self.memory.write(self.scale, 1)
        self.non_finites.clear()

    @ti.kernel
    def _clear(self):
        for x, y in self.canvas:
            self.count.set_number(x, y, 0, 0)
            if ti.static(self.keeps_deviation):
                self.deviation[x, y], self.scale[x, y] = tm.vec3(0), 1.0
            if ti.static(self.halves == 2):
                self.largest.set_number(x, y, 0, 0.0)
            if ti.static(self.doubles):
                self.before.set_colour(x, y, 0, tm.vec3(0))
            for half in ti.static(range(self.halves)):
                self.clear_half(x, y, half)
        self.non_finites.number[None] = 0

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
            self.non_finites.locate(x, y, sample)

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
            self.non_finites.locate(x, y, sample)

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

    def merge(self, other: "Film") -> None:
        """Add the samples of another film of the same kind. No sample may be on both films: it would count twice."""
        self.check_alive()
        other.check_alive()
        merge(self, other)
        self.samples += other.samples
        self.unseen.merge(other.unseen)

    def alike(self) -> "Film":
        """An empty film of the same kind, whose samples this one can ``merge``."""
        is_replicated = self.halves == 2 and not self.doubles
        options = self.keeps_deviation, self.averages, self.doubles
        return Film(self.width, self.height, self.crop, is_replicated, *options)

    @property
    def non_finite(self) -> int:
        """How many samples were not finite."""
        self.check_alive()
        return self.non_finites.count()

    def non_finite_samples(self) -> list[tuple[int, int, int]]:
        """(x, y, sample index) of the first ``MAX_LOCATED`` samples that were not finite."""
        self.check_alive()
        return self.non_finites.places()

    def image(self) -> np.ndarray:
        """(height, width, 3) float32, linear, top row first."""
        self.check_alive()
        if self.memory.has_arrays and not self.averages:
            return upright(self.memory.array(self.canvas))
        if self.is_read_by_numpy:
            total, rest, count = self.total.read(self.memory), self.rest.read(self.memory), self.counts()
            means = exact_means(total, rest, self.memory.array(self.residue), count, self.doubles)
            return upright(np.where(count[..., None] > 0, means, self.memory.array(self.canvas)))
        image = np.empty((self.height, self.width, 3), np.float32)
        self._write_image(image)
        return image

    @property
    def is_read_by_numpy(self) -> bool:
        """Whether the picture is so small that numpy is done with it before a kernel is loaded."""
        return self.memory.has_arrays and self.width * self.height <= FEW_PIXELS

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

    def half_images(self) -> tuple[np.ndarray, np.ndarray] | None:
        """(h, w, 3) float32, top row first: the means of two independent halves of the samples; None without them."""
        self.check_alive()
        if self.halves == 1 or self.doubles:
            return None
        total, counts = self.total.read(self.memory), self.half_count.read(self.memory)[..., None]
        if not self.own_pixels(upright((counts > 0).all(axis=(2, 3)))).all():
            return None
        first, second = (upright(total[:, :, k] / np.maximum(counts[:, :, k], 1)) for k in range(2))
        return first, second

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
        shares = self.shares()
        unseen = self.unseen.bound(self.samples * (1.0 if shares is None else float(shares.mean())), mean)
        pixels = self.own_pixels(image)[..., 0].size
        missed = math.hypot(missed, rare_light.missed(self.unseen.rare, self.samples, pixels, shares))
        if missed > 0 and mean > 0:
            unseen = math.hypot(unseen, missed / mean)
        spread = self._spread()
        share = self.share_of_largest(image, spread)
        variance = np.square(spread.errors, dtype=np.float64)
        samples = float(spread.counts[spread.counts > 0].mean()) if self.doubles and spread.counts.any() else 0.0
        return relative_error(variance, spread.groups, image, unseen, samples, share)

    def shares(self) -> np.ndarray | None:
        """(n,) the share of the passes in which each own pixel took a sample, the lowest row first; None if it is 1."""
        x0, x1, y0, y1 = self.crop
        counts = self.counts()[x0:x1, y0:y1].T.ravel()
        return None if self.samples == 0 or (counts == self.samples).all() else counts / self.samples

    def share_of_largest(self, image: np.ndarray, spread: Spread | None = None) -> np.ndarray | None:
        """What the largest sample of every pixel adds to its mean, beyond what a sample adds on average.

        Args:
            image: of ``image``. spread: of the film, if it was read already.

        Returns:
            (m − μ)/n for the largest m of n samples with mean μ, of which each is a mean of red, green and blue:
            (height, width) float64, top row first; None if all samples are independent, because their spread tells it.
        """
        if self.halves == 1:
            return None
        spread = self._spread() if spread is None else spread
        mean = sum(image[..., k].astype(np.float64) for k in range(3)) / 3  # numpy is slow along an axis of three
        above = spread.largest - mean
        return np.maximum(0, above) / np.maximum(spread.counts, 1)

    def variance_of_mean(self) -> np.ndarray:
        """(height, width, 3) float64, top row first: the variance of every pixel's mean; NaN where it is unknown."""
        return self.spread()[0]

    def standard_error(self) -> np.ndarray:
        """(height, width, 3) float32, top row first: the root of ``variance_of_mean``."""
        return self._spread().errors

    def spread(self) -> tuple[np.ndarray, np.ndarray]:
        """The values of every pixel that ``relative_error`` needs, top row first.

        Returns:
            The variance of the mean, (height, width, 3) float64, which is NaN where it is unknown; and the number of
            independent groups of samples from which it was estimated, (height, width) int32.
        """
        spread = self._spread()
        return np.square(spread.errors, dtype=np.float64), spread.groups

    def _spread(self) -> Spread:
        self.check_alive()
        return spread_of(self)

    def sample_deviation(self) -> np.ndarray:
        """(height, width) float64, top row first: the standard deviation of one sample of every pixel.

        The film must keep deviations. The variances of the three channels are added.
        """
        self.check_alive()
        read = self.memory.read
        variance = read(self.deviation).sum(axis=2, dtype=np.float64) / np.maximum(self.counts() - 1, 1)
        return (np.sqrt(variance) / read(self.scale)).T[::-1]

    def to_arrays(self) -> dict[str, np.ndarray]:
        """The complete content of the film, for a checkpoint: see ``film_arrays``."""
        self.check_alive()
        return arrays_of(self) | self.unseen.to_arrays()

    def from_arrays(self, arrays: dict[str, np.ndarray], samples: int) -> None:
        """Restore the arrays of ``to_arrays``, to the last bit; every pixel took ``samples`` samples."""
        self.check_alive()
        restore(self, arrays)
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
