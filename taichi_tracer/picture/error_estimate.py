"""How large is the error of a picture? An estimate from its own samples.

**One pixel.** The error of a pixel is the deviation of its mean from the true value. Let the samples form k independent
groups, and let s² be the sample variance of the means of these groups. Then the variance of the pixel's mean is about

    v = s² / k.

Independent samples are groups of one sample each. The samples of a low-discrepancy sequence are not independent: they
avoid each other, so that their mean is better than their variance promises. Therefore the sequence is scrambled twice,
independently. Samples of even index follow the first scrambling, samples of odd index the second. These two halves are
k = 2 groups, and v = (mean_even − mean_odd)² / 4 (replicated randomised quasi-Monte Carlo: Owen, "Monte Carlo theory,
methods and examples"). For one pixel, this estimate is rough. For a whole picture, it is precise.

**The picture.** The mean square error of N pixels is estimated by M = Σ v / N. The true mean square error of this
picture is random, and so is M. The variance of their difference is 2 v² k / (k − 1) per pixel. It does not depend on
the kurtosis of the samples, because the kurtosis affects both in the same way and cancels. Only an estimate v̂ of v is
known. There are two ways to estimate v² from it:

- v̂² is too large: for normal errors, by the factor (k + 1) / (k − 1). Therefore it is divided by this factor. It is too
  small if a sample can take only a few values, as with a light that is either seen or not.
- v̂ times the mean v̂ of the neighbouring pixels is right in this case, but too small if a single pixel stands out.

For each of the two ways, the variances of all pixels are added, and the larger sum is taken:

    V = max(Σ 2 v̂² k / (k + 1), Σ 2 v̂ v̂_neighbours k / (k − 1)) / N²

The 95 % interval is log M ± 1.96 √V / M. It uses the logarithm, because M cannot be negative. It is widened if few
pixels contain most of the error. In 95 of 100 pictures, it contains the true error. An estimate cannot include light
that no sample has found yet, such as a small light.
"""

import math

import numpy as np
import taichi as ti
import taichi.math as tm

QUANTILE = 1.96  # 95 % of a normal distribution lie within this number of standard deviations from its mean
CHANNELS = 3  # red, green and blue: the mean square error is a mean over pixels and channels


# Kernels compute standard errors, and only numpy squares them, in f64: in f32, the square of 1e-30 is 0, so that the
# picture of a dim lamp would seem to have no error, and the square of 1e30 is infinite.


@ti.func
def error_from_deviation(deviation, scale, n):
    """Standard error s/√n of the mean of n independent samples; it is NaN for fewer than two samples.

    Args:
        deviation: the sum of their squared deviations from the mean, each multiplied by ``scale`` before it is squared.
    """
    squares = ti.max(deviation, 0.0)  # rounding can make the sum for samples that are all alike negative
    return tm.sqrt(squares) / tm.sqrt(ti.cast(n, float) * (n - 1)) / scale


@ti.func
def error_from_halves(total_even, n_even, total_odd, n_odd):
    """Standard error of the mean of two independent halves, from the sum and the number of the samples of each.

    If a half of n_i samples has the variance σ²/n_i, then the squared difference of the two means has the expectation
    σ² n/(n_even n_odd) for n = n_even + n_odd, and the mean of all has the variance σ²/n. For equal halves the standard
    error is half of the difference. It is not finite if a half has no samples.
    """
    n = n_even + n_odd
    difference = total_even / n_even - total_odd / n_odd
    return abs(difference) * tm.sqrt(ti.cast(n_even, float) * n_odd) / n


# The squares of scaled deviations between these two limits, and the sum of 2^27 of them, are normal numbers of f32.
SMALLEST_SCALED, LARGEST_SCALED = 2.0**-50, 2.0**50
SCALE_STEP = 2.0**60  # a power of two, so that scaling rounds nothing


@ti.func
def scale_for(scale, deviation, is_first):
    """The scale with which a deviation can be squared: the present one, or another one where that is out of range.

    It is 1 unless light is dimmer than 1e-15 or brighter than 1e15. A smaller scale is always taken where the deviation
    asks for it, since what was added up before is negligible then; a larger one, only for the first deviation.
    """
    scaled = deviation * scale
    while scaled > LARGEST_SCALED:
        scale /= SCALE_STEP
        scaled /= SCALE_STEP
    if is_first:
        while 0 < scaled < SMALLEST_SCALED:
            scale *= SCALE_STEP
            scaled *= SCALE_STEP
    return scale


