"""Error against seconds: what the ways to render a picture reached, over several seeds, against a reference.

The error of a picture is the root of the mean square difference of **all** of its pixels to the reference, as a
fraction of the reference's mean; the reference's own error is taken off. Where the reference is not clearly better than
the picture, the error that the picture tells of itself stands instead.

The seconds of n samples are n times the seconds of one sample, which is the median over blocks of samples. All
variants render in the same rounds, so that whatever else the machine does meets all of them alike.
"""

import math
import statistics
from collections.abc import Hashable, Sequence
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from taichi_tracer.picture.bias import shift_of, unmet_light
from taichi_tracer.picture.error_estimate import RelativeError
from taichi_tracer.picture.metrics import relative_rmse
from taichi_tracer.picture.progress import slope
from taichi_tracer.studies.variants import Variant

if TYPE_CHECKING:
    from taichi_tracer.studies.source import SceneFacts

TARGETS = (0.10, 0.05, 0.02, 0.01)  # relative RMSE
MIDDLE = TARGETS[2]  # the target by which variants are ranked
CLEAR = 1.5  # times the reference's own error: below it, the error of a picture cannot be told from that
FEW_POINTS = 4  # of a curve with fewer, the slope is that of all; of others, that of the later half
QUANTILE = 1.96  # 95 % of a normal distribution lie within this number of standard deviations from its mean
FEWEST_BLOCKS, ENOUGH_BLOCKS, UNKNOWN_FACTOR = 3, 5, 2.0  # see ``uncertainty``
ENOUGH_RATIOS = 3  # of errors: then those of fewer samples are not asked
UNSEEN_SHARE = 0.1  # of the error of a picture: if unseen light may add more, the error measures chance
ALIKE = 0.02  # of a logarithm: pictures whose errors differ by no more are the same


class Block(NamedTuple):
    """Some samples of every pixel, and what they took.

    Attributes:
        turn: the same for blocks of one round with equal samples, which can be compared best.
    """

    turn: Hashable
    samples: int
    seconds: float


class Shown(NamedTuple):
    """A picture after the same time as those of other variants."""

    image: np.ndarray
    samples: int
    error: float
    rel_mse: float
    flip: float


