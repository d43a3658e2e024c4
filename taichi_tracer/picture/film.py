"""The film: it adds up the samples of every pixel, shows their mean, and keeps what is needed to estimate its error."""

import math
from collections.abc import Sequence
from pathlib import Path

import numpy as np
import taichi as ti

from taichi_tracer.formulas import vector_math as tm
from taichi_tracer.formulas.roundings import rounded
from taichi_tracer.picture.error_estimate import (
    RelativeError,
    errors_from_deviations,
    errors_from_halves,
    errors_of_sequence,
    relative_error,
)
from taichi_tracer.system import memory, runtime
from taichi_tracer.system.errors import InputError
from taichi_tracer.unseen import rare_light

# The names of the fields that checkpoints keep.
SUMS = ("total", "lost", "deviation", "largest", "before", "half_count", "non_finites")
OF_HALVES = {"half_count", "total", "lost"}
MAX_LOCATED = 16  # all samples that are not finite are counted; so many places are enough to find the cause


@ti.data_oriented
class Film:
    """The samples of a picture, added up for every pixel.

    Kernels name a pixel [x, y], with y up. Images that leave the film have their top row first.

    The low-discrepancy sampler takes its samples from two independent replicas of one sequence: samples of even index
    from the first, samples of odd index from the second. The film keeps the sums of these two halves separate,
    because their difference shows the error (see ``error_estimate``). If all samples belong to one sequence, half 0 has
    the first 2^m samples, where 2^m is the largest power of two below their number, and half 1 has the others.
    Independent samples need no second half: all of them belong to half 0.

    Sums are in f64. Where samples are in f64, too, or where there is no f64, the film keeps beside each sum what its
    additions rounded off.

    Args:
        width, height: size in pixels.
        crop: (x0, x1, y0, y1) in pixels from the bottom left, x1 and y1 excluded. Only the pixels inside take samples.
            None is all pixels.
        replicated: whether the samples of even and of odd index are two independent replicas.
        doubles: whether all samples are one sequence, whose error is its change when their number doubles.
        averages: whether pixels take samples; if not, all values come from ``put``, and there are no sums.

    Attributes:
        canvas: [x, y] the mean of the samples, which is the picture; ``show`` brings it up to date.
        kind: the last three arguments.
        half_count: [x, y, half] the number of samples of each half.
        total: [x, y, half] the sum of the samples of each half. lost: what it rounded off; only if it ``compensates``.
        deviation: [x, y] the sum of the squared deviations of the samples from their mean; only without halves.
        largest: [x, y] the largest sample, as a mean of red, green and blue; only if there are two halves.
        before: [x, y] the mean of the first 2^(m−1) samples; only for one sequence.
        non_finites: (1 + MAX_LOCATED, 3): how many samples were not finite (C-20), then (x, y, sample index) of each.
        samples: the number of samples that every pixel took; the caller of ``add`` counts them.
        rare: rows of light that samples find rarely, see ``rare_light.of_kinds``; its renderer finds them.
    """

    def __init__(
        self,
        width: int,
        height: int,
        crop: tuple[int, int, int, int] | None = None,
        replicated: bool = False,
        averages: bool = True,
        doubles: bool = False,
    ) -> None:
        self.width, self.height = memory.varying(width), memory.varying(height)
        self.crop = (0, width, 0, height) if crop is None else tuple(int(c) for c in crop)
        x0, x1, y0, y1 = self.crop
        if not (0 <= x0 < x1 <= width and 0 <= y0 < y1 <= height):
            raise InputError(
                f"film: crop {self.crop} does not lie within {width}x{height}: it is (x0, x1, y0, y1), with "
                "0 <= x0 < x1 <= width, same for y"
            )
        self.ranges = memory.varying(((x0, x1), (y0, y1)))
        self.halves = 2 if replicated or doubles else 1
        self.doubles, self.averages = doubles, averages
        self.kind = {"replicated": replicated, "averages": averages, "doubles": doubles}
        self.compensates = not runtime.can("f64") or runtime.dtype() is np.float64
        self.samples = 0
        self.rare = rare_light.of_kinds([])
        self.memory = memory.Memory()
        self._place_fields()
        self.memory.allocate()

    def _place_fields(self) -> None:
        fields, shape = self.memory.fields, (self.width, self.height)
        self.canvas = ti.Vector.field(3, float)
        fields.dense(ti.ij, shape).place(self.canvas)  # apart, because windows read it directly
        self.non_finites = ti.field(ti.i32)
        fields.dense(ti.ij, (1 + MAX_LOCATED, 3)).place(self.non_finites)
        if not self.averages:
            return
        real = float if self.compensates else ti.f64
        pixel = fields.dense(ti.ij, shape)
        if self.halves == 1:
            self.deviation = ti.Vector.field(3, real)
            pixel.place(self.deviation)
        else:
            self.largest = ti.field(float)
            pixel.place(self.largest)
        if self.doubles:
            self.before = ti.Vector.field(3, real)
            pixel.place(self.before)
        # A pass over all pixels writes to one half: the halves lie apart, so that it leaves the other's memory alone.
        half = fields.dense(ti.k, self.halves).dense(ti.ij, shape)
        self.half_count, self.total = ti.field(ti.i32), ti.Vector.field(3, real)
        half.place(self.half_count, self.total)
        if self.compensates:
            self.lost = ti.Vector.field(3, real)
            half.place(self.lost)

    def reset(self) -> None:
        """Forget every sample. The canvas keeps its last picture until the next sample."""
        for field in self._sums().values():
            self.memory.clear(field)
        self.samples = 0

    def _sums(self) -> dict[str, ti.Field]:
        """Name → field of the sums that this film has."""
        return {name: getattr(self, name) for name in SUMS if hasattr(self, name)}

    # ── samples, in kernels ──

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
            if ti.static(self.halves == 1):
                n = self.count(x, y)
                if n > 0:  # Welford 1962: the square of the deviation from the mean before, times n / (n + 1)
                    apart = value - self.mean(x, y)
                    self.deviation[x, y] = self.deviation[x, y] + apart * apart * (ti.cast(n, float) / (n + 1))
            self.add_to_half(x, y, half, value)
            self.half_count[x, y, half] = self.half_count[x, y, half] + 1
            if ti.static(self.halves == 2):
                self.largest[x, y] = ti.max(self.largest[x, y], tm.component_sum(value * ti.static(1 / 3)))
        else:
            self.locate(x, y, sample)

    @ti.func
    def locate(self, x, y, sample):
        """Count a sample that is not finite, and keep where the first of them were."""
        place = 1 + ti.atomic_add(self.non_finites[0, 0], 1)
        if place <= MAX_LOCATED:
            self.non_finites[place, 0], self.non_finites[place, 1] = x, y
            self.non_finites[place, 2] = ti.cast(sample, ti.i32)

    @ti.func
    def add_to_half(self, x, y, half, value):
        """Add a number to the sum of one half of a pixel, with what earlier additions lost, if that is kept."""
        if ti.static(self.compensates):
            self.total[x, y, half], self.lost[x, y, half] = two_sum(
                self.total[x, y, half], value + self.lost[x, y, half]
            )
        else:
            self.total[x, y, half] = self.total[x, y, half] + value

    @ti.func
    def half_of(self, x, y, sample):
        """The half to which a sample is added."""
        half = ti.cast(sample, ti.i32) & ti.static(self.halves - 1)
        if ti.static(self.doubles):
            first, others = self.half_count[x, y, 0], self.half_count[x, y, 1]
            if others > 0 and (first + others) & (first + others - 1) == 0:  # half 1 becomes a part of half 0
                self.before[x, y] = self.total[x, y, 0] / first
                self.add_to_half(x, y, 0, self.total[x, y, 1])
                self.total[x, y, 1] = 0 * self.total[x, y, 1]
                if ti.static(self.compensates):
                    self.lost[x, y, 0], self.lost[x, y, 1] = self.lost[x, y, 0] + self.lost[x, y, 1], tm.vec3(0)
                self.half_count[x, y, 0], self.half_count[x, y, 1] = first + others, 0
            half = ti.select(first > 0, 1, 0)
        return half

    @ti.func
    def count(self, x, y):
        """The number of samples of a pixel."""
        count = self.half_count[x, y, 0]
        for half in ti.static(range(1, self.halves)):
            count += self.half_count[x, y, half]
        return count

    @ti.func
    def mean(self, x, y):
        """The mean of all samples of a pixel; 0 if it has none."""
        total = self.total[x, y, 0]
        for half in ti.static(range(1, self.halves)):
            total += self.total[x, y, half]
        return total / ti.max(self.count(x, y), 1)

    @ti.kernel
    def _show_mean(self):
        for x, y in self.canvas:
            if self.count(x, y) > 0:
                self.canvas[x, y] = ti.cast(self.mean(x, y), float)

    def show(self) -> None:
        """Bring the canvas up to date: ``add`` leaves it alone. After a new start of Taichi, a StaleSceneError."""
        self.memory.check("film")
        if self.averages:
            self._show_mean()

    # ── the picture and its error ──

    def counts(self) -> np.ndarray:
        """[x, y] the number of samples of every pixel."""
        return self.of_both(self.memory.read(self.half_count))

    def of_both(self, numbers: np.ndarray) -> np.ndarray:
        """[x, y, …] the sum over the halves, of [x, y, half, …]; numpy's own is slow along so short an axis."""
        return numbers[:, :, 0] if self.halves == 1 else numbers[:, :, 0] + numbers[:, :, 1]

    def _totals(self) -> np.ndarray:
        """[x, y, half, channel] float64, the sum of the samples of each half."""
        total = self.memory.read(self.total).astype(np.float64)
        return total + self.memory.read(self.lost) if self.compensates else total

    def _means(self) -> np.ndarray:
        """[x, y, channel] float64, the mean of the samples of every pixel; 0 if it has none."""
        return self.of_both(self._totals()) / np.maximum(self.counts(), 1)[..., None]

    @property
    def non_finite(self) -> int:
        """How many samples were not finite."""
        return int(self.memory.read(self.non_finites)[0, 0])

    def non_finite_samples(self) -> list[tuple[int, int, int]]:
        """(x, y, sample index) of the first ``MAX_LOCATED`` samples that were not finite."""
        return [tuple(place) for place in self.memory.read(self.non_finites)[1 : 1 + self.non_finite].tolist()]

    def image(self) -> np.ndarray:
        """(height, width, 3) float32, linear, top row first."""
        canvas = self.memory.read(self.canvas)
        if not self.averages:
            return upright(canvas)
        return upright(np.where(self.counts()[..., None] > 0, self._means(), canvas))

    def half_images(self) -> tuple[np.ndarray, np.ndarray] | None:
        """(h, w, 3) float32, top row first: the means of two independent halves of the samples; None without them."""
        if self.halves == 1 or self.doubles or not self.averages:
            return None
        total, counts = self._totals(), self.memory.read(self.half_count)[..., None]
        if not self.own_pixels(upright((counts > 0).all(axis=(2, 3)))).all():
            return None
        first, second = (upright(total[:, :, k] / np.maximum(counts[:, :, k], 1)) for k in range(2))
        return first, second

    def own_pixels(self, image: np.ndarray) -> np.ndarray:
        """The part of a (height, width, ...) image, top row first, that takes samples: files show only this part."""
        x0, x1, y0, y1 = self.crop
        return image[self.height - y1 : self.height - y0, x0:x1]

    def error(self) -> RelativeError:
        """Relative RMSE of the picture, with its 95 % interval, over the pixels that have two samples or more.

        The upper end contains the light that no sample met, see ``unseen_light``. The error is NaN if there is no such
        pixel, or if the picture is black; and 0 if every sample is the picture itself.
        """
        if not self.averages:
            return RelativeError(0.0, 0.0, 0.0)
        image, counts = self.image(), upright(self.counts(), np.int32)
        mean = float(self.own_pixels(image).mean())
        shares = self.own_pixels(counts)[::-1].ravel() / max(self.samples, 1)
        missed = rare_light.missed(self.rare, self.samples, shares)
        unseen = missed / mean if mean > 0 else 0.0
        samples = float(counts[counts > 0].mean()) if self.doubles and counts.any() else 0.0
        return relative_error(self.variance_of_mean(), image, unseen, samples, self.share_of_largest(image, counts))

    def share_of_largest(self, image: np.ndarray, counts: np.ndarray) -> np.ndarray | None:
        """What the largest sample of every pixel adds to its mean, beyond what a sample adds on average.

        Args:
            image, counts: of the film, top row first.

        Returns:
            (m − μ)/n for the largest m of n samples with mean μ, of which each is a mean of red, green and blue:
            (height, width) float64, top row first; None if all samples are independent, because their spread shows it.
        """
        if self.halves == 1:
            return None
        mean = sum(image[..., k].astype(np.float64) for k in range(3)) / 3  # numpy is slow along an axis of three
        above = upright(self.memory.read(self.largest), np.float64) - mean
        return np.maximum(0, above) / np.maximum(counts, 1)

    def variance_of_mean(self) -> np.ndarray:
        """(height, width, 3) float64, top row first: the variance of every pixel's mean; NaN where it is unknown."""
        return np.square(self.standard_error())

    def standard_error(self) -> np.ndarray:
        """(height, width, 3) float64, top row first: the standard error of every mean; NaN where it is unknown."""
        if not self.averages:
            return np.zeros((self.height, self.width, 3))
        if self.halves == 1:
            errors = errors_from_deviations(self.memory.read(self.deviation), self.counts())
        elif self.doubles:
            before, counts = self.memory.read(self.before), self.memory.read(self.half_count)
            errors = errors_of_sequence(before, self._totals(), counts)
        else:
            errors = errors_from_halves(self._totals(), self.memory.read(self.half_count))
        return upright(errors, np.float64)

    # ── other films, and arrays ──

    def alike(self) -> "Film":
        """An empty film of the same kind, whose samples this one can ``merge``."""
        return Film(self.width, self.height, self.crop, **self.kind)

    def merge(self, other: "Film") -> None:
        """Add the samples of another film of the same kind. No sample may be on both films: it would count twice."""
        if (self.width, self.height, self.kind) != (other.width, other.height, other.kind):
            size, own = f"{other.width}x{other.height}", f"{self.width}x{self.height}"
            raise InputError(f"film: {size} samples cannot be added to a film of {own}, nor those of another sampler")
        n, m = self.counts(), other.counts()
        mine, theirs = self.to_arrays(), other.to_arrays()
        located = [*self.non_finite_samples(), *other.non_finite_samples()][:MAX_LOCATED]
        mine["non_finites"][0] += theirs["non_finites"][0]
        mine["non_finites"][1 : 1 + len(located)] = np.reshape(located, (-1, 3))
        if self.halves == 1:  # Chan et al. 1979
            apart = self._means() - other._means()
            mine["deviation"] += theirs["deviation"] + apart**2 * (n * m / np.maximum(n + m, 1))[..., None]
        if self.halves == 2:
            mine["largest"] = np.maximum(mine["largest"], theirs["largest"])
        if self.doubles:
            # The samples of the other film continue the sequence: first as ``half_of``, where the number has doubled.
            first, others = np.moveaxis(mine["half_count"], 2, 0)
            full = (m > 0) & (others > 0) & (n & (n - 1) == 0)
            mine["before"][full] = mine["total"][full, 0] / first[full][:, None]
            mine["before"][n == 0] = theirs["before"][n == 0]
            move_half(mine, full, 1, 0)
            move_half(theirs, n > 0, 0, 1)
        for name in OF_HALVES & mine.keys():
            mine[name] += theirs[name]
        mine["rare"] = self.rare if len(self.rare) else other.rare
        self.from_arrays(mine, self.samples + other.samples)

    def to_arrays(self) -> dict[str, np.ndarray]:
        """The complete content of the film, for a checkpoint: its sums [x, y, …] by name, in the types of the fields.

        ``rare`` is the attribute.
        """
        sums = {name: self.memory.read(field) for name, field in self._sums().items()}
        return sums | {"rare": self.rare}

    def check_arrays(self, arrays: dict[str, np.ndarray], source: str | Path = "film") -> None:
        """Raise an InputError, which begins with ``source``, if ``from_arrays`` cannot take these arrays."""
        for name, own in self.to_arrays().items():
            if name not in arrays or arrays[name].shape[1:] != own.shape[1:]:
                kinds = "its samples are of another size, another kind of sampler, or another version"
                raise InputError(f"{source}: its {name} does not fit: {kinds}")

    def from_arrays(self, arrays: dict[str, np.ndarray], samples: int) -> None:
        """Restore the arrays of ``to_arrays``, to the last bit; every pixel took ``samples`` samples."""
        self.check_arrays(arrays)
        for name, field in self._sums().items():
            self.memory.write(field, arrays[name])
        self.samples = samples
        self.rare = arrays["rare"]
        self.show()


