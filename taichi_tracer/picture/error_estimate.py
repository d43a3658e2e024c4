"""How far is a picture from the one that infinitely many samples would give? Told by its own samples, without that one.

The error of a pixel is the deviation of its mean. Of k independent groups of samples with the sample variance s² of
their means, it has the variance v = s²/k. Samples that are independent are groups of one. Those of a low-discrepancy
sequence are not: they avoid each other, which is why their mean is better than their variance promises. So their
sequence is scrambled twice, independently; samples of even index take the one, samples of odd index the other, and the
two halves are two groups: k = 2 and v = (mean_even − mean_odd)²/4 (replicated randomised quasi-Monte Carlo: Owen,
"Monte Carlo theory, methods and examples"). One pixel says little that way; a whole picture says enough.

The mean square error of the picture is estimated by M = Σ v / N over N pixels. The error that this picture has differs
from M, since both are random: by a variance of 2 v² k/(k − 1) per pixel, whatever the kurtosis, for that is in both.
The square of the estimated v̂ is too large for v², for normal errors by (k + 1)/(k − 1), and too small where a sample
can have few values, as with a light that is seen or not; v̂ times that of its neighbours is right there, and too small
where a single pixel stands out. The larger one is taken,

    V = max(Σ 2 v̂² k/(k + 1), Σ 2 v̂ v̂_neighbours k/(k − 1)) / N²

and ±1.96 √V, widened where few pixels decide and put on the logarithm of M, covers the error of the picture in 95 of
100 pictures. What no sample has met yet, such as a small light, is in no estimate.
"""

import math

import numpy as np

QUANTILE = 1.96  # of the normal distribution, both sides of 95 %


class RelativeError(float):
    """Relative RMSE of a picture, a fraction of its mean; NaN where it cannot be known.

    Attributes:
        low, high: the interval that contains the true one in 95 of 100 pictures.
    """

    low: float
    high: float

    def __new__(cls, value: float, low: float, high: float):
        """A float with its interval."""
        self = super().__new__(cls, value)
        self.low, self.high = float(low), float(high)
        return self

    def __getnewargs__(self) -> tuple[float, float, float]:
        """What a copy is made of."""
        return float(self), self.low, self.high

    def __str__(self) -> str:
        if math.isnan(self):
            return "unknown"
        return f"{percent(self)} ({percent(self.low)} to {percent(self.high)})"


def percent(fraction: float) -> str:
    """Three digits, or what is left of them: "1.23 %", "45.6 %", "0.00012 %"."""
    return f"{100 * fraction:.3g} %"


def relative_error(variance: np.ndarray, groups: np.ndarray, image: np.ndarray) -> RelativeError:
    """Relative RMSE √M / mean of the picture, with its 95 % interval.

    Args:
        variance: (h, w, 3) of the mean of every pixel; NaN where it is not known.
        groups: (h, w) how many independent groups of samples say so.
        image: (h, w, 3) the picture.
    """
    known = groups > 1
    mean = float(image[known].mean(dtype=np.float64)) if known.any() else 0.0
    if not mean > 0:
        return RelativeError(math.nan, math.nan, math.nan)
    per_pixel = np.where(known, np.maximum(variance, 0).sum(axis=2, dtype=np.float64), 0)  # channels err together
    total = per_pixel.sum()
    if total == 0:
        return RelativeError(0.0, 0.0, 0.0)
    value = math.sqrt(total / (3 * known.sum())) / mean
    k = np.maximum(groups, 2).astype(np.float64)
    own = (2 * per_pixel**2 * k / (k + 1)).sum()
    neighbours = (2 * per_pixel * mean_of_neighbours(per_pixel, known) * k / (k - 1)).sum()
    spread = math.sqrt(max(own, neighbours)) / total
    pixels_that_decide = total**2 / (per_pixel**2).sum()
    factor = math.exp(QUANTILE * (1 + pixels_that_decide**-0.5) * spread / 2)  # half, for the root of M
    return RelativeError(value, value / factor, value * factor)


def mean_of_neighbours(values: np.ndarray, known: np.ndarray) -> np.ndarray:
    """(h, w): the mean of the up to eight known pixels about each; 0 where there is none. Unknown values are 0."""
    height, width = values.shape
    sums, counts = np.pad(values, 1), np.pad(known.astype(np.float64), 1)
    around = [(i, j) for i in range(3) for j in range(3) if (i, j) != (1, 1)]
    total = sum(sums[i : i + height, j : j + width] for i, j in around)
    return total / np.maximum(sum(counts[i : i + height, j : j + width] for i, j in around), 1)
