"""How large is the error of a picture? An estimate from its own samples.

**One pixel.** The error of a pixel is the deviation of its mean from the true value. Let the samples form k independent
groups, and let s² be the sample variance of the means of these groups. Then the variance of the pixel's mean is about

    v = s² / k.

Independent samples are groups of one sample each. The samples of a low-discrepancy sequence are not independent: they
avoid each other, so that their mean is better than their variance promises. Therefore the sequence is scrambled twice,
independently. Samples of even index follow the first scrambling, samples of odd index the second. These two halves are
k = 2 groups, and v = (mean_even − mean_odd)² / 4 (replicated randomised quasi-Monte Carlo: Owen, "Monte Carlo theory,
methods and examples"). For one pixel, this estimate is rough. For a whole picture, it is precise.

**One sequence.** If all samples of a pixel are one sequence, the mean is better, and there are no independent groups.
Then the halves are the first 2^m samples, with the mean A, and the n − 2^m others, with the mean B. Both err equally if
they are equally many, and whatever their covariance, E[(A − B)² / 4] = e²(n/2) − e²(n): what the doubling of the
samples removes of the mean square error e². For independent samples this is e²(n). Because the samples of a sequence
avoid each other, it is more: if e² falls as n^(−5/4), e²(n) is 0.73 of it, and 0.55 if as n^(−3/2). The sequence is one
in base 4, so that a doubling that completes a power of 4 removes more than the one before. Therefore

    v = κ² (A − B)² 2^m (n − 2^m) / n²

with the κ that was measured for both kinds of doublings, as a mean over scenes. It differs from scene to scene, and the
interval below is widened by ``LARGER_TO_POWER``, ``LARGER_FROM_POWER`` and ``SMALLER``. It differs more after a
doubling that begins at a power of 4: where light is smooth, 4^k samples err so little that 2 · 4^k err nearly as much.
``python -m benchmarks.claims`` counts how often the interval holds the truth. If the others are fewer than a quarter of
2^m, their mean is too rough. Then A − B is that of the last doubling.

**The picture.** The mean square error of N pixels is estimated by M = Σ v / N. The true mean square error is random,
too: both are sums of squares of about normal numbers, as many as pixels matter. If single pixels have most of the
error, few do: Satterthwaite's number of equally noisy pixels is

    ν = (Σ v)² / Σ v².

If both are sums of 2ν squares, the ratio of true to estimated M has the F-distribution with (2ν, 2ν) degrees of
freedom. Therefore the error lies between e / F and e F with 95 % probability, where e = √M, and F² is the 0.975
quantile of this distribution. Because every v is rough, ν comes out too small rather than too large, and the interval a
little wide.

**Pixels that halves do not know.** A small bright spot, of which each half has met one sample, makes both halves alike:
then v is 0, although one sample more or less would change the pixel by d = (m − μ)/n, if m is the largest of its n
samples and μ is their mean. As long as such pixels are many, their v are right on average. But if a single pixel has
most of the error, the picture would seem to be exact. Therefore the upper end is computed with v or (β d)², whichever
is larger in each pixel, with β = ``ONE_SAMPLE``; unless this gives less than e F. (Independent samples need no such
rule: their s² / n is never less than d².)

**The mean of the picture.** The error is a fraction of the true mean μ of the picture, and only the mean m of the
samples is known. Pixels are independent of each other, and the channels of a pixel err together, so that the standard
error of m is at most s = √(Σ v / 3) / N, with the larger v of the upper end. With δ = s/m, 95 % of the μ lie between
m (1 − 2δ) and m (1 + 2δ). Therefore the lower end is divided by 1 + 2δ, and the upper one by 1 − 2δ. If δ is ½ or more,
the error is unknown: then m may be all noise.

**What no sample met.** Samples cannot show a small sun that no sample has met, nor what a narrow lobe reflects if
directions are drawn from the lights alone. ``small_suns`` and its neighbours find the first, and ``technique_check``
the second by samples of the other technique; ``unseen_light`` knows lamps that are hard to find. The upper end of the
interval is √((e F)² + unseen²), before it is divided.
"""

import math
from typing import Any

import numpy as np