@dataclass(eq=False)
class Curve:
    """What one variant reached.

    Attributes:
        compile_seconds: until everything was compiled, beyond the time of rendering.
        trial_seconds: of one sample, as long as there are no blocks.
        seconds_to_save: of compiling, what another run is spared, because the kernels are kept.
        found: seed → samples per pixel → (relative RMSE, relative error as the picture tells it).
        blocks: the times.
        pilots: seconds of pilots of adaptive sampling, before the first sample of a picture.
        rendered: seconds of rendering of all pictures together.
        finals: seed → the last picture, and the variance of its pixels.
        reference_mean: of all pixels.
        shift, shift_error: the mean of the pictures minus that of the reference, as a fraction of the latter, and the
            standard error of this fraction, light that no sample met included.
        bias: z-score of the pictures against the reference, see ``shift_of``; NaN if it cannot be told.
        unmet: (pixels that met a rare light, pixels that it lights), see ``unmet_light``; None if no light is rare.
        unseen: the error that light may add which no sample met.
        is_biased: whether the variant leaves out light that is in the reference.
        shown: the picture at equal time; None for variants without one.
    """

    variant: Variant
    compile_seconds: float
    trial_seconds: float
    seconds_to_save: float = 0.0
    found: dict[int, dict[int, tuple[float, float]]] = field(default_factory=dict)
    blocks: list[Block] = field(default_factory=list)
    pilots: list[float] = field(default_factory=list)
    rendered: float = 0.0
    finals: dict[int, tuple[np.ndarray, np.ndarray]] = field(default_factory=dict)
    reference_mean: float = 1.0
    shift: float = 0.0
    shift_error: float = 0.0
    bias: float = math.nan
    unmet: tuple[int, int] | None = None
    unseen: float = 0.0
    is_biased: bool = False
    shown: Shown | None = None

    @property
    def samples(self) -> np.ndarray:
        """(K,) the numbers of samples per pixel at which pictures were compared."""
        return np.array(sorted({n for levels in self.found.values() for n in levels}), int)

    @property
    def errors(self) -> np.ndarray:
        """(seeds, K) relative RMSE; NaN where a seed did not go so far."""
        return self._table(0)

    @property
    def noise(self) -> np.ndarray:
        """(seeds, K) the relative error that each picture tells of itself."""
        return self._table(1)

    def _table(self, which: int) -> np.ndarray:
        samples, unknown = self.samples.tolist(), (math.nan, math.nan)
        rows = [[self.found[seed].get(n, unknown)[which] for n in samples] for seed in sorted(self.found)]
        return np.array(rows, float).reshape(len(rows), len(samples))

    @property
    def most_samples(self) -> int:
        """The largest number of samples at which a picture was compared; 0 before the first."""
        return int(self.samples.max(initial=0))

    @property
    def seconds_per_sample(self) -> float:
        """Seconds of one sample of every pixel: the median over blocks, each counted as often as it has samples."""
        if not self.blocks:
            return self.trial_seconds
        return float(
            np.median(np.repeat([b.seconds / b.samples for b in self.blocks], [b.samples for b in self.blocks]))
        )

    @property
    def time_factor(self) -> float:
        """The factor by which the seconds of a sample may be off, at 95 %."""
        return uncertainty([b.seconds / b.samples for b in self.blocks])

    @property
    def milliseconds_per_sample(self) -> float:
        """Milliseconds of one sample of every pixel."""
        return 1e3 * self.seconds_per_sample

    @property
    def mean_seconds(self) -> np.ndarray:
        """(K,) seconds of rendering until each picture."""
        pilot = statistics.median(self.pilots) if self.pilots else 0.0
        return pilot + self.samples * self.seconds_per_sample

    @property
    def mean_errors(self) -> np.ndarray:
        """(K,) relative RMSE: the root of the mean square over the seeds that went so far."""
        known = np.isfinite(self.errors)
        squares = np.where(known, self.errors, 0.0) ** 2
        return np.sqrt(squares.sum(axis=0) / np.maximum(known.sum(axis=0), 1))

    @property
    def last(self) -> tuple[float, float]:
        """(seconds, error) of the picture with the most samples."""
        return float(self.mean_seconds[-1]), float(self.mean_errors[-1])

    @property
    def best(self) -> tuple[float, float]:
        """(seconds, error) of the best picture: the least error of all seeds and samples."""
        errors = np.nanmin(self.errors, axis=0)
        k = int(errors.argmin())
        return float(self.mean_seconds[k]), float(errors[k])

    @property
    def is_unsure(self) -> bool:
        """Whether much of the light may be where no sample has met it: then the error measures chance."""
        return self.unmet is not None or self.unseen > UNSEEN_SHARE * self.last[1]

    @property
    def slope(self) -> float:
        """Of error against seconds on logarithms, over the later half: −1/2 for independent samples."""
        points = self._known()
        later = points[len(points) // 2 :] if len(points) >= FEW_POINTS else points
        return slope(later) if len(later) >= 2 else math.nan

    def _known(self) -> list[tuple[float, float]]:
        pairs = zip(self.mean_seconds.tolist(), self.mean_errors.tolist(), strict=True)
        return [(s, e) for s, e in pairs if e > 0]

    def seconds_to(self, target: float) -> float:
        """Seconds of rendering to a relative error, between two pictures that were measured; NaN if it was not reached.

        The error may rise again with more samples, where they meet a rare light: then the last crossing counts.
        """
        points = self._known()
        crossing = math.nan
        for (s0, e0), (s1, e1) in zip(points, points[1:], strict=False):
            if e0 > target >= e1:
                share = math.log(e0 / target) / math.log(e0 / e1)
                crossing = s0 * (s1 / s0) ** share
            elif e1 > target:
                crossing = math.nan
        if points and all(e <= target for _, e in points):
            return points[0][0]
        return crossing

    @property
    def variance_times_time(self) -> float:
        """Mean square error × seconds at the end: smaller is better, and with 1/√n the same at any time."""
        points = self._known()
        return math.nan if not points else (points[-1][1] * self.reference_mean) ** 2 * points[-1][0]

    def judge(self, truth: "Truth") -> None:
        """Compare the last pictures with the reference: is there a bias, and is there light that they did not meet?"""
        self.reference_mean = truth.mean
        last = [levels[max(levels)][1] for levels in self.found.values()]
        self.unseen = max(getattr(error, "unseen", 0.0) for error in last)
        if self.finals:
            finals = list(self.finals.values())
            self.shift, self.shift_error, self.bias = shift_of(finals, (truth.image, truth.variance), self.unseen)
            if not self.is_biased:
                self.unmet = unmet_light(np.mean([image for image, _ in finals], axis=0), truth.image)
            if self.unmet is not None:
                self.bias = math.nan


@dataclass
class Truth:
    """A reference: the picture, its relative error as it tells itself, and the variance of its pixels."""

    image: np.ndarray
    error: RelativeError
    variance: np.ndarray
    samples: int

    @property
    def mean(self) -> float:
        """The mean of all pixels."""
        return float(self.image.mean())

    def error_of(self, image: np.ndarray) -> float:
        """Relative RMSE of a picture."""
        return relative_rmse(image, self.image)


@dataclass
class Study:
    """Everything that was measured.

    Attributes:
        facts: the scene, and the machine.
        budget: seconds that were allowed.
        seeds: how many times each variant was rendered, at least.
        truths: look-up → reference.
        equal_seconds: of rendering, of the pictures that are shown beside each other.
        reference_bounces: how many surfaces reflect in the reference at most; None for direct light.
        seconds: that were taken, from the key press on. start_seconds: of these, until the first process was ready.
        kernels_made: how many kernels were compiled; 0 if all of them were kept from an earlier run.
        others: a sentence on other programs, if they took much of the machine.
        notes: what was not compared, and why.
    """

    facts: "SceneFacts"
    size: tuple[int, int]
    budget: float
    seeds: int
    curves: list[Curve]
    truths: dict[str, Truth]
    equal_seconds: float = 0.0
    reference_bounces: int | None = None
    notes: list[str] = field(default_factory=list)
    seconds: float = 0.0
    start_seconds: float = 0.0
    kernels_made: int = 0
    others: str | None = None

    @property
    def base(self) -> Variant:
        """The variant with which the others are compared."""
        return self.curves[0].variant

    @property
    def truth(self) -> Truth:
        """What the first variant is compared with."""
        return self.truths[self.base.lookup]


def leading(curves: Sequence[Curve], target: float = MIDDLE) -> Curve:
    """The curve that reaches an error first; if none does, the one with the least error at equal time."""
    reached = [c for c in curves if c.seconds_to(target) > 0]
    if reached:
        return min(reached, key=lambda c: c.seconds_to(target))
    return min(curves, key=lambda c: c.variance_times_time)


def uncertainty(values: list[float]) -> float:
    """The factor by which the median of positive values may be off, at about 95 %.

    The median lies between the k-th smallest and the k-th largest of n values, where k follows from the binomial
    distribution. Of fewer than ``ENOUGH_BLOCKS`` values, which may be near to each other by chance, it is taken to lie
    within twice the distance of their ends; and nothing is known of fewer than ``FEWEST_BLOCKS``.
    """
    n = len(values)
    if n < FEWEST_BLOCKS:
        return UNKNOWN_FACTOR
    distances = np.sort(np.log(values)) - np.median(np.log(values))
    k = max(0, int(n / 2 - QUANTILE * math.sqrt(n) / 2))
    return math.exp(max(-distances[k], distances[-1 - k]) * (2 if n < ENOUGH_BLOCKS else 1))


def time_ratio(base: Curve, other: Curve) -> tuple[float, float, float]:
    """(seconds of a sample over those of another variant, the ends of its 95 % interval).

    Blocks of the same turn are compared with each other.
    """
    by_turn = {b.turn: b.seconds / b.samples for b in base.blocks}
    ratios = [b.seconds / b.samples / by_turn[b.turn] for b in other.blocks if b.turn in by_turn]
    factor = uncertainty(ratios)
    ratio = statistics.median(ratios or [other.seconds_per_sample / base.seconds_per_sample])
    return ratio, ratio / factor, ratio * factor


def error_ratio(base: Curve, other: Curve) -> tuple[float, float, float]:
    """(error over that of another variant at equal samples, the ends of its 95 % interval); NaN if it is unknown.

    It is the geometric mean over all seeds of the largest numbers of samples that both have. It is unknown if they have
    none in common; and if one of the two is unsure, unless their pictures are alike.
    """
    _, i, j = np.intersect1d(base.samples, other.samples, return_indices=True)
    seeds = min(len(base.errors), len(other.errors))
    logarithms: list[float] = []
    for k, m in list(zip(i, j, strict=True))[::-1]:
        both = [(base.errors[s, k], other.errors[s, m]) for s in range(seeds)]
        logarithms += [math.log(b / a) for a, b in both if a > 0 and b > 0]
        if len(logarithms) >= ENOUGH_RATIOS:
            break
    is_unsure = (base.is_unsure or other.is_unsure) and any(abs(x) > ALIKE for x in logarithms)
    if not logarithms or is_unsure:
        return math.nan, math.nan, math.nan
    ratio, factor = math.exp(statistics.fmean(logarithms)), UNKNOWN_FACTOR
    if len(logarithms) > 1:
        factor = math.exp(QUANTILE * statistics.stdev(logarithms) / math.sqrt(len(logarithms)))
    return ratio, ratio / factor, ratio * factor


def scaled(truth: Truth, scale: float) -> Truth:
    """The reference for a picture of fewer pixels: the means of blocks of its pixels."""
    if scale == 1:
        return truth
    n = round(1 / scale)
    height, width = (s // n for s in truth.image.shape[:2])

    def blocks(values):
        return values[: height * n, : width * n].reshape(height, n, width, n, 3).mean(axis=(1, 3))

    image, variance = blocks(truth.image), blocks(truth.variance) / n**2
    error = truth.error * math.sqrt(variance.mean() / truth.variance.mean()) if truth.error > 0 else truth.error
    return replace(truth, image=image, error=RelativeError(error, error, error), variance=variance)


def error_of(image: np.ndarray, told: float, truth: Truth) -> float:
    """The error of a picture: beyond that of the reference, or as it tells itself where the reference is no better."""
    measured = truth.error_of(image)
    if measured == 0 or measured > CLEAR * truth.error:
        return math.sqrt(max(0.0, measured**2 - truth.error**2))
    return float(told)