def move_half(sums: dict[str, np.ndarray], where: np.ndarray, source: int, target: int) -> None:
    """Move the samples of one half to the other, for the arrays of a film and some pixels."""
    for name in OF_HALVES & sums.keys():
        sums[name][where, target] += sums[name][where, source]
        sums[name][where, source] = 0


def upright(array: np.ndarray, dtype: type = np.float32) -> np.ndarray:
    """[x, y, ...], y up, as an image: contiguous [row, column, ...] with the top row first."""
    return np.ascontiguousarray(array.swapaxes(0, 1)[::-1], dtype)


@ti.func
def two_sum(a, b):
    """a + b as the nearest number and its rounding error, which is exact (Knuth, TAOCP vol. 2, 4.2.2, theorem B)."""
    total = rounded(a + b)
    part = rounded(total - a)
    return total, (a - (total - part)) + (b - part)


@ti.func
def is_finite(value):
    """Whether all three components are finite."""
    return tm.component_sum(abs(value)) < tm.inf


def crop_pixels(window: Sequence[float], width: int, height: int) -> tuple[int, int, int, int]:
    """(x0, x1, y0, y1) in pixels, from a crop window in fractions; an InputError if it contains no pixel."""
    x0, x1, y0, y1 = (float(edge) for edge in window)
    if not (0 <= x0 < x1 <= 1 and 0 <= y0 < y1 <= 1):
        edges = " ".join(f"{edge:g}" for edge in (x0, x1, y0, y1))
        raise InputError(f"a crop window is x0 x1 y0 y1 with 0 <= x0 < x1 <= 1 and the same for y, not {edges}")
    pixels = math.ceil(x0 * width), math.ceil(x1 * width), math.ceil(y0 * height), math.ceil(y1 * height)
    if pixels[0] == pixels[1] or pixels[2] == pixels[3]:
        raise InputError(f"the crop window {x0:g} {x1:g} {y0:g} {y1:g} holds no pixel of {width}x{height}")
    return pixels