class RelativeError(float):
    """Relative RMSE of a picture: a fraction of the picture's mean. It is NaN if it is unknown.

    Attributes:
        low, high: the 95 % interval: in 95 of 100 pictures, the true error lies inside.
    """

    low: float
    high: float

    def __new__(cls, value: float, low: float, high: float) -> "RelativeError":
        """Make a float that knows its interval."""
        self = super().__new__(cls, value)
        self.low, self.high = float(low), float(high)
        return self

    def __getnewargs__(self) -> tuple[float, float, float]:  # type: ignore[override]  # float has one argument
        """The arguments with which ``copy`` and ``pickle`` make it again."""
        return float(self), self.low, self.high

    def __str__(self) -> str:
        if not math.isfinite(self):
            return "unknown"
        return f"{percent(self)} ({percent(self.low)} to {percent(self.high)})"


def percent(fraction: float) -> str:
    """The fraction in percent, with three digits and no power of ten: "1.23 %", "45.6 %", "1,310 %"; or "unknown"."""
    if not math.isfinite(fraction):
        return "unknown"
    value = 100 * fraction
    return f"{value:,.0f} %" if abs(value) >= 1000 else f"{value:.3g} %"


def relative_error(variance: np.ndarray, groups: np.ndarray, image: np.ndarray) -> RelativeError:
    """Relative RMSE √M / mean of the picture, with its 95 % interval.

    Args:
        variance: (h, w, 3) the estimated variance v̂ of the mean of every pixel.
        groups: (h, w) the number k of independent groups of samples from which v̂ was estimated. If it is below 2, v̂
            is unknown, and the pixel is left out.
        image: (h, w, 3) the picture.
    """
    known = groups > 1
    mean = float(image[known].mean(dtype=np.float64)) if known.any() else 0.0
    if not mean > 0:
        return RelativeError(math.nan, math.nan, math.nan)
    # The errors of the channels of a pixel are correlated: a light that a sample misses is missing in all of them.
    # Therefore the variances of the channels are added first, and only their sum is squared.
    v = np.where(known, np.maximum(variance, 0).sum(axis=2, dtype=np.float64), 0)
    total = v.sum()
    if not math.isfinite(total):
        return RelativeError(math.nan, math.nan, math.nan)
    if total == 0:
        return RelativeError(0.0, 0.0, 0.0)
    value = math.sqrt(total / (CHANNELS * known.sum())) / mean

    k = np.maximum(groups, 2).astype(np.float64)  # for fewer groups, v is 0
    own = (2 * v**2 * k / (k + 1)).sum()
    neighbours = (2 * v * mean_of_neighbours(v, known) * k / (k - 1)).sum()
    relative_deviation = math.sqrt(max(own, neighbours)) / total  # √V / M
    pixels_that_decide = total**2 / (v**2).sum()  # this number of pixels of equal variance has the same uncertainty
    widening = 1 + pixels_that_decide**-0.5  # V is an estimate too; from n pixels, its error is about 1/√n
    factor = math.exp(QUANTILE * widening * relative_deviation / 2)  # divided by 2, because the error is the root of M
    return RelativeError(value, value / factor, value * factor)


def mean_of_neighbours(values: np.ndarray, known: np.ndarray) -> np.ndarray:
    """(h, w): for every pixel, the mean of its known neighbours (up to eight); 0 if no neighbour is known.

    Args:
        values: (h, w), 0 where they are unknown.
        known: (h, w) bool.
    """
    height, width = values.shape
    sums, counts = np.pad(values, 1), np.pad(known.astype(np.float64), 1)  # adds a border of unknown pixels
    around = [(i, j) for i in range(3) for j in range(3) if (i, j) != (1, 1)]  # (1, 1) is the pixel itself
    total = sum(sums[i : i + height, j : j + width] for i, j in around)
    number = sum(counts[i : i + height, j : j + width] for i, j in around)
    return total / np.maximum(number, 1)