QUANTILE_RANGE = 30  # beyond this multiple of 1/√ν, practically nothing of the F-distribution is left
TELLS_UNSEEN = 0.1  # of the upper end: less of it need not be said
ONE_SAMPLE = 0.5  # β: so large that the interval holds the truth (``python -m benchmarks.claims``)
TO_POWER_OF_4, FROM_POWER_OF_4 = 0.76, 0.83  # κ, if 2^(m+1) is a power of 4, and if 2^m is one
POWERS_OF_4 = 0x55555555
# The logarithms of the factors by which the true κ may be larger, of both kinds, and smaller: so large that the
# interval holds the truth. If n samples are few, κ may be much smaller, because the first doublings can remove nearly
# all of the error; or larger, because they can remove nearly none: then a second number, divided by n, is added.
LARGER_TO_POWER, LARGER_FROM_POWER, LARGER_OF_FEW = 0.2, 0.47, 0.4
SMALLER, SMALLER_OF_FEW = 0.6, 1.5
FEW_OTHERS = 4  # samples after the first 2^m are too few if there are fewer than a quarter of these
STANDARD_ERRORS = 2.0  # of a normal number, between which 95 % lie
CHANNELS = 3  # red, green and blue: the mean square error is a mean over pixels and channels


def errors_of_sequence(before: np.ndarray, total: np.ndarray, counts: np.ndarray) -> np.ndarray:
    """Standard errors of the means of one sequence, see above; NaN where a pixel has fewer than two samples.

    Args:
        before: (w, h, 3) the mean of the first half of the first samples.
        total, counts: (w, h, 2, 3) and (w, h, 2), sum and number of the first 2^m samples, and of those after them.
    """
    errors, (n_first, n_others) = errors_from_halves(total, counts), np.moveaxis(counts, 2, 0)
    with np.errstate(divide="ignore", invalid="ignore"):
        of_doubling = abs(total[:, :, 0] / n_first[..., None].astype(total.dtype) - before)
    has_few, is_from_power = last_doubling(n_first, n_others)
    kappa = np.where(is_from_power, FROM_POWER_OF_4, TO_POWER_OF_4).astype(total.dtype)
    return kappa[..., None] * np.where(has_few[..., None], of_doubling, errors)


def last_doubling(n_first: Any, n_others: Any) -> tuple[Any, Any]:
    """(whether the others are too few to be a half, whether the last doubling begins at a power of 4)."""
    has_few = (n_others > 0) & (n_others * FEW_OTHERS < n_first)
    return has_few, (n_first & POWERS_OF_4 != 0) ^ has_few


def errors_from_halves(total: np.ndarray, counts: np.ndarray) -> np.ndarray:
    """Standard errors of the means of two independent halves, of their sums and numbers; NaN if one is empty.

    If a half of n_i samples has the variance σ²/n_i, then the squared difference of the two means has the expectation
    σ² n/(n_even n_odd) for n = n_even + n_odd, and the mean of all has the variance σ²/n. For equal halves the standard
    error is half of the difference.
    """
    n_even, n_odd = (counts[:, :, half, None].astype(total.dtype) for half in range(2))
    with np.errstate(divide="ignore", invalid="ignore"):
        difference = total[:, :, 0] / n_even - total[:, :, 1] / n_odd
        return abs(difference) * np.sqrt(n_even * n_odd) / (n_even + n_odd)


def errors_from_deviations(deviation: np.ndarray, count: np.ndarray) -> np.ndarray:
    """(w, h, 3) standard errors s/√n of means of n samples, from sums of squared deviations; NaN for n < 2."""
    n = count[..., None].astype(np.float64)
    with np.errstate(divide="ignore", invalid="ignore"):
        return np.sqrt(np.maximum(deviation, 0) / (n * (n - 1)))


class RelativeError(float):
    """Relative RMSE of a picture: a fraction of the picture's mean. It is NaN if it is unknown.

    The error of a picture is the root of the mean over all pixels and channels of the squared difference to the true
    picture, divided by the mean of the picture. No pixel is left out.

    Attributes:
        low, high: the 95 % interval: in 95 of 100 pictures, the true error lies inside.
        unseen: what light may add that no sample has met; ``high`` contains it. It is 0 if no light can be missed.
    """

    low: float
    high: float
    unseen: float

    def __new__(
        cls, value: float, low: float = math.nan, high: float = math.nan, unseen: float = 0.0
    ) -> "RelativeError":
        """Make a float that knows its interval."""
        self = super().__new__(cls, value)
        self.low, self.high, self.unseen = float(low), float(high), float(unseen)
        return self

    def __str__(self) -> str:
        if not math.isfinite(self):
            return "unknown"
        text = f"{percent(self)} ({percent(self.low)} to {percent(self.high)})"
        if self.unseen > TELLS_UNSEEN * self.high:
            text += f"; light that no sample met may add {percent(self.unseen)}"
        return text


def percent(fraction: float) -> str:
    """The fraction in percent, with three digits and no power of ten: "1.23 %", "45.6 %", "1,310 %"; or "unknown"."""
    if not math.isfinite(fraction):
        return "unknown"
    value = 100 * fraction
    return f"{value:,.0f} %" if abs(value) >= 1000 else f"{value:.3g} %"


def relative_error(
    variance: np.ndarray,
    image: np.ndarray,
    unseen: float = 0.0,
    samples_of_one: float = 0.0,
    of_largest: np.ndarray | None = None,
) -> RelativeError:
    """Relative RMSE √M / mean of the picture, with its 95 % interval.

    Args:
        variance: (h, w, 3) the estimated variance v̂ of the mean of every pixel. If it is NaN, it is unknown, and the
            pixel is left out.
        image: (h, w, 3) the picture.
        unseen: the relative RMSE that light may add that no sample met.
        samples_of_one: the number of samples of a pixel, if v̂ comes from the doubling of one sequence, so that the
            interval is wider; otherwise 0.
        of_largest: (h, w) the d of every pixel, see above; None if v̂ comes from the spread of independent samples.
    """
    known = ~np.isnan(variance).all(axis=2)
    mean = float(image[known].mean(dtype=np.float64)) if known.any() else 0.0
    # The errors of the channels of a pixel are correlated: a light that a sample misses is missing in all of them.
    # Therefore the variances of the channels are added first, and only their sum is squared.
    v = np.where(known, sum(np.maximum(variance[..., k], 0, dtype=np.float64) for k in range(CHANNELS)), 0)
    if not (mean > 0 and math.isfinite(v.sum())):
        return RelativeError(math.nan)
    in_units_of_mean = 1 / (CHANNELS * known.sum() * mean**2)
    larger = smaller = 0.0
    if samples_of_one >= 2:
        first = 1 << (round(samples_of_one) - 1).bit_length() - 1
        _, is_from_power = last_doubling(first, samples_of_one - first)
        larger = (LARGER_FROM_POWER if is_from_power else LARGER_TO_POWER) + LARGER_OF_FEW / samples_of_one
        smaller = SMALLER + SMALLER_OF_FEW / samples_of_one
    value = math.sqrt(v.sum() * in_units_of_mean)
    high, low = value * factor_of_interval(v, larger), value / factor_of_interval(v, smaller)
    if of_largest is not None:
        v = np.where(known, np.maximum(v, CHANNELS * (ONE_SAMPLE * of_largest) ** 2), 0)
        high = max(high, math.sqrt(v.sum() * in_units_of_mean) * factor_of_interval(v, larger))
    doubt = STANDARD_ERRORS * math.sqrt(v.sum() / CHANNELS) / (known.sum() * mean)  # 2δ
    if doubt >= 1:
        return RelativeError(math.nan)
    return RelativeError(value, low / (1 + doubt), math.hypot(high, unseen) / (1 - doubt), unseen)


def factor_of_interval(v: np.ndarray, spread: float) -> float:
    """F for the variances v of the pixels (1 if all of them are 0), widened by the logarithm of another factor."""
    factor = error_quantile(float(v.sum() ** 2 / (v**2).sum())) if v.any() else 1.0
    return math.exp(math.hypot(math.log(factor), spread))


def error_quantile(nu: float) -> float:
    """F: the root of the 0.975 quantile of the F-distribution with (2ν, 2ν) degrees of freedom, for ν ≥ 1.

    The logarithm of a number with this distribution has a density in proportion to cosh(t/2)^(−2ν).
    """
    t = np.linspace(0, QUANTILE_RANGE / math.sqrt(nu), 2001)
    density = np.exp(-2 * nu * np.log(np.cosh(t / 2)))
    cumulative = np.concatenate([[0], np.cumsum((density[1:] + density[:-1]) / 2)])
    return math.exp(float(np.interp(0.95, cumulative / cumulative[-1], t)) / 2)
